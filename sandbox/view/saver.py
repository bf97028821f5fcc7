"""Saving what the window shows: as a scene, a picture, the inputs of the run, or a program for Pymunk."""

import os
import shlex
import warnings
from collections.abc import Iterator
from contextlib import suppress
from itertools import count
from typing import Final

import numpy as np
import pygame
from pygame import Surface

from sandbox.engines.pymunk import WALL_HALF_THICKNESS, _chains
from sandbox.files import whole_file
from sandbox.run.inputs import Input, write_run
from sandbox.scene.fields import Vector
from sandbox.scene.files import TRUTHS, bundled, write
from sandbox.scene.model import ARENA_WALLS, SPACE_SETTINGS, Scene
from sandbox.state import MEETS_ALL, State
from sandbox.view.notice import Kind, Notice
from sandbox.view.offscreen import save_picture
from sandbox.view.playback import Playback

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
TEXT_TYPES: Final = (pygame.SCRAP_TEXT, "text/plain;charset=utf-8")  # SDL's clipboard accepts only the second


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


class Saver:
    """Writes files into the folder that the window was opened from."""

    def __init__(self, playback: Playback, notice: Notice) -> None:
        self._playback = playback
        self._notice = notice
        self.saved: list[Input] = []  # the inputs of the run when it was last saved

    def file_name(self, ending: str) -> str:
        """Return a file's name made of the scene, its seed and the step shown."""
        view = self._playback.view
        return f"{view.session.start.name}-{view.session.start.seed}-{view.moment.step:06}{ending}"

    def save_scene(self, pane: int) -> None:
        """Save the balls as they are in a pane as a scene, under a name that is free."""
        self._playback.settle()
        view = self._playback.view
        name = self.free_name(".toml")
        with self._notice.reporting():
            write(view.moment.scene, name, view.panes[pane].state)
            self.saved = list(view.session.inputs)
            self._notice.show_saved(name, f": the balls as in {view.panes[pane].name}")

    def save_inputs(self) -> None:
        """Save what was done up to the step shown, and copy the command that shows the same to the clipboard."""
        session = self._playback.session
        name = self.free_name(".jsonl")
        with self._notice.reporting():
            write_run(session.start, session.given(), session.step, name)
            self.saved = list(session.inputs)
            engines = shlex.quote(",".join(session.names))
            command = f"sandbox run {_argument(session.start)} --engines {engines} --inputs {shlex.quote(name)}"
            copied = "; copied" if _copy(command) else ""
            self._notice.show_saved(name, f"{copied}: {command}")

    def copy_code(self, pane: int) -> None:
        """Copy the balls as they are in a pane to the clipboard, as a program for Pymunk; or save it without one."""
        self._playback.settle()
        view = self._playback.view
        code = pymunk_code(view.moment.scene, view.panes[pane].state)
        if _copy(code):
            self._notice.show("copied: the balls as they are as a program for Pymunk", Kind.DONE)
            return
        name = self.free_name(".py")
        with self._notice.reporting(), whole_file(name) as file:
            file.write(code.encode())
            self._notice.show_saved(name)

    def free_name(self, ending: str) -> str:
        """Return the name of a file that does not exist, as in `file_name`, with a number if need be."""
        names = (self.file_name(ending if k == 1 else f"-{k}{ending}") for k in count(1))
        return next(name for name in names if not os.path.exists(name))  # noqa: PTH110  (Path's raises if it is too long)

    def save_picture(self, screen: Surface) -> None:
        """Save the window as a picture, under a name that is free."""
        name = self.free_name(".png")
        with self._notice.reporting():
            save_picture(screen, name)
            self._notice.show_saved(name)


def _argument(scene: Scene) -> str:
    """Return how a command names a scene."""
    examples = {file: name for folder in ("", TRUTHS) for name, file in bundled(folder).items()}
    return shlex.quote(examples.get(scene.file, str(scene.file)))


def _copy(text: str) -> bool:
    """Copy a text to the clipboard. Return whether there is one."""
    for kind in TEXT_TYPES:
        with suppress(pygame.error), warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # pygame-ce prefers put_text, which accepts no bytes
            pygame.scrap.init()
            pygame.scrap.put(kind, os.fsencode(text))  # the name of a file may be no text
            return True
    return False
