"""A crate hangs in the air: it slept when its shelf was switched off by a filter, which wakes nobody."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity, space.sleep_time_threshold = (0, 900), 0.25
shelf = pymunk.Segment(space.static_body, (0, 200), (400, 200), 8)
crate = pymunk.Body()
crate.position = 200, 172
box = pymunk.Poly.create_box(crate, (40, 40))
box.mass = 2
shelf.friction = box.friction = 1
space.add(shelf, crate, box)
for k in range(200):
    if k == 100:
        shelf.filter = pymunk.ShapeFilter(mask=0)
        if MENDED:
            crate.activate()
    space.step(1 / 60)
