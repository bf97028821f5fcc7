"""A pendulum without friction slows down: each step its joint takes a little."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 981
bob = pymunk.Body()
bob.position = 380, 100
disc = pymunk.Circle(bob, 10)
disc.mass, disc.elasticity = 1, 1
space.add(bob, disc, pymunk.PinJoint(space.static_body, bob, (300, 100)))
for _ in range(400):
    for _ in range(5 if MENDED else 1):
        space.step(1 / 300 if MENDED else 1 / 60)
