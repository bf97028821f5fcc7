"""A player clips into the wall that it runs against: its velocity is set before each step."""

import sys

import pymunk

MENDED = "mended" in sys.argv
RUN = 300, 0
space = pymunk.Space()
wall = pymunk.Poly.create_box_bb(space.static_body, pymunk.BB(300, 0, 400, 400))
player = pymunk.Body(1, float("inf"))
player.position = 200, 200
box = pymunk.Poly.create_box(player, (40, 40))
space.add(wall, player, box)


def run(body: pymunk.Body, _gravity: tuple[float, float], _damping: float, _dt: float) -> None:
    """Set the velocity within the step, where contacts still count."""
    body.velocity = RUN


if MENDED:
    player.velocity_func = run
for _ in range(120):
    if not MENDED:
        player.velocity = RUN
    space.step(1 / 60)
