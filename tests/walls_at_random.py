"""Scenes of one ball among walls at any angle, at random, which may start inside them; and a bound on their events."""

import math
from random import Random

import numpy as np
import pytest

from sandbox.compiled import column
from sandbox.engines.exact import ExactEngine
from sandbox.engines.machine_code import compile_engines
from sandbox.quantity import energy
from sandbox.scene.model import Scene
from sandbox.scene.spawn import spawn
from sandbox.scene.walls import segment_distance
from sandbox.state import State

SIZE = (400.0, 300.0)
STEPS = 120
MAX_CALLS = 50_000  # of the event loop in a step; each ends after 300 events, or where walls hold the ball
MAX_STREAK = 900_000  # contacts, each at once after the last


def scene_at_random(seed: int, *, may_overlap: bool) -> Scene:
    """Return a scene whose ball starts anywhere, or in no wall."""
    random = Random(seed)
    while True:
        scene = _scene(random, overlap=1000 if may_overlap else 0)
        if may_overlap or depth(scene) < 0:
            return scene


def depth(scene: Scene) -> float:
    """Return how deep the ball is given in the walls of the scene, px."""
    (group,) = scene.balls
    at = np.array(group.position)
    return max(
        group.radius + wall.thickness / 2 - float(segment_distance(at, wall.start, wall.to)) for wall in scene.walls
    )


def _scene(random: Random, overlap: float) -> Scene:
    elasticity = random.choice([0.0, random.random(), 0.9, 1.0])
    walls = []
    for _ in range(random.randint(1, 4)):
        x, y, length = random.uniform(0, SIZE[0]), random.uniform(0, SIZE[1]), random.uniform(5, 400)
        angle = random.choice([random.uniform(0, 2 * math.pi), random.randint(0, 7) * math.pi / 4])
        to = x + length * math.cos(angle), y + length * math.sin(angle)
        thickness = random.choice([0, 4, random.uniform(0, 60)])
        friction = random.choice([0, 1])
        walls.append(
            {"start": (x, y), "to": to, "thickness": thickness, "elasticity": elasticity, "friction": friction}
        )
    radius = random.uniform(2, 140)
    ball = {
        "radius": radius,
        "position": tuple(random.uniform(radius, side - radius) for side in SIZE),
        "velocity": random.choice([(0, 0), (random.gauss(0, 200), random.gauss(0, 200))]),
        "friction": random.choice([0, 0.5, random.random()]),
        "spin": random.choice([0, 5]),
    }
    arena = {"size": SIZE, "elasticity": random.choice([1, elasticity]), "overlap": overlap}
    gravity = random.choice([(0, 0), (0, 900), (0, 900), (random.gauss(0, 500), random.gauss(0, 500))])
    return Scene(arena=arena, gravity=gravity, balls=[ball], walls=walls)


def play(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> State:
    """Run a scene of one ball in `exact`, which must end, and may not gain energy by more than hops do."""
    compile_engines(["exact"])  # some scenes have 100,000 events
    calls = [0]

    def bounded(exact: ExactEngine, since: float, now: float) -> None:
        calls[0] += 1
        assert calls[0] < MAX_CALLS
        assert column(exact._world.body, "streak").max() < MAX_STREAK
        process_events(exact, since, now)

    process_events = ExactEngine._process_events
    monkeypatch.setattr(ExactEngine, "_process_events", bounded)
    start = spawn(scene)
    exact = ExactEngine(scene, start)
    for _ in range(STEPS):
        calls[0] = 0
        exact.step()
    state = exact.state()
    gained = energy(state, scene.bodies, scene.gravity, SIZE) - energy(start, scene.bodies, scene.gravity, SIZE)
    pull = math.hypot(*scene.gravity)
    assert gained <= 1e-9 * energy(start, scene.bodies, (0, 0), SIZE) + pull  # 1 px of height
    return state
