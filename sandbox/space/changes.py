"""What Pymunk dropped or changed since version 5 and before, and what replaces it."""

from collections.abc import Mapping
from typing import Final, NamedTuple

_COLLISION: Final = (
    "`space.on_collision(type_a, type_b, begin=..., pre_solve=..., post_solve=..., separate=...)`; instead of "
    "returning False, a callback sets `arbiter.process_collision = False`; handler.data is the argument `data=...`"
)
_ANY_COLLISION: Final = "`space.on_collision(None, None, begin=..., ...)`"
_SHAPE_FILTER: Final = "`shape.filter = pymunk.ShapeFilter(group=..., categories=..., mask=...)`"
_DEBUG_DRAW: Final = "`space.debug_draw(pymunk.pygame_util.DrawOptions(screen))`"
_ENDPOINTS: Final = "`segment.unsafe_set_endpoints(a, b)`"
_NOTHING: Final = "nothing: Pymunk does that itself"


class Change(NamedTuple):
    """What is an error since a version of Pymunk, and what to write instead. Before version 5, `since` is 5."""

    since: int
    instead: str
    pattern: str = ""  # of an error: the file that raised it, a colon, a blank and the message

    @property
    def plain(self) -> str:
        """What to write instead, for a terminal."""
        return self.instead.replace("`", "")


