"""Pymunk's own numbers come through unchanged."""

from typing import Any

import numpy as np
import pymunk
import pytest
from conftest import do_steps, scene_of
from recorded import recorded

from sandbox.engines.pymunk import WALL_HALF_THICKNESS, PymunkEngine, _chains
from sandbox.scene.files import load
from sandbox.scene.model import Scene, Wall
from sandbox.scene.spawn import spawn
from sandbox.state import Floats, States


def plain_pymunk(scene: Scene, steps: int) -> tuple[Floats, list[tuple[int, int, float]]]:
    """Run a scene in a plain Pymunk loop: positions at each step, and (first, second, impulse) per contact.

    Unlike `plain_space` of the benchmarks, it has a body per wall, inner walls and a callback that reports contacts.
    """
    space = pymunk.Space()
    space.gravity = scene.gravity
    initial = spawn(scene)
    bodies = []
    for k, (position, velocity) in enumerate(zip(initial.position.tolist(), initial.velocity.tolist(), strict=True)):
        radius, mass = scene.bodies.radius[k], scene.bodies.mass[k]
        body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, radius))
        body.position, body.velocity = position, velocity
        circle = pymunk.Circle(body, radius)
        circle.elasticity, circle.friction = scene.bodies.elasticity[k], scene.bodies.friction[k]
        space.add(body, circle)
        bodies.append(body)
    (w, h), t = scene.arena.size, WALL_HALF_THICKNESS
    corners = (-t, -t), (w + t, -t), (-t, h + t), (w + t, h + t)
    box = [(0, 2), (0, 1), (1, 3), (2, 3)]  # left, top, right, bottom
    walls = [(corners[a], corners[b], t, scene.arena.elasticity) for a, b in box]
    walls += [(wall.start, wall.to, wall.thickness / 2, wall.elasticity) for wall in scene.walls]
    for a, b, radius, elasticity in walls:
        static = pymunk.Body(body_type=pymunk.Body.STATIC)
        segment = pymunk.Segment(static, a, b, radius)
        segment.elasticity = elasticity
        space.add(static, segment)
        bodies.append(static)
    number = {body: k if k < len(initial.position) else len(initial.position) - 1 - k for k, body in enumerate(bodies)}
    solved: list[tuple[int, int, float]] = []
    kept: dict[tuple[int, int], tuple[float, int]] = {}  # the impulse of each pair, and the call that applied it
    calls = 0

    def post_solve(arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        a, b = (number[body] for body in arbiter.bodies)
        pair = (a, b) if b < 0 or 0 <= a < b else (b, a)
        total = abs(arbiter.total_impulse.dot(arbiter.normal))
        earlier, call = kept.get(pair, (0.0, -1000))
        again = arbiter.is_first_contact and calls - call <= space.collision_persistence
        impulse = total - earlier if again else total  # an earlier touch's rest is included, but not applied
        kept[pair] = total, calls
        if impulse:
            solved.append((*pair, impulse))

    space.on_collision(post_solve=post_solve)
    positions = [initial.position]
    found = []
    for _ in range(steps):
        for _ in range(scene.pymunk.substeps):
            calls += 1
            space.step(1 / scene.rate / scene.pymunk.substeps)
            found += sorted(solved)
            solved.clear()
        positions.append(np.array([body.position for body in bodies[: len(initial.position)]]))
    return np.array(positions), found


@pytest.mark.parametrize("substeps", [1, 4])
@pytest.mark.parametrize("name", ["gas-100", "funnel"])
def test_positions_and_contacts_equal_a_plain_loop_s(name: str, substeps: int) -> None:
    scene = load(name)
    scene = scene.model_copy(update={"pymunk": scene.pymunk.model_copy(update={"substeps": substeps})})
    engine = PymunkEngine(scene, spawn(scene))
    engine.record_contacts()
    steps = 180
    positions, contacts = plain_pymunk(scene, steps)
    for step in range(1, steps + 1):
        engine.step()
        assert np.array_equal(engine.state().position, positions[step])
    found = engine.contacts()
    assert list(zip(found["first"], found["second"], strict=True)) == [contact[:2] for contact in contacts]
    assert found["impulse"] == pytest.approx([contact[2] for contact in contacts], rel=1e-12)
    assert len(found) > 200
    assert np.hypot(*found["normal"].T) == pytest.approx(np.ones(len(found)))


@pytest.mark.parametrize("walls_first", [0, 1])
def test_bodies_begin_with_the_motion_of_their_balls_and_after_it_lie_their_circles(walls_first: int) -> None:
    scene = scene_of("radius = 5\ngrid = [4, 3]\nspacing = 20\nspeed = 90\nspin = { from = -9, to = 9 }")
    scene = scene.changed(pymunk={"walls_first": walls_first}, walls=[Wall(start=(10, 20), to=(90, 20))])
    initial = spawn(scene)
    initial.angle[:] = np.linspace(-4, 4, 12)
    engine = PymunkEngine(scene, initial)
    state, space = engine.state(), engine.space
    for name in States._fields:
        assert np.array_equal(getattr(state, name), getattr(initial, name))
    for ball, position in enumerate(initial.position.tolist()):
        nearest = space.point_query_nearest(tuple(position), 0, pymunk.ShapeFilter())
        assert nearest is not None
        assert nearest.shape is not None
        assert nearest.shape.body is engine._bodies[ball]
    is_circle = [isinstance(shape, pymunk.Circle) for shape in space.shapes]
    assert is_circle == ([False] * 5 + [True] * 12 if walls_first else [True] * 12 + [False] * 5)


def test_a_contact_has_the_normal_the_impulse_and_the_depth() -> None:
    scene = scene_of(
        "radius = 20\nposition = [140.5, 300]",
        "radius = 20\nmass = 3\nposition = [100, 300]\nvelocity = [60, 0]",  # touches in the first step, 0.5 px deep
        "radius = 20\nposition = [400, 579]\nvelocity = [0, 120]",  # the bottom wall, 1 px deep
    )
    _, (pair, wall) = recorded("pymunk", scene, 1)
    assert (pair["first"], pair["second"], ~wall["second"]) == (0, 1, 3)
    assert pair["normal"].tolist() == [-1, 0]
    assert pair["impulse"] == pytest.approx(2 * 60 * (3 * 1) / (3 + 1))  # 2 v m1 m2 / (m1 + m2)
    assert pair["depth"] == pytest.approx(0.5)
    assert wall["normal"].tolist() == pytest.approx([0, 1])
    assert wall["impulse"] == pytest.approx(2 * 120)
    assert wall["depth"] == pytest.approx(1)
    assert pair["time"] == wall["time"] == 1 / 60


def test_a_resting_contact_that_ended_is_no_longer_listed() -> None:
    """Pymunk keeps the impulse of a contact for some steps after it: a ball at rest on the floor is thrown up."""
    scene = scene_of("radius = 20\nposition = [400, 580]\nelasticity = 0", more="gravity = [0, 900]")
    engine, found = recorded("pymunk", scene, 10)
    assert len(found) > 5
    engine.kick(0, (0.0, -600.0))
    engine.step()
    engine.step()
    assert len(engine.contacts()) == 0


def test_every_setting_reaches_the_space_and_pymunk_s_defaults_stay() -> None:
    settings = {"iterations": 33, "collision_slop": 0.25, "collision_bias": 0.5, "collision_persistence": 7}
    text = "pymunk = { " + ", ".join(f"{key} = {value}" for key, value in settings.items()) + " }"
    ball = "radius = 20\nposition = [100, 100]"
    given, default = (PymunkEngine(scene, spawn(scene)).space for scene in (scene_of(ball, more=text), scene_of(ball)))
    for key, value in settings.items():
        assert getattr(given, key) == value
        assert getattr(default, key) == getattr(pymunk.Space(), key)


def test_nothing_escapes_the_arena_at_a_million_px_a_second() -> None:
    scene = scene_of("radius = 20\nposition = [400, 300]\nvelocity = [1e6, 7e5]")
    engine = PymunkEngine(scene, spawn(scene))
    do_steps(engine, 600)
    for _ in range(600):  # found far outside and pushed back, it is still on the inner side of the walls
        engine.step()
        assert (np.abs(engine.state().position) < WALL_HALF_THICKNESS).all()


@pytest.mark.parametrize(("joined", "turned"), [(False, True), (True, False)])
def test_a_ball_that_rolls_over_a_joint_hits_no_crack(joined: bool, turned: bool) -> None:
    """It sinks into the floor, and so touches the end of the next wall before it lies on it."""
    walls = [{"from": (x, 200), "to": (x + 100, 200), "thickness": 0, "joined": joined} for x in (0, 100)]
    ball = {"radius": 10, "position": (80, 190.5), "velocity": (60, 0), "elasticity": 0}
    scene = Scene(arena={"size": (400, 300), "overlap": 1}, balls=[ball], walls=walls, gravity=(0, 900))
    normals = recorded("pymunk", scene, 30)[1]["normal"]
    assert (np.abs(normals[:, 0]).max() > 1e-3) == turned


def test_a_chain_of_joined_walls_ends_where_the_next_begins_elsewhere_or_where_it_closes() -> None:
    corners = [(100, 100), (200, 100), (150, 200)]
    triangle: list[dict[str, object]] = [{"from": corners[k - 1], "to": corners[k], "joined": True} for k in range(3)]
    after: list[dict[str, object]] = [
        {"from": (200, 100), "to": (300, 100), "joined": True},
        {"from": (10, 10), "to": (20, 20)},
    ]
    scene = Scene(arena={"size": (400, 300)}, balls=[{"radius": 5, "position": (50, 250)}], walls=[*triangle, *after])
    assert [chain for chain in _chains(scene.walls) if chain] == [[0, 1, 2], [3]]


def test_balls_that_fall_asleep_one_after_another_are_read_as_themselves() -> None:
    scene = scene_of(
        "radius = 14\nelasticity = 0\npositions = [[60, 80], [160, 200], [260, 286]]",
        size="[400, 300]",
        more="gravity = [0, 900]\n[pymunk]\nsleep_time_threshold = 0.3",
    )
    engine, asleep = PymunkEngine(scene, spawn(scene)), set()
    bodies = [next(body for body in engine.space.bodies if body.position.x == x) for x in (60, 160, 260)]
    for step in range(4 * scene.rate):
        if step == 3 * scene.rate:
            engine.kick(1, (0, -300))
        engine.step()
        asleep.add(tuple(body.is_sleeping for body in bodies))
        state = engine.state()
        assert state.position.tolist() == [[*body.position] for body in bodies]
        assert not state.velocity[[body.is_sleeping for body in bodies]].any()
    assert {(False, False, True), (True, True, True), (True, False, True)} <= asleep
