"""A crate falls through a platform: a polygon of two vertices has no inside."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 900
corners = [(0, 200), (300, 200), (300, 220), (0, 220)] if MENDED else [(0, 200), (300, 200)]
platform = pymunk.Poly(space.static_body, corners)
crate = pymunk.Body()
crate.position = 150, 100
box = pymunk.Poly.create_box(crate, (30, 30))
box.mass = 1
platform.friction = box.friction = 0.8
space.add(platform, crate, box)
for _ in range(120):
    space.step(1 / 60)
