"""A worksheet to print: the first contacts of a scene with other numbers for each pupil, and the answers."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np

from sandbox.analysis.comparison import compare
from sandbox.errors import SandboxError
from sandbox.report.first_contacts import FirstContact, columns, first_contacts
from sandbox.report.html import templates
from sandbox.report.numbers import number
from sandbox.scene.files import ball_groups
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.scene.walls import walls_of

MAX_BALLS: Final = 12  # in a sheet's picture
CONTACTS: Final = 2  # on a sheet, which has room for so many tables
MASSES: Final = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0)  # times those of the scene
SPEEDS: Final = np.arange(10, 31) / 20  # times those of the scene
SLOWEST_ROUNDED: Final = 10.0  # px/s: faster ones are whole numbers
MAX_DRAWS: Final = 100  # of numbers for a pupil, until they differ from all others' and something happens
ARROW: Final = 0.25  # s, in which a ball would come to the end of its arrow


class Sheet(NamedTuple):
    """What a pupil gets: a scene, and its first contacts with what the law of impacts asks for."""

    scene: Scene
    contacts: list[FirstContact]


def worksheet(scene: Scene, pupils: int, *, with_answers: bool) -> str:
    """Return a page of HTML with a sheet for each pupil, and then the answers.

    Masses and speeds are drawn by the scene's seed and the pupil's number; `exact` gives the answers.
    Raises SandboxError if the scene has too many balls, if nothing happens in it, or if its numbers do not differ for
    so many pupils.
    """
    if len(scene.bodies) > MAX_BALLS:
        raise SandboxError(f"{scene.name} has {len(scene.bodies)} balls; a sheet has room for {MAX_BALLS}")
    values = {
        "scene": scene,
        "sheets": list(_sheets(scene, pupils)),
        "with_answers": with_answers,
        "units": scene.units,
    }
    functions = {"picture": _picture, "law": _law, "columns": columns(scene.units)}
    return templates().get_template("worksheet.html").render(values | functions)


def _sheets(scene: Scene, pupils: int) -> Iterator[Sheet]:
    seen: set[bytes] = set()
    for pupil in range(pupils):
        rng = np.random.default_rng([scene.seed, pupil])
        for _ in range(MAX_DRAWS):
            own = _with_other_numbers(scene, rng)
            numbers = own.bodies.mass.tobytes() + spawn(own).velocity.tobytes()
            if numbers in seen:
                continue
            if contacts := list(first_contacts(own, compare(own, ["exact"]).runs["exact"], CONTACTS)):
                seen.add(numbers)
                yield Sheet(own, contacts)
                break
        else:
            if not seen:
                raise SandboxError(f"{scene.name}: nothing touches in {scene.seconds:g} s, so there is nothing to ask")
            raise SandboxError(f"{scene.name}: its numbers differ for {len(seen)} pupils at most")


def _with_other_numbers(scene: Scene, rng: np.random.Generator) -> Scene:
    """Return a scene whose balls have other masses and speeds."""
    bodies, start = scene.bodies, spawn(scene)
    mass = bodies.mass * rng.choice(MASSES, len(bodies))
    velocity = start.velocity * rng.choice(SPEEDS, len(bodies))[:, None]
    if np.abs(velocity).max(initial=0) > SLOWEST_ROUNDED:
        velocity = np.round(velocity)
    own = replace(bodies, mass=mass)
    groups = list(ball_groups(own, replace(start, velocity=velocity), scene.colors))
    return scene.changed(balls=groups, expect=())


def _law(scene: Scene, contact: FirstContact) -> str:
    """Return what the law of impacts needs to know of a contact, besides masses and velocities."""
    (first, second), balls = contact.bodies, scene.bodies
    others, other = (balls, second) if second >= 0 else (walls_of(scene), ~second)
    restitution, mu = balls.elasticity[first] * others.elasticity[other], balls.friction[first] * others.friction[other]
    normal = ", ".join(number(round(x, 4)) for x in contact.normal)
    slides = f", coefficient of friction {mu:.4g}" if mu else ""
    return f"Coefficient of restitution e = {restitution:.4g}{slides}; normal n = ({normal})."


def _picture(scene: Scene) -> dict[str, Any]:
    """Return what the picture of a scene's start draws, in px: its size, walls, and balls with arrows."""
    start, bodies = spawn(scene), scene.bodies
    ends = start.position + ARROW * start.velocity
    parts = zip(start.position.tolist(), ends.tolist(), bodies.radius.tolist(), scene.colors, strict=True)
    return {
        "size": scene.arena.size,
        "walls": [(*wall.start, *wall.to, wall.thickness) for wall in scene.walls],
        "balls": [{"at": at, "end": end, "radius": radius, "colour": colour} for at, end, radius, colour in parts],
        "unit": max(scene.arena.size) / 100,
    }
