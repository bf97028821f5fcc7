"""A scene as a short program for Pymunk, which moves its balls to the same bits as the engine `pymunk`."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from sandbox.engines.pymunk import WALL_HALF_THICKNESS, _chains
from sandbox.scene.fields import Vector
from sandbox.scene.model import ARENA_WALLS, SPACE_SETTINGS, Scene
from sandbox.state import State

PROGRAM: Final = '''\
"""{title}, as a program for Pymunk."""

import pygame
import pymunk
from pymunk.pygame_util import DrawOptions

space = pymunk.Space()
{settings}
balls = [  # radius, mass, elasticity, friction, position, velocity, angle, spin, colour
{balls}
]
walls = [  # ends, half of the thickness, elasticity, friction
{walls}
]


def add_balls():
    for radius, mass, elasticity, friction, position, velocity, angle, spin, colour in balls:
        body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, radius))
        body.position, body.velocity, body.angle, body.angular_velocity = position, velocity, angle, spin
        circle = pymunk.Circle(body, radius)
        circle.elasticity, circle.friction, circle.color = elasticity, friction, pygame.Color(colour)
        space.add(body, circle)


def add_walls():
    for a, b, radius, elasticity, friction, neighbours in walls:
        segment = pymunk.Segment(pymunk.Body(body_type=pymunk.Body.STATIC), a, b, radius)
        segment.elasticity, segment.friction = elasticity, friction
        if neighbours:
            segment.set_neighbors(*neighbours)
        space.add(segment.body, segment)


def step():
    for _ in range({substeps}):
        space.step({dt!r})


{order}
if __name__ == "__main__":
    screen, clock = pygame.display.set_mode({size}), pygame.time.Clock()
    while not any(event.type == pygame.QUIT for event in pygame.event.get()):
        step()
        screen.fill({background!r})
        space.debug_draw(DrawOptions(screen))
        pygame.display.flip()
        clock.tick({rate})
'''


def pymunk_code(scene: Scene, state: State) -> str:
    """Return a program that runs a scene from a state in Pymunk."""
    values = {key: getattr(scene.pymunk, key) for key in SPACE_SETTINGS}
    settings = [f"space.{key} = {value!r}" for key, value in values.items() if value is not None]
    order = ["add_walls()", "add_balls()"] if scene.pymunk.walls_first else ["add_balls()", "add_walls()"]
    return PROGRAM.format(
        title=(scene.title or scene.name).replace('"', "'").replace("\\", "/"),
        settings="\n".join([f"space.gravity = {_pair(scene.gravity)}", *settings]),
        balls="\n".join(f"    ({line})," for line in _balls(scene, state)),
        walls="\n".join(f"    ({line})," for line in _walls(scene)),
        substeps=scene.pymunk.substeps,
        dt=1 / scene.rate / scene.pymunk.substeps,
        order="\n".join(order),
        size=tuple(round(side) for side in scene.arena.size),
        background=scene.arena.background,
        rate=scene.rate,
    )


def _balls(scene: Scene, state: State) -> Iterator[str]:
    bodies = scene.bodies
    for ball, colour in enumerate(scene.colors):
        constants = (bodies.radius, bodies.mass, bodies.elasticity, bodies.friction)
        numbers = ", ".join(repr(float(each[ball])) for each in constants)
        places = f"{_pair(state.position[ball])}, {_pair(state.velocity[ball])}"
        yield f"{numbers}, {places}, {float(state.angle[ball])!r}, {float(state.spin[ball])!r}, {colour!r}"


def _walls(scene: Scene) -> Iterator[str]:
    (width, height), far, arena = scene.arena.size, WALL_HALF_THICKNESS, scene.arena
    ends = (
        ((-far, -far), (-far, height + far)),
        ((-far, -far), (width + far, -far)),
        ((width + far, -far), (width + far, height + far)),
        ((-far, height + far), (width + far, height + far)),
    )
    neighbours = _neighbours(scene)
    for number in scene.wall_numbers:
        own = number - len(ARENA_WALLS)
        if own < 0:
            a, b = ends[number]
            yield f"{_pair(a)}, {_pair(b)}, {far!r}, {arena.elasticity!r}, {arena.friction!r}, None"
        else:
            wall = scene.walls[own]
            beside = neighbours.get(own)
            joined = f"({_pair(beside[0])}, {_pair(beside[1])})" if beside else "None"
            numbers = f"{float(wall.thickness / 2)!r}, {wall.elasticity!r}, {wall.friction!r}"
            yield f"{_pair(wall.start)}, {_pair(wall.to)}, {numbers}, {joined}"


def _pair(values: object) -> str:
    x, y = np.asarray(values, float).tolist()
    return f"({x!r}, {y!r})"


def _neighbours(scene: Scene) -> dict[int, tuple[Vector, Vector]]:
    """Return the ends of the walls before and after each wall of a chain of joined walls, by its number."""
    found = {}
    for chain in _chains(scene.walls):
        walls = [scene.walls[number] for number in chain]
        is_closed = bool(walls) and walls[-1].to == walls[0].start
        for k, (number, wall) in enumerate(zip(chain, walls, strict=True)):
            before = walls[k - 1].start if k or is_closed else wall.start
            after = walls[(k + 1) % len(walls)].to if k + 1 < len(walls) or is_closed else wall.to
            found[number] = before, after
    return found
