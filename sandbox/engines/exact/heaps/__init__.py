"""Discs that touch, beyond single contacts: found by `touching`, for impacts without end and for heaps at rest.

`collapse` ends sequences of impacts, `islands` freezes and wakes heaps, and `statics` finds what contacts carry: for
heaps their weight, and for impacts without end the impulses that stop them.

Until a heap is frozen, its discs move apart in hops of about the world's hop time: at 900 px/s² and HOP_TIME these are
1.1e-4 px high. A disc that carries others hops faster, so that the contacts of a pair, about 1/HOP_TIME a second, grow
only as the root of the load. So the walls get the weight of a heap. A disc also goes round the end of a wall in hops:
one of radius 10 px that goes off a shelf of 4 px at 20 or 50 px/s leaves it up to 0.03 px/s too fast and, with friction
up to 1, its rim up to 0.1 px/s too slow.
"""
