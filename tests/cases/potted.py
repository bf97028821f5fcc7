"""The cue ball bounces off a potted ball: its body was removed, and its shape was not."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()


def ball(x: float) -> tuple[pymunk.Body, pymunk.Circle, pymunk.PivotJoint]:
    body = pymunk.Body()
    body.position = x, 150
    disc = pymunk.Circle(body, 15)
    disc.mass, disc.elasticity = 2, 0.9
    felt = pymunk.PivotJoint(space.static_body, body, (0, 0), (0, 0))
    felt.max_bias, felt.max_force = 0, 200
    space.add(body, disc, felt)
    return body, disc, felt


cue, *_ = ball(100)
potted, disc, felt = ball(260)
for k in range(180):
    if k == 10:
        space.remove(*([potted, disc, felt] if MENDED else [potted]))
    if k == 20:
        cue.velocity = 300, 0
    space.step(1 / 60)
