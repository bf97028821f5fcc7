"""What to do about an exception of a program: calls of older versions of Pymunk, and a display that is missing."""

import re
from collections.abc import Mapping
from typing import Final

import pymunk

_COLLISION: Final = (
    "space.on_collision(type_a, type_b, begin=..., pre_solve=..., post_solve=..., separate=...); instead of returning "
    "False, a callback sets arbiter.process_collision = False"
)
_SHAPE_FILTER: Final = "shape.filter = pymunk.ShapeFilter(group=..., categories=..., mask=...)"
_ON_BODY: Final[Mapping[str, str]] = {
    "apply_force": "body.apply_force_at_local_point(force, point)",
    "apply_impulse": "body.apply_impulse_at_local_point(impulse, point)",
    "reset_forces": "nothing: forces last for one step",
    "velocity_limit": "a velocity_func that scales body.velocity",
    "angular_velocity_limit": "a velocity_func that limits body.angular_velocity",
    "is_static": "body.body_type == pymunk.Body.STATIC",
    "is_rogue": "body.space is None",
    "update_position_func": "body.position_func",
}
_ON_SPACE: Final[Mapping[str, str]] = {
    "add_collision_handler": _COLLISION,
    "add_wildcard_collision_handler": _COLLISION,
    "add_default_collision_handler": _COLLISION,
    "set_default_collision_handler": _COLLISION,
    "add_static": "space.add(...), with shapes on space.static_body",
    "remove_static": "space.remove(...)",
    "elastic_iterations": "space.iterations",
    "resize_static_hash": "nothing: Pymunk does that itself",
    "resize_active_hash": "nothing: Pymunk does that itself",
    "nearest_point_query": "space.point_query(point, max_distance, shape_filter)",
    "nearest_point_query_nearest": "space.point_query_nearest(point, max_distance, shape_filter)",
}
_ON_VECTOR: Final[Mapping[str, str]] = {
    "rotate": "v = v.rotated(angle)",
    "rotate_degrees": "v = v.rotated_degrees(degrees)",
    "get_length": "v.length",
    "get_angle": "v.angle",
    "get_angle_degrees": "v.angle_degrees",
    "normalize_return_length": "v, length = v.normalized_and_length()",
    "normalize": "v = v.normalized()",
    "get_dist": "v.get_distance(w)",
}
_ON_SHAPE: Final[Mapping[str, str]] = {
    "get_points": "poly.get_vertices()",
    "set_layers": _SHAPE_FILTER,
    "layers": _SHAPE_FILTER,
    "group": _SHAPE_FILTER,
}
_IN_MODULES: Final[Mapping[str, Mapping[str, str]]] = {
    "pymunk": {
        "inf": "float('inf'); for a body that never moves, pymunk.Body(body_type=pymunk.Body.STATIC)",
        "init_pymunk": "nothing: Pymunk does that itself",
        "pymunkoptions": "nothing",
        "CollisionHandler": _COLLISION,
        "constraint": "pymunk.constraints",
    },
    "pymunk.pygame_util": {
        "draw": "space.debug_draw(pymunk.pygame_util.DrawOptions(screen))",
        "draw_space": "space.debug_draw(pymunk.pygame_util.DrawOptions(screen))",
        "flip_y": "pymunk.pygame_util.positive_y_is_up",
    },
    "pymunk.pyglet_util": {"draw": "space.debug_draw(pymunk.pyglet_util.DrawOptions())"},
}
_MISSING_MODULES: Final[Mapping[str, str]] = {
    "pymunk.constraint": "pymunk.constraints",
    "pymunkoptions": "nothing: leave the import out",
}
_BY_MESSAGE: Final = (  # class of the exception, a pattern of its message, what to do
    (AttributeError, r"^can't set attribute|has no setter",
     "A Vec2d cannot be changed; assign a new one: body.velocity = (x, y)."),
    (TypeError, r"Vec2d.* missing 1 required positional argument: 'y'", "Write Vec2d(x, y), or Vec2d(*pair)."),
    (TypeError, r"Vec2d.* missing 2 required positional arguments", "Write Vec2d.zero()."),
    (TypeError, r"'(dict_keys|KeysView|WeakKeysView)' object is not subscriptable",
     "space.shapes, space.bodies and body.shapes are views since Pymunk 7; write list(space.shapes)[0]."),
    (RuntimeError, r"(dictionary|Set) changed size during iteration",
     "space.shapes and space.bodies are views since Pymunk 7; loop over list(space.shapes)."),
    (Exception, r"Unsupported type\s+<class '(list|tuple)'>",
     "Pymunk takes no lists since version 6; write space.add(*objects)."),
)  # fmt: skip


def hint(error: BaseException) -> str:
    """Return what to do about an exception of a program; empty if it is not one that the sandbox knows."""
    return _removed(error) or _by_message(error) or _display(error)


def _removed(error: BaseException) -> str:
    """Name what replaces a name that Pymunk no longer has."""
    if isinstance(error, AttributeError) and error.name:
        name, thing = error.name, error.obj
        owner, replacements = _names_of(thing)
        if name in replacements:
            return _instead(f"{owner}.{name}", replacements[name])
    if isinstance(error, ImportError) and error.name:
        if error.name in _MISSING_MODULES:
            return _instead(error.name, _MISSING_MODULES[error.name])
        missing = re.match(r"cannot import name '(\w+)'", error.msg)
        if missing and missing[1] in (names := _IN_MODULES.get(error.name, {})):
            return _instead(f"{error.name}.{missing[1]}", names[missing[1]])
    return ""


def _names_of(thing: object) -> tuple[str, Mapping[str, str]]:
    """Return what an object is called, and the names that it had in older versions."""
    module = getattr(thing, "__name__", "")
    if module in _IN_MODULES:
        return module, _IN_MODULES[module]
    for kind, replacements in (
        (pymunk.Space, _ON_SPACE),
        (pymunk.Body, _ON_BODY),
        (pymunk.Vec2d, _ON_VECTOR),
        (pymunk.Shape, _ON_SHAPE),
    ):
        if isinstance(thing, kind) or thing is kind:
            return kind.__name__, replacements
    return "", {}


def _instead(name: str, replacement: str) -> str:
    return f"Pymunk {pymunk.version.partition('.')[0]} has no {name}, which older versions had. Instead: {replacement}."


def _by_message(error: BaseException) -> str:
    for kind, pattern, cure in _BY_MESSAGE:
        if isinstance(error, kind) and re.search(pattern, str(error)):
            return cure
    return ""


def _display(error: BaseException) -> str:
    kind = type(error)
    without_video = kind.__module__.startswith("pygame") and "video" in str(error)
    if without_video or kind.__name__ in ("NoSuchDisplayException", "NoSuchConfigException"):
        return "There is no display: sandbox watch --headless runs the program without a window."
    return ""
