"""The chain of a wrecking ball comes apart: light links carry a ball of 500 kg."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 900
last = space.static_body
for k in range(8):
    link = pymunk.Body()
    link.position = 215 + 30 * k, 100
    bar = pymunk.Segment(link, (-15, 0), (15, 0), 3)
    bar.mass, bar.filter = 20 if MENDED else 1, pymunk.ShapeFilter(group=1)
    space.add(link, bar, pymunk.PivotJoint(last, link, (200 + 30 * k, 100)))
    last = link
ball = pymunk.Body()
ball.position = 460, 100
disc = pymunk.Circle(ball, 20)
disc.mass, disc.filter = 20 if MENDED else 500, pymunk.ShapeFilter(group=1)
space.add(ball, disc, pymunk.PivotJoint(last, ball, (440, 100)))
if MENDED:
    space.iterations = 60
for _ in range(180):
    for _ in range(4 if MENDED else 1):
        space.step(1 / 240 if MENDED else 1 / 60)
