"""A stack trembles: dt is what the clock says, which is never the same."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 900
floor = pymunk.Segment(space.static_body, (0, 300), (400, 300), 10)
floor.friction = 0.8
space.add(floor)
for k in range(5):
    body = pymunk.Body()
    body.position = 200, 275 - 30 * k
    box = pymunk.Poly.create_box(body, (30, 30))
    box.mass, box.friction = 1, 0.8
    space.add(body, box)
for k in range(120):
    space.step(1 / 60 if MENDED else 1 / 60 + 0.002 * (k * k % 7) / 7)
