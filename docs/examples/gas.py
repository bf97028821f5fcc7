"""A gas: forty discs in a box, without friction or gravity, which never lose energy by themselves."""

import random

import pymunk


def make_space() -> pymunk.Space:
    space, rng = pymunk.Space(), random.Random(1)
    corners = [(0, 0), (400, 0), (400, 300), (0, 300)]
    for k in range(4):
        wall = pymunk.Segment(space.static_body, corners[k - 1], corners[k], 5)
        wall.elasticity = 1
        space.add(wall)
    for k in range(40):
        body = pymunk.Body(1, pymunk.moment_for_circle(1, 0, 8))
        body.position = 45 + 44 * (k % 8), 50 + 50 * (k // 8)
        body.velocity = rng.uniform(-150, 150), rng.uniform(-150, 150)
        disc = pymunk.Circle(body, 8)
        disc.elasticity = 1
        space.add(body, disc)
    return space


def run(space: pymunk.Space) -> None:
    for _ in range(300):
        space.step(1 / 60)


if __name__ == "__main__":
    run(make_space())
