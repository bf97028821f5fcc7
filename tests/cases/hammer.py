"""No fault: the masses of the shapes give a hammer its centre of gravity."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 900
ground = pymunk.Segment(space.static_body, (0, 300), (500, 300), 10)
ground.friction = 1
hammer = pymunk.Body()
hammer.position = 200, 200
handle, head = pymunk.Segment(hammer, (0, 0), (80, 0), 8), pymunk.Segment(hammer, (80, -20), (80, 20), 8)
handle.mass, head.mass = 1, 5
handle.friction = head.friction = 0.8
space.add(ground, hammer, handle, head)
for _ in range(120):
    space.step(1 / 60)
