"""A box that is clicked spins like mad: the click's place goes to the call for local points."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 900
floor = pymunk.Segment(space.static_body, (0, 300), (600, 300), 10)
body = pymunk.Body()
body.position = 400, 269
box = pymunk.Poly.create_box(body, (40, 40))
box.mass = 1
floor.friction = box.friction = 0.7
space.add(floor, body, box)
for k in range(90):
    if k == 30:
        if MENDED:
            body.apply_impulse_at_world_point((0, -300), (405, 265))
        else:
            body.apply_impulse_at_local_point((0, -300), (405, 265))
    space.step(1 / 60)
