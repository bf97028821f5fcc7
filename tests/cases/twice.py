"""A ball misses the floor: its ends are in the Space's coordinates, on a body that is placed too."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 900
ground = pymunk.Body(body_type=pymunk.Body.STATIC)
ground.position = 250, 350
a, b = ((-250, 0), (250, 0)) if MENDED else ((0, 350), (500, 350))
floor = pymunk.Segment(ground, a, b, 8)
ball = pymunk.Body()
ball.position = 150, 100
disc = pymunk.Circle(ball, 12)
disc.mass = 1
floor.friction = disc.friction = 0.5
floor.elasticity = disc.elasticity = 0.3
space.add(ground, floor, ball, disc)
for _ in range(150):
    space.step(1 / 60)
