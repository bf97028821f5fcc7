"""Seen from above, a car never stops: friction acts at contacts only."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
car = pymunk.Body()
car.position = 100, 100
box = pymunk.Poly.create_box(car, (40, 20))
kerb = pymunk.Segment(space.static_body, (0, 300), (3000, 300), 5)
box.mass, box.friction, kerb.friction = 1, 0.9, 0.9
space.add(car, box, kerb)
if MENDED:
    tyres = pymunk.PivotJoint(space.static_body, car, (0, 0), (0, 0))
    tyres.max_bias, tyres.max_force = 0, 150
    space.add(tyres)
car.apply_impulse_at_local_point((250, 0))
for _ in range(240):
    space.step(1 / 60)
