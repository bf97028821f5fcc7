"""A pendulum swings oddly: the anchor on the weight is given in the Space's coordinates."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 900
weight = pymunk.Body()
weight.position = 420, 150
disc = pymunk.Circle(weight, 12)
disc.mass = 2
rod = pymunk.PinJoint(space.static_body, weight, (300, 150), (0, 0) if MENDED else (420, 150))
space.add(weight, disc, rod)
for _ in range(240):
    space.step(1 / 60)
