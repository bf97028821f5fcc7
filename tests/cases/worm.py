"""A worm flies apart: its limbs overlap at their joints, which push against that."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 200
last = space.static_body
for k in range(6):
    limb = pymunk.Body()
    limb.position = 120 + 40 * k, 100
    box = pymunk.Poly.create_box(limb, (44, 16))
    box.mass, box.friction = 1, 0.5
    if MENDED:
        box.filter = pymunk.ShapeFilter(group=1)
    space.add(limb, box, pymunk.PivotJoint(last, limb, (100 + 40 * k, 100)))
    last = limb
for _ in range(120):
    space.step(1 / 60)
