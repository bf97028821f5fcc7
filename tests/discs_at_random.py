"""Random scenes of few discs and straight walls, for comparisons with the programs in decimals."""

import math
import random
from collections.abc import Sequence

from scene_in_decimal import Numbers


def draw(seed: int, *, rough: bool) -> Numbers:
    """Draw a scene: radii from 1e-2 to 100 px, masses from 1e-3 to 1e3 kg, elasticities of contacts from 0.3 to 1.

    rough: friction factors up to 1.5, spins, and discs that lie on walls.
    """
    rng = random.Random(seed)

    def log_uniform(low: float, high: float) -> float:
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    def vector(length: float) -> tuple[float, float]:
        angle = rng.uniform(0, 2 * math.pi)
        return length * math.cos(angle), length * math.sin(angle)

    def elasticity() -> float:
        return 1.0 if lossless else math.sqrt(rng.uniform(0.3, 1))  # of two factors

    def friction() -> float:
        return rng.choice([0.0, rng.uniform(0, 1.5), rng.uniform(0, 1.5)]) if rough else 0.0

    def spin(radius: float) -> float:
        return min(side * rng.choice([0, 0.1, 1]) / radius, 1000) * rng.uniform(-1, 1) if rough else 0.0

    lossless = rng.random() < (0.1 if rough else 0.4)
    largest = log_uniform(1e-2, 100)
    smallest = max(1e-2, largest / log_uniform(1, rng.choice([30, 1e4])))
    side = largest * rng.uniform(6, 25)
    size = (side, side * rng.uniform(0.6, 1.6))
    fall = side * log_uniform(0.1, 10) if rng.random() < (0.8 if rough else 0.6) else 0.0
    gravity = rng.choice([vector(fall), (0.0, fall)])
    walls: list[tuple[float, ...]] = []
    for _ in range(rng.choice([0, 0, 1, 2, 3, 4])):
        ends = [rng.uniform(0, extent) for extent in size * 2]
        if math.dist(ends[:2], ends[2:]) > side / 20:
            walls.append((*ends, rng.choice([0.0, side * rng.uniform(0, 0.06)]), elasticity(), friction()))
    balls: list[tuple[float, ...]] = []
    in_flock = rng.random() < (0.1 if rough else 0.2)  # they nearly touch, and fly together
    flock = vector(side * log_uniform(0.1, 1)) if in_flock else None
    for _ in range(rng.randint(1, 5 if rough else 8)):
        radius = log_uniform(smallest, largest)
        for _ in range(100):
            x, y = (rng.uniform(radius, extent - radius) for extent in size)
            vx, vy = vector(side * log_uniform(0.1, 5))
            if flock and balls:
                neighbour = rng.choice(balls)
                dx, dy = vector(radius + neighbour[4] + side * log_uniform(1e-6, 1e-2))
                x, y = neighbour[0] + dx, neighbour[1] + dy
                dvx, dvy = vector(side * log_uniform(1e-5, 1e-1))
                vx, vy = flock[0] + dvx, flock[1] + dvy
            elif rough and not lossless and rng.random() < 0.5:
                x, y, vx, vy = lying(rng, radius, size, walls, gravity)
            if is_free(x, y, radius, size, balls, walls):
                mass = log_uniform(1e-3, 1e3)
                balls.append((x, y, vx, vy, radius, mass, elasticity(), friction(), spin(radius)))
                break
    return Numbers(size, elasticity(), friction(), gravity, rng.randint(6, 60), tuple(balls), tuple(walls))


def lying(
    rng: random.Random,
    radius: float,
    size: tuple[float, float],
    walls: Sequence[tuple[float, ...]],
    gravity: tuple[float, float],
) -> tuple[float, float, float, float]:
    """Draw the place and velocity of a disc that touches the upper face of a wall, but for a little, and moves along.

    On the sides of the arena, it is above if gravity says so.
    """
    corners = [(0.0, size[1]), (0.0, 0.0), (size[0], 0.0), size]
    sides = [(*start, *end, 0.0) for start, end in zip(corners, corners[1:] + corners[:1], strict=True)]
    x0, y0, x1, y1, thickness, *_ = rng.choice([*sides, *walls, *walls])
    share, length = rng.random(), math.dist((x0, y0), (x1, y1))
    tx, ty = (x1 - x0) / length, (y1 - y0) / length
    above = math.copysign(radius + thickness / 2 + size[0] * 1e-12, gravity[0] * ty - gravity[1] * tx)
    speed = size[0] * rng.uniform(-1, 1) * rng.choice([0.01, 0.1, 1])
    return x0 + share * length * tx - above * ty, y0 + share * length * ty + above * tx, speed * tx, speed * ty


