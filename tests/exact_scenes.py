"""Scenes of a few balls for `exact`, and what it makes of them."""

from collections.abc import Iterable

from sandbox.engines.exact.engine import ExactEngine
from sandbox.scene.files import parse
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts, State

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
    for _ in range(steps):
        engine.step()
    return engine.state()


def after(scene: Scene, seconds: float) -> State:
    return play(engine_of(scene), round(seconds * scene.rate))


def contacts_of(scene: Scene, seconds: float) -> Contacts:
    engine = engine_of(scene)
    play(engine, round(seconds * scene.rate))
    return engine.contacts()
