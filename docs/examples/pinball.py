"""A board like a pinball machine's: a ball, posts, and two flippers that the program plays."""

import pymunk


def add_wall(space: pymunk.Space, start: tuple[float, float], end: tuple[float, float]) -> None:
    wall = pymunk.Segment(space.static_body, start, end, 4)
    wall.elasticity, wall.friction = 0.7, 0.5
    space.add(wall)


def make_space() -> pymunk.Space:
    space = pymunk.Space()
    space.gravity = 0, 500
    corners = [(0, 0), (300, 0), (300, 600), (0, 600)]
    for k in range(4):
        add_wall(space, corners[k - 1], corners[k])
    add_wall(space, (0, 480), (110, 540))  # the flippers, at rest
    add_wall(space, (300, 480), (190, 540))
    for x, y in [(90, 200), (210, 200), (150, 300)]:
        post = pymunk.Body(body_type=pymunk.Body.STATIC)
        post.position, post.angle = (x, y), 0.785
        bumper = pymunk.Poly.create_box(post, (30, 30))
        bumper.elasticity = 1
        space.add(post, bumper)
    ball = pymunk.Body(1, pymunk.moment_for_circle(1, 0, 12))
    ball.position, ball.velocity = (60, 100), (120, 0)
    disc = pymunk.Circle(ball, 12)
    disc.elasticity, disc.friction = 0.9, 0.5
    space.add(ball, disc)
    return space


def run(space: pymunk.Space) -> None:
    [ball] = (body for body in space.bodies if body.body_type == pymunk.Body.DYNAMIC)
    for _ in range(300):
        if ball.position.y > 490 and ball.velocity.y > 0:
            ball.velocity = ball.velocity.x, -700  # a flipper strikes
        space.step(1 / 60)


if __name__ == "__main__":
    run(make_space())
