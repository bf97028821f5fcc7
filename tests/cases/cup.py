"""A marble lies on top of a cup: a polygon with a dent collides as its hull."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 900
left, floor, right = [(-50, -40), (-40, 40)], [(-50, 30), (50, 40)], [(40, -40), (50, 40)]
if MENDED:
    parts = [[(x, y) for x in (a, c) for y in (b, d)] for (a, b), (c, d) in (left, floor, right)]
else:
    parts = [[(-50, -40), (-50, 40), (50, 40), (50, -40), (40, -40), (40, 30), (-40, 30), (-40, -40)]]
cup = pymunk.Body(body_type=pymunk.Body.STATIC)
cup.position = 250, 300
space.add(cup)
for part in parts:
    shape = pymunk.Poly(cup, part)
    shape.friction = 0.5
    space.add(shape)
marble = pymunk.Body()
marble.position = 250, 240
disc = pymunk.Circle(marble, 10)
disc.mass, disc.friction = 1, 0.5
space.add(marble, disc)
for _ in range(180):
    space.step(1 / 60)
