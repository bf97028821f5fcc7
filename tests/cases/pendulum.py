"""A pendulum without friction slows down: each step its joint takes a little."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 981
bob = pymunk.Body()
bob.position = 600, 100
disc = pymunk.Circle(bob, 10)
disc.mass, disc.elasticity = 1, 1
space.add(bob, disc, pymunk.PinJoint(space.static_body, bob, (300, 100)))
for _ in range(600):
    for _ in range(10 if MENDED else 1):
        space.step(1 / 600 if MENDED else 1 / 60)
