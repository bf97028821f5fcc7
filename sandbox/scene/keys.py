"""Single values of a scene, by their keys: gravity, balls.0.radius, elasticity."""

import math
from typing import Any, Final

from sandbox.errors import SandboxError, suggestion
from sandbox.scene.model import Scene

OF_CONTACTS: Final = {"elasticity": 1.0, "friction": math.inf}  # of every contact -> its largest value


def with_value(scene: Scene, key: str, value: object) -> Scene:
    """Return a scene with another value, and without its expectations.

    key: with dots between its parts, and numbers from 0 in lists, such as balls.0.radius or gravity.1; or elasticity or
    friction, for that of every contact. Raises SandboxError if there is no such key, or the value is not valid.
    """
    if key in OF_CONTACTS:
        if not isinstance(value, int | float) or not 0 <= value <= OF_CONTACTS[key] or math.isinf(value):
            most = "a number from 0 to 1" if OF_CONTACTS[key] == 1 else "a number of at least 0"
            raise SandboxError(f"{key} must be {most}, got {value}")
        return with_every_contact(scene, key, value)
    table, *path = key.split(".")
    if table not in (known := type(scene).model_fields):
        raise SandboxError(f"{key}: is not a key of the scene; {suggestion(table, [*known, *OF_CONTACTS])}")
    if path:
        document = scene.model_dump(
            mode="json", by_alias=True, include={table}, exclude_unset=table in scene.model_fields_set
        )
        value = _replaced(document[table], path, value, key)
    return scene.changed(**{"expect": (), table: value})


def with_every_contact(scene: Scene, key: str, value: float) -> Scene:
    """Return a scene in which every contact has an elasticity or a friction, and without its expectations.

    That of a contact is the product of two factors, so each factor becomes the square root.
    """
    factor = {key: math.sqrt(value)}
    return scene.changed(
        arena=scene.arena.model_copy(update=factor),
        balls=tuple(group.model_copy(update=factor) for group in scene.balls),
        walls=tuple(wall.model_copy(update=factor) for wall in scene.walls),
        expect=(),
    )


def _replaced(document: Any, path: list[str], value: object, key: str) -> Any:
    """Return a part of a document with another value at a path in it."""
    if not path:
        return value
    part, *rest = path
    if isinstance(document, list):
        if not part.isdecimal() or int(part) >= len(document):
            most = f"must be a number from 0 to {len(document) - 1}" if document else "is in an empty list"
            raise SandboxError(f"{key}: {part} {most}")
        index = int(part)
        return [*document[:index], _replaced(document[index], rest, value, key), *document[index + 1 :]]
    if not isinstance(document, dict):
        raise SandboxError(f"{key}: has no key {part}; it is a single value")
    return document | {part: _replaced(document.get(part, {}), rest, value, key)}
