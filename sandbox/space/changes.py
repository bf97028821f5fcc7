"""What Pymunk dropped or changed since version 5 and before, and what replaces it."""

from collections.abc import Mapping
from typing import Final, NamedTuple

_COLLISION: Final = (
    "space.on_collision(type_a, type_b, begin=..., pre_solve=..., post_solve=..., separate=...); instead of "
    "returning False, a callback sets arbiter.process_collision = False; handler.data is the argument data=..."
)
_SHAPE_FILTER: Final = "shape.filter = pymunk.ShapeFilter(group=..., categories=..., mask=...)"


class Change(NamedTuple):
    """What is an error since a version of Pymunk, and what to write instead. Before version 5, since is 5."""

    since: int
    instead: str
    pattern: str = ""  # of an error: the file that raised it, a colon, a blank and the message


NAMES: Final[Mapping[str, Change]] = {
    "Space.add_collision_handler": Change(7, _COLLISION),
    "Space.add_wildcard_collision_handler": Change(7, "space.on_collision(type_a, None, begin=..., ...)"),
    "Space.add_default_collision_handler": Change(7, "space.on_collision(None, None, begin=..., ...)"),
    "Vec2d.rotate": Change(6, "v = v.rotated(angle)"),
    "Vec2d.get_length": Change(6, "v.length"),
    "pymunk.constraint": Change(6, "pymunk.constraints, or pymunk.PinJoint and so on"),
    "pymunk.inf": Change(
        6, "float('inf') for a moment; for a body that never moves, pymunk.Body(body_type=pymunk.Body.STATIC)"
    ),
    "Space.add_static": Change(5, "space.add(...), with shapes on space.static_body"),
    "Body.apply_force": Change(5, "body.apply_force_at_world_point(force, body.position + offset), in each step"),
    "Body.apply_impulse": Change(5, "body.apply_impulse_at_world_point(impulse, body.position + offset)"),
    "Body.velocity_limit": Change(5, "a velocity_func that scales body.velocity"),
    "Body.angular_velocity_limit": Change(5, "a velocity_func that limits body.angular_velocity"),
    "Shape.layers": Change(5, _SHAPE_FILTER),
    "Shape.group": Change(5, _SHAPE_FILTER),
    "pymunk.pygame_util.draw": Change(5, "space.debug_draw(pymunk.pygame_util.DrawOptions(screen))"),
}
CALLS: Final[Mapping[str, Change]] = {
    "space.shapes[0], space.bodies.append(body)": Change(
        7,
        "list(space.shapes)[0], space.add(body); shapes, bodies and constraints are views",
        "'(dict_keys|KeysView|WeakKeysView)'",
    ),
    "for shape in space.shapes: space.remove(shape)": Change(
        7, "for shape in list(space.shapes): ...", "(dictionary|Set) changed size during iteration"
    ),
    "pymunk.Body(), dynamic and without mass or moment": Change(
        7,
        "pymunk.Body(mass, moment), or shape.mass = ... or shape.density = ... on one of its shapes",
        r"^pymunk/\w+.py: Dynamic bodies must have",
    ),
    "Vec2d(pair)": Change(6, "Vec2d(*pair)", "Vec2d.* missing 1 required positional argument: 'y'"),
    "Vec2d()": Change(6, "Vec2d.zero()", "Vec2d.* missing 2 required positional arguments"),
    "vector.x = 1, vector[0] = 1, box.left = 1": Change(
        6,
        "a new one, as in body.velocity = (1, body.velocity.y); a Vec2d or BB cannot be changed",
        "can't set attribute|'(Vec2d|BB)' object (has no setter|does not support item assignment)",
    ),
    "vector * vector, vector + 1, vector ** 2, ~vector": Change(
        6,
        "Vec2d(v.x * w.x, v.y * w.y) and so on; a vector is added to a vector, and multiplied by a number",
        r"^pymunk/vec2d.py: (object of type '\w+' has no len\(\))?$|(operand type\(s\) for|unary) .*'Vec2d'",
    ),
    "space.add([body, shape])": Change(
        6, "space.add(body, shape), or space.add(*objects)", "^pymunk/space.py: Unsupported type"
    ),
    "space.add(shape), before its body": Change(
        6, "space.add(body, shape)", "^pymunk/space.py: The shape's body must be added to the space before"
    ),
    "pymunk.Poly(body, vertices, offset=(x, y))": Change(
        5, "pymunk.Poly(body, vertices, pymunk.Transform.translation(x, y))", "Poly.* keyword argument 'offset'"
    ),
}
