"""A paddle that follows the mouse swallows the ball: its position is set, and its velocity stays 0."""

import math
import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
corners = [(0, 0), (500, 0), (500, 300), (0, 300)]
for k in range(4):
    wall = pymunk.Segment(space.static_body, corners[k - 1], corners[k], 5)
    wall.elasticity = wall.friction = 1
    space.add(wall)
paddle = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
paddle.position = 40, 150
bat = pymunk.Poly.create_box(paddle, (40, 80))
ball = pymunk.Body()
ball.position, ball.velocity = (250, 155), (-200, 0)
disc = pymunk.Circle(ball, 12)
disc.mass = 1
bat.elasticity = disc.elasticity = 1
bat.friction = disc.friction = 0.4
space.add(paddle, bat, ball, disc)
for k in range(240):
    x = 120 - 80 * math.cos(k / 15)
    if MENDED:
        paddle.velocity = (x - paddle.position.x) * 60, 0
    else:
        paddle.position = x, 150
    space.step(1 / 60)
