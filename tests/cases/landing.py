"""A player sinks into the ground when it lands, and pops out again."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 2000
ground = pymunk.Poly.create_box_bb(space.static_body, pymunk.BB(0, 600, 800, 700))
player = pymunk.Body(1, float("inf"))
player.position = 400, 68
box = pymunk.Poly.create_box(player, (24, 40))
ground.friction = box.friction = 0.5
space.add(ground, player, box)
for _ in range(120):
    for _ in range(4 if MENDED else 1):
        space.step(1 / 240 if MENDED else 1 / 60)
