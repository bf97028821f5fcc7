"""A ball bounces off where a ramp was: its body was turned after it had been added."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 900
ramp = pymunk.Body(body_type=pymunk.Body.STATIC)
ramp.position = 200, 300
board = pymunk.Segment(ramp, (-150, 0), (150, 0), 5)
ball = pymunk.Body()
ball.position = 200, 200
disc = pymunk.Circle(ball, 15)
disc.mass = 1
board.friction = disc.friction = 0.5
if MENDED:
    ramp.angle = 0.4
space.add(ramp, board, ball, disc)
for k in range(90):
    if k == 10:
        ramp.angle = 0.4
    space.step(1 / 60)