NAMES: Final[Mapping[str, Change]] = {
    "Space.add_collision_handler": Change(7, _COLLISION),
    "Space.add_wildcard_collision_handler": Change(7, "`space.on_collision(type_a, None, begin=..., ...)`"),
    "Space.add_default_collision_handler": Change(7, _ANY_COLLISION),
    "pymunk.CollisionHandler": Change(7, _COLLISION),
    "pymunk.collision_handler": Change(7, _COLLISION),
    "Vec2d.rotate": Change(6, "`v = v.rotated(angle)`"),
    "Vec2d.rotate_degrees": Change(6, "`v = v.rotated_degrees(degrees)`"),
    "Vec2d.get_length": Change(6, "`v.length`"),
    "Vec2d.get_angle": Change(6, "`v.angle`"),
    "Vec2d.get_angle_degrees": Change(6, "`v.angle_degrees`"),
    "Vec2d.normalize_return_length": Change(6, "`v, length = v.normalized_and_length()`"),
    "pymunk.inf": Change(
        6, "`float('inf')` for a moment; for a body that never moves, `pymunk.Body(body_type=pymunk.Body.STATIC)`"
    ),
    "pymunk.constraint": Change(6, "`pymunk.constraints`"),
    "pymunk.chipmunk_path": Change(6, "nothing"),
    "pymunkoptions": Change(6, "nothing: leave the import out"),
    "Space.set_default_collision_handler": Change(5, _ANY_COLLISION),
    "Space.remove_collision_handler": Change(
        5, "`space.on_collision(type_a, type_b, begin=pymunk.empty_callback, ...)`, for each callback that was set"
    ),
    "Space.add_static": Change(5, "`space.add(...)`, with shapes on `space.static_body`"),
    "Space.remove_static": Change(5, "`space.remove(...)`"),
    "Space.elastic_iterations": Change(5, "`space.iterations`"),
    "Space.enable_contact_graph": Change(5, "nothing: `body.each_arbiter(...)` needs no setting"),
    "Space.resize_static_hash": Change(5, _NOTHING),
    "Space.resize_active_hash": Change(5, _NOTHING),
    "Space.nearest_point_query": Change(5, "`space.point_query(point, max_distance, shape_filter)`"),
    "Space.nearest_point_query_nearest": Change(5, "`space.point_query_nearest(point, max_distance, shape_filter)`"),
    "Space.point_query_first": Change(5, "`space.point_query_nearest(point, 0, shape_filter)`"),
    "Body.apply_force": Change(5, "`body.apply_force_at_world_point(force, body.position + offset)`, in each step"),
    "Body.apply_impulse": Change(5, "`body.apply_impulse_at_world_point(impulse, body.position + offset)`"),
    "Body.reset_forces": Change(5, "nothing: forces last for one step"),
    "Body.velocity_limit": Change(5, "a `velocity_func` that scales `body.velocity`"),
    "Body.angular_velocity_limit": Change(5, "a `velocity_func` that limits `body.angular_velocity`"),
    "Body.is_static": Change(5, "`body.body_type == pymunk.Body.STATIC`"),
    "Body.is_rogue": Change(5, "`body.space is None`"),
    "Shape.layers": Change(5, _SHAPE_FILTER),
    "Shape.group": Change(5, _SHAPE_FILTER),
    "Poly.get_points": Change(5, "`poly.get_vertices()`"),
    "Segment.unsafe_set_a": Change(5, _ENDPOINTS),
    "Segment.unsafe_set_b": Change(5, _ENDPOINTS),
    "SegmentQueryInfo.get_hit_point": Change(5, "`info.point`"),
    "SegmentQueryInfo.get_hit_distance": Change(5, "`info.alpha`, the fraction of the segment, times its length"),
    "SegmentQueryInfo.t": Change(5, "`info.alpha`"),
    "SegmentQueryInfo.n": Change(5, "`info.normal`"),
    "Constraint.anchr1": Change(5, "`joint.anchor_a`"),
    "Constraint.anchr2": Change(5, "`joint.anchor_b`"),
    "Arbiter.contacts": Change(5, "`arbiter.contact_point_set.points`"),
    "Arbiter.elasticity": Change(5, "`arbiter.restitution`"),
    "Arbiter.total_impulse_with_friction": Change(5, "`arbiter.total_impulse`, which includes friction"),
    "pymunk.init_pymunk": Change(5, _NOTHING),
    "pymunk.reset_shapeid_counter": Change(5, "nothing"),
    "pymunk.pygame_util.draw": Change(5, _DEBUG_DRAW),
    "pymunk.pygame_util.draw_space": Change(5, _DEBUG_DRAW),
    "pymunk.pygame_util.flip_y": Change(5, "`pymunk.pygame_util.positive_y_is_up`"),
    "pymunk.pyglet_util.draw": Change(5, "`space.debug_draw(pymunk.pyglet_util.DrawOptions())`"),
}
CALLS: Final[Mapping[str, Change]] = {
    "space.shapes[0], space.bodies.append(body)": Change(
        7,
        "`list(space.shapes)[0]`, `space.add(body)`; shapes, bodies and constraints are views",
        "'(dict_keys|KeysView|WeakKeysView)'",
    ),
    "for shape in space.shapes: space.remove(shape)": Change(
        7, "`for shape in list(space.shapes): ...`", "(dictionary|Set) changed size during iteration"
    ),
    "pymunk.PinJoint(static, static)": Change(
        7, "a joint of which at least one body is dynamic", "^pymunk/constraints.py: At least one of the two bodies"
    ),
    "pymunk.Body(), dynamic and without mass or moment": Change(
        7,
        "`pymunk.Body(mass, moment)`, or `shape.mass = ...` or `shape.density = ...` on one of its shapes",
        r"^pymunk/\w+.py: Dynamic bodies must have",
    ),
    "Vec2d(pair)": Change(6, "`Vec2d(*pair)`", "Vec2d.* missing 1 required positional argument: 'y'"),
    "Vec2d()": Change(6, "`Vec2d.zero()`", "Vec2d.* missing 2 required positional arguments"),
    "vector.x = 1, vector[0] = 1, box.left = 1": Change(
        6,
        "a new one, as in `body.velocity = (1, body.velocity.y)`; a Vec2d or BB cannot be changed",
        "can't set attribute|'(Vec2d|BB)' object (has no setter|does not support item assignment)",
    ),
    "vector * vector, vector + 1, vector ** 2, ~vector": Change(
        6,
        "`Vec2d(v.x * w.x, v.y * w.y)` and so on; a vector is added to a vector, and multiplied by a number",
        r"^pymunk/vec2d.py: (object of type '\w+' has no len\(\))?$|(operand type\(s\) for|unary) .*'Vec2d'",
    ),
    "body.position = numpy_array": Change(
        6, "`body.position = tuple(numpy_array)`", "'struct cpVect' must be a list or tuple"
    ),
    "space.add([body, shape])": Change(
        6, "`space.add(body, shape)`, or `space.add(*objects)`", "^pymunk/space.py: Unsupported type"
    ),
    "space.add(shape), before its body": Change(
        6, "`space.add(body, shape)`", "^pymunk/space.py: The shape's body must be added to the space before"
    ),
    "pymunk.ShapeFilter.ALL_MASKS ^ 1": Change(
        6, "`pymunk.ShapeFilter.ALL_MASKS() ^ 1`; also `ALL_CATEGORIES()`", r"for [&|^]: 'function' and 'int'"
    ),
    "march_soft(..., segment_func, sample_func)": Change(
        6, "`polylines = march_soft(..., sample_func)`; also `march_hard`", r"march_(soft|hard)\(\) takes 5 positional"
    ),
    "body.apply_impulse_at_world_point(impulse)": Change(
        6, "`body.apply_impulse_at_world_point(impulse, point)`", r"apply_impulse_at_world_point\(\) missing"
    ),
    "space.point_query(point)": Change(
        5,
        "`space.point_query(point, max_distance, pymunk.ShapeFilter())`; also `point_query_nearest`",
        r"\.point_query(_nearest)?\(\) missing",
    ),
    "space.segment_query(start, end)": Change(
        5,
        "`space.segment_query(start, end, radius, pymunk.ShapeFilter())`; also `segment_query_first`",
        r"\.segment_query(_first)?\(\) missing",
    ),
    "pymunk.Poly(body, vertices, offset=(x, y))": Change(
        5, "`pymunk.Poly(body, vertices, pymunk.Transform.translation(x, y))`", "Poly.* keyword argument 'offset'"
    ),
    "pymunk.moment_for_box(mass, width, height)": Change(
        5, "`pymunk.moment_for_box(mass, (width, height))`", r"moment_for_box\(\) takes 2 positional"
    ),
}
