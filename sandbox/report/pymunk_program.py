"""A scene, and the state of its balls, as a program for Pymunk."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from sandbox.engines.pymunk import WALL_HALF_THICKNESS, wall_neighbours
from sandbox.scene.model import ARENA_WALLS, SPACE_SETTINGS, Scene
from sandbox.scene.walls import walls_of
from sandbox.state import MEETS_ALL, State

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
filters = {filters}  # number of a ball -> group, categories and mask of its filter
walls = [  # ends, half of the thickness, elasticity, friction; of a peg, both ends are one point
{walls}
]


def add_balls():
    for number, (radius, mass, elasticity, friction, position, velocity, angle, spin, colour) in enumerate(balls):
        body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, radius))
        body.position, body.velocity, body.angle, body.angular_velocity = position, velocity, angle, spin
        circle = pymunk.Circle(body, radius)
        circle.elasticity, circle.friction, circle.color = elasticity, friction, pygame.Color(colour)
        circle.filter = pymunk.ShapeFilter(*filters.get(number, ()))
        space.add(body, circle)


def add_walls():
    for a, b, radius, elasticity, friction, neighbours in walls:
        body = pymunk.Body(body_type=pymunk.Body.STATIC)
        wall = pymunk.Circle(body, radius, a) if a == b else pymunk.Segment(body, a, b, radius)
        wall.elasticity, wall.friction = elasticity, friction
        if neighbours:
            wall.set_neighbors(*neighbours)
        space.add(body, wall)


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
    filters = {n: tuple(one) for n, one in enumerate(scene.bodies.filters.tolist()) if tuple(one) != MEETS_ALL}
    order = ["add_walls()", "add_balls()"] if scene.pymunk.walls_first else ["add_balls()", "add_walls()"]
    return PROGRAM.format(
        title=(scene.title or scene.name).replace('"', "'").replace("\\", "/"),
        settings="\n".join([f"space.gravity = {_pair(scene.gravity)}", *settings]),
        balls="\n".join(f"    ({line})," for line in _balls(scene, state)),
        filters=filters,
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
    walls = list(zip(*(part.tolist() for part in walls_of(scene, WALL_HALF_THICKNESS)), strict=True))
    neighbours = wall_neighbours(scene.walls)
    for number in scene.wall_numbers:
        a, b, *numbers = walls[number]
        constants = ", ".join(map(repr, numbers))
        yield f"{_pair(a)}, {_pair(b)}, {constants}, {neighbours.get(number - len(ARENA_WALLS))!r}"


def _pair(values: object) -> str:
    x, y = np.asarray(values, float).tolist()
    return f"({x!r}, {y!r})"
