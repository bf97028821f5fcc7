"""A stack of light boxes is crushed by a block of 400 kg, and thrown about."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 900
floor = pymunk.Segment(space.static_body, (0, 500), (800, 500), 5)
floor.friction = 0.8
space.add(floor)
for k in range(6):
    body = pymunk.Body()
    body.position = 400, 475 - 40.1 * k
    box = pymunk.Poly.create_box(body, (40, 40))
    box.mass = 1 if k < 5 else 2 if MENDED else 400
    box.friction = 0.8
    space.add(body, box)
for _ in range(120):
    space.step(1 / 60)
