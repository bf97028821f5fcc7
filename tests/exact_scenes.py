"""Scenes of a few balls for `exact`, and what it makes of them."""

from collections.abc import Iterable

import numpy as np
from conftest import do_steps

from sandbox.engines.exact.engine import ExactEngine
from sandbox.quantity import tangent
from sandbox.scene.files import parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts, State, States

EXACT = 1e-9


def lines(**keys: float | list[float]) -> str:
    values = {key: value if isinstance(value, list | bool) else float(value) for key, value in keys.items()}
    return "".join(f"{key} = {value!r}\n".lower() for key, value in values.items())


def ball(position: Iterable[float], velocity: Iterable[float] = (0, 0), **more: float) -> str:
    """Return a ball of radius 10 px."""
    where = {"position": [*map(float, position)], "velocity": [*map(float, velocity)]}
    return "[[balls]]\n" + lines(**where, **{"radius": 10} | more)


def wall(start: Iterable[float], to: Iterable[float], thickness: float = 4.0, **more: float) -> str:
    ends = {"from": [*map(float, start)], "to": [*map(float, to)]}
    return "[[walls]]\n" + lines(**ends, thickness=thickness, **more)


def box_of(*parts: str, head: str = "", size: Iterable[float] = (800, 600), **arena: float) -> Scene:
    return parse(f"{head}\n[arena]\nsize = {[*size]}\n{lines(**arena)}{''.join(parts)}", "test")


def engine_of(scene: Scene) -> ExactEngine:
    engine = ExactEngine(scene, spawn(scene))
    engine.record_contacts()
    return engine


def play(engine: ExactEngine, steps: int) -> State:
    do_steps(engine, steps)
    return engine.state()


def after(scene: Scene, seconds: float) -> State:
    return play(engine_of(scene), round(seconds * scene.rate))


def contacts_of(scene: Scene, seconds: float) -> Contacts:
    engine = engine_of(scene)
    play(engine, round(seconds * scene.rate))
    return engine.contacts()


def accounted(scene: Scene, steps: int) -> tuple[States, Contacts]:
    """Play a scene, and check that its contacts and gravity account for each ball's velocity and spin at every step."""
    engine, start, bodies = engine_of(scene), spawn(scene), scene.bodies
    states = States.empty(steps + 1, len(bodies))
    states.fill(0, start)
    for step in range(steps):
        engine.step()
        states.fill(step + 1, engine.state())
    found = engine.contacts()
    given = found["impulse"][:, None] * found["normal"] + found["tangential"][:, None] * tangent(found["normal"])
    row = np.clip(np.ceil(found["time"] * scene.rate - 1e-9).astype(int), 1, steps)
    between = found["second"] >= 0
    change, turned = np.zeros_like(states.velocity), np.zeros_like(states.spin)
    change[1:] = np.array(scene.gravity) / scene.rate
    for side, sign, which in (("first", -1, slice(None)), ("second", 1, between)):
        who = found[side][which]
        np.add.at(change, (row[which], who), sign * given[which] / bodies.mass[who][:, None])
        np.add.at(turned, (row[which], who), -2 * found["tangential"][which] / (bodies.mass * bodies.radius)[who])
    scale = max(1.0, float(np.abs(states.velocity).max()))
    assert np.abs(states.velocity - start.velocity - change.cumsum(axis=0)).max() < EXACT * scale
    assert np.abs((states.spin - start.spin - turned.cumsum(axis=0)) * bodies.radius).max() < EXACT * scale
    return states, found
