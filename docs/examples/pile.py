"""A pile: discs with friction fall into a funnel and come to rest on each other."""

import pymunk


def make_space() -> pymunk.Space:
    space = pymunk.Space()
    space.gravity, space.iterations = (0, 900), 30
    for start, end in [((0, 100), (150, 380)), ((400, 100), (250, 380)), ((150, 380), (250, 380))]:
        wall = pymunk.Segment(space.static_body, start, end, 5)
        wall.friction = 0.8
        space.add(wall)
    for k in range(12):
        mass, radius = 1 + 0.1 * k, 12 + k % 3
        body = pymunk.Body(mass, pymunk.moment_for_circle(mass, 0, radius))
        body.position = 140 + 40 * (k % 4) + 5 * (k // 4), 100 + 40 * (k // 4)
        disc = pymunk.Circle(body, radius)
        disc.friction = 0.6
        space.add(body, disc)
    return space


def run(space: pymunk.Space) -> None:
    for _ in range(180):
        space.step(1 / 60)


if __name__ == "__main__":
    run(make_space())
