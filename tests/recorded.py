"""An engine that has done some steps, and the contacts that it recorded."""

from typing import Any

from sandbox.engines import create
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.state import Contacts


def recorded(name: str, scene: Scene, steps: int) -> tuple[Any, Contacts]:
    engine = create(name, scene, spawn(scene))
    engine.record_contacts()
    for _ in range(steps):
        engine.step()
    return engine, engine.contacts()