def is_free(
    x: float,
    y: float,
    radius: float,
    size: tuple[float, float],
    balls: Sequence[tuple[float, ...]],
    walls: Sequence[tuple[float, ...]],
) -> bool:
    """Return whether a disc would be in the arena, and overlap no other and no wall."""
    if not (radius < x < size[0] - radius and radius < y < size[1] - radius):
        return False
    for other_x, other_y, _, _, other, *_ in balls:
        if math.dist((x, y), (other_x, other_y)) <= radius + other:
            return False
    for x0, y0, x1, y1, thickness, *_ in walls:
        dx, dy = x1 - x0, y1 - y0
        share = min(1.0, max(0.0, ((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy)))
        if math.dist((x, y), (x0 + share * dx, y0 + share * dy)) <= radius + thickness / 2:
            return False
    return True


Shape = tuple[float, ...]  # x, y, vx, vy, radius, mass
Ends = tuple[float, ...]  # x, y, x, y


def draw_rattling(seed: int) -> Numbers:
    """Draw a scene of 2 to 4 discs with mass ratios up to a million, in which impacts follow each other fast.

    Discs are caught between others, between another and the floor, or between two walls that meet at an angle. The
    elasticities of contacts are 0.05 to 1; half of the scenes have friction and spin.
    """
    rng = random.Random(f"rattling {seed}")
    rough, size = rng.random() < 0.5, (800.0, 600.0)
    gravity = rng.choice([(0.0, 900.0), (0.0, 0.0), (rng.uniform(-500, 500), rng.uniform(10, 2000))])

    def factors() -> tuple[float, float]:
        friction = rng.choice([0.0, rng.uniform(0, 1), 1.0]) if rough else 0.0
        return math.sqrt(rng.choice([rng.uniform(0.05, 0.5), rng.uniform(0.05, 1), 1.0])), friction

    arrange = rng.choice([on_floor, between_heavy_discs, between_walls])
    shapes, segments = arrange(rng)
    walls = [(*ends, rng.choice([0.0, 6.0]), *factors()) for ends in segments]
    for _ in range(rng.choice([0, 0, 1, 2])):
        place, velocity = [rng.uniform(50, 550) for _ in range(2)], [rng.uniform(-400, 400) for _ in range(2)]
        shapes.append((*place, *velocity, rng.uniform(5, 30), 10 ** rng.uniform(-3, 3)))
    balls: list[tuple[float, ...]] = []
    for x, y, vx, vy, radius, mass in shapes:
        if is_free(x, y, radius, size, balls, walls) and len(balls) < 4:
            spin = rng.choice([0.0, rng.uniform(-20, 20)]) if rough else 0.0
            balls.append((x, y, vx, vy, radius, mass, *factors(), spin))
    return Numbers(size, *factors(), gravity, 60, tuple(balls), tuple(walls))


def beside(rng: random.Random) -> float:
    """Draw by how much discs are not in line, px."""
    return rng.choice([0.0, rng.uniform(-0.1, 0.1), rng.uniform(-5, 5)])


def on_floor(rng: random.Random) -> tuple[list[Shape], list[Ends]]:
    """Return a heavy disc that falls on a light one above the floor, or on two."""
    shapes: list[Shape] = []
    y = 600 - rng.choice([1e-9, rng.uniform(0, 20)])
    for _ in range(rng.choice([1, 1, 2])):
        radius = rng.uniform(5, 20)
        shapes.append((400 + beside(rng), y - radius, 0.0, 0.0, radius, 10 ** rng.uniform(-3, 0)))
        y -= 2 * radius + rng.uniform(0.1, 5)
    radius, mass = rng.uniform(5, 40), shapes[0][5] * 10 ** rng.uniform(0, 6)
    vx = rng.choice([0.0, rng.uniform(-100, 100)])
    return [*shapes, (400 + beside(rng), y - radius - rng.uniform(1, 100), vx, rng.uniform(50, 500), radius, mass)], []


def between_heavy_discs(rng: random.Random) -> tuple[list[Shape], list[Ends]]:
    """Return a light disc between two heavy ones that close on it, in some direction."""
    angle, light = rng.uniform(0, 2 * math.pi), 10 ** rng.uniform(-3, 0)
    radius, drift = rng.uniform(5, 20), [rng.uniform(-100, 100) for _ in range(2)]
    shapes: list[Shape] = [(400.0, 300.0, *drift, radius, light)]
    for side in (-1, 1):
        heavy, off, speed = rng.uniform(5, 40), beside(rng), -side * rng.uniform(30, 300)
        along = side * (radius + heavy + rng.uniform(0.1, 30))
        x, y = along * math.cos(angle) - off * math.sin(angle), along * math.sin(angle) + off * math.cos(angle)
        vx, vy = drift[0] + speed * math.cos(angle), drift[1] + speed * math.sin(angle)
        shapes.append((400 + x, 300 + y, vx, vy, heavy, light * 10 ** rng.uniform(0, 6)))
    return shapes, []


def between_walls(rng: random.Random) -> tuple[list[Shape], list[Ends]]:
    """Return a disc that flies into the edge of two walls, or a heavy one behind it too."""
    half, turn, long = rng.uniform(0.05, 1.3), rng.uniform(0, 2 * math.pi), 250
    ends = [(400 + long * math.cos(turn + side), 300 + long * math.sin(turn + side)) for side in (-half, half)]
    shapes: list[Shape] = []
    out, mass = 20 / math.sin(half), 10 ** rng.uniform(-3, 0)
    for _ in range(rng.choice([1, 2, 2])):
        radius, off, speed = rng.uniform(5, 12), beside(rng), rng.uniform(50, 400)
        x, y = out * math.cos(turn) - off * math.sin(turn), out * math.sin(turn) + off * math.cos(turn)
        way = turn + math.pi + rng.uniform(-half, half) / 2
        shapes.append((400 + x, 300 + y, speed * math.cos(way), speed * math.sin(way), radius, mass))
        out, mass = out + 2 * radius + rng.uniform(5, 20), mass * 10 ** rng.uniform(0, 6)
    return shapes, [(400.0, 300.0, *end) for end in ends]
