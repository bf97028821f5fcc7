"""Bullets hit the one who fired them: the categories 1, 2 and 3 share bits."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
PLAYER, ENEMY, BULLET = (1, 2, 4) if MENDED else (1, 2, 3)
for k, (category, mask) in enumerate([(PLAYER, ENEMY), (ENEMY, PLAYER | BULLET), (BULLET, ENEMY)]):
    body = pymunk.Body()
    body.position, body.velocity = (100 + 60 * k, 100), (30 - 30 * k, 0)
    disc = pymunk.Circle(body, 15)
    disc.mass, disc.elasticity, disc.friction = 1, 0.5, 0.5
    disc.filter = pymunk.ShapeFilter(categories=category, mask=mask)
    space.add(body, disc)
for _ in range(60):
    space.step(1 / 60)
