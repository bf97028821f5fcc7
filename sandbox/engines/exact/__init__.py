"""Event-driven hard discs: from impact to impact, with no time step and no error but rounding.

Read `event_loop` first: it processes one event after another. Each disc has one event: its earliest predicted contact,
or its crossing into the next cell of the `grid`, whichever comes first (`prediction`). The earliest event of all is
next (`event_queue`). `contact` has the law of contact, and `support` is for discs that walls carry. `world` holds the
data, and `engine` runs the loop. Discs that touch each other, in sequences of impacts without end and in heaps that
stand still, come last: `heaps`.

Between impacts a disc flies on a parabola, or slides or rolls along a wall with constant acceleration, so the time of
the next impact is known in closed form (`sandbox.engines.laws`).

Only the discs that an event concerns are moved (delayed states: B. D. Lubachevsky, J. Comput. Phys. 94 (1991) 255). A
predicted contact with a disc that has since changed course is recognised when it comes up, by that disc's serial
number, and replaced by a new prediction. No contact is missed: of any two discs, the one predicted last used the
other's present course.

A contact costs the predictions of two discs, each against the discs of 3 x 3 cells, and O(log n) in the event queue.
The clock is one double: after t seconds a contact is late or early by up to 1e-16 t, and 1e-16 t v px deep.
"""

from sandbox.engines.exact.engine import ExactEngine

__all__ = ["ExactEngine"]
