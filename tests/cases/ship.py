"""A ship that is hit swings about the corner of its picture: its polygons are given from there."""

import sys

import pymunk

MENDED = "mended" in sys.argv
PARTS = [[(0, 10), (40, 0), (40, 20)], [(40, 0), (80, 0), (80, 20), (40, 20)]]
x, y = (50, 10) if MENDED else (0, 0)
parts = [[(right - x, down - y) for right, down in corners] for corners in PARTS]
space = pymunk.Space()
ship = pymunk.Body(1, sum(pymunk.moment_for_poly(0.5, corners) for corners in parts))
ship.position = 300, 300
rock = pymunk.Body()
rock.position, rock.velocity = (320, 100), (0, 120)
stone = pymunk.Circle(rock, 20)
stone.mass = 2
space.add(ship, *(pymunk.Poly(ship, corners, radius=1) for corners in parts), rock, stone)
for _ in range(120):
    space.step(1 / 60)
