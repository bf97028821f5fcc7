"""A chain vanishes: it hangs on a body that has no mass and was never added."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity = 0, 900
hook = pymunk.Body(body_type=pymunk.Body.STATIC) if MENDED else pymunk.Body()
hook.position = 300, 80
last = hook
for k in range(5):
    link = pymunk.Body()
    link.position = 300, 95 + 30 * k
    bar = pymunk.Segment(link, (0, -15), (0, 15), 2)
    bar.mass, bar.filter = 1, pymunk.ShapeFilter(group=1)
    space.add(link, bar, pymunk.PivotJoint(last, link, (300, 80 + 30 * k)))
    last = link
for _ in range(90):
    space.step(1 / 60)
