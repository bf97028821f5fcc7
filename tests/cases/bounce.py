"""A ball with elasticity 0.9 does not bounce: the floor's elasticity is 0."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 900
floor = pymunk.Segment(space.static_body, (0, 300), (400, 300), 5)
ball = pymunk.Body()
ball.position = 200, 100
disc = pymunk.Circle(ball, 20)
disc.mass, disc.elasticity = 1, 0.9
if MENDED:
    floor.elasticity = 0.9
space.add(floor, ball, disc)
for _ in range(120):
    space.step(1 / 60)
