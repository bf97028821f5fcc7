"""The program hangs: an impulse in `begin` wakes sleeping boxes, and Chipmunk loops for ever."""

import sys

import pymunk

MENDED = "mended" in sys.argv
space = pymunk.Space()
space.gravity, space.sleep_time_threshold = (0, 900), 0.25
ground = pymunk.Segment(space.static_body, (0, 300), (500, 300), 10)
ground.friction = 1
space.add(ground)
for k in range(3):
    body = pymunk.Body()
    body.position = 350, 275 - 30 * k
    box = pymunk.Poly.create_box(body, (30, 30))
    box.mass, box.friction, box.collision_type = 1, 1, 1
    space.add(body, box)
blast = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
blast.position = 80, 240
zone = pymunk.Circle(blast, 40)
zone.sensor, zone.collision_type = True, 2
space.add(blast, zone)


def push(arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
    body = arbiter.shapes[0].body
    assert body is not None
    if MENDED:
        space.add_post_step_callback(lambda *_: body.apply_impulse_at_local_point((200, -300)), body)
    else:
        body.apply_impulse_at_local_point((200, -300))


space.on_collision(1, 2, begin=push)
for k in range(200):
    if k == 100:
        blast.velocity = 400, 0
    space.step(1 / 60)
