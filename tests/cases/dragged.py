"""A box that is dragged fast goes through the wall."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
wall = pymunk.Segment(space.static_body, (300, 0), (300, 300), 2)
mouse = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
mouse.position, mouse.velocity = (100, 150), (3000, 0)
body = pymunk.Body()
body.position = 100, 150
box = pymunk.Poly.create_box(body, (30, 30))
box.mass = 1
wall.friction = box.friction = 0.5
hold = pymunk.PivotJoint(mouse, body, (0, 0), (0, 0))
hold.max_force = 2_000 if MENDED else 500_000
space.add(wall, mouse, body, box, hold)
for k in range(60):
    if k == 8:
        mouse.velocity = 0, 0
    space.step(1 / 60)
