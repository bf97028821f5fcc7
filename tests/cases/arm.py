"""An arm of three limbs cannot fold: the first and the third collide, which no joint connects."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
last = space.static_body
for k in range(3):
    limb = pymunk.Body()
    limb.position = 140 + 80 * k, 150
    bar = pymunk.Segment(limb, (-40, 0), (40, 0), 8)
    bar.mass, bar.friction = 2, 0.5
    if MENDED:
        bar.filter = pymunk.ShapeFilter(group=1)
    hinge = pymunk.PinJoint(last, limb, (40, 0) if k else (100, 150), (-40, 0))
    motor = pymunk.SimpleMotor(last, limb, 1 if k else 0)
    motor.max_force = 300_000
    hinge.collide_bodies = motor.collide_bodies = False
    space.add(limb, bar, hinge, motor)
    last = limb
for _ in range(300):
    space.step(1 / 60)
