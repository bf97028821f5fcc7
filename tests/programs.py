"""Small programs of the kind that tutorials on bouncing balls have, and what is wrong with each.

A program is a function `step(position, velocity, dt, scene)`, which is an engine that reports no contacts. Each was
written from a description of a typical mistake. What is not its mistake is right, except that most find contacts at the
end of a step. Most are the textbook's program with parts of it replaced.
"""

import re
from textwrap import indent
from typing import Any, Final

from faults import FAULTS, Fault

from sandbox.judge.causes import Cause
from sandbox.scene.files import load, parse

TEXTBOOK: Final = """
import numpy as np

def step(position, velocity, dt, scene):
    balls, before = scene.bodies, position.copy()
    {move}
    for i in range(len(position)):
        {alone}
        for axis, side in enumerate(scene.arena.size):
            too_low = position[i, axis] < balls.radius[i] and velocity[i, axis] < 0
            too_high = position[i, axis] > side - balls.radius[i] and velocity[i, axis] > 0
            if {in_wall}:
                {bounce}
        for j in {others}:
            away = position[j] - position[i]
            distance = (away @ away) ** 0.5
            {near}
            if {meet}:
                {collide}
    {finish}
"""
MOVE: Final = "position += velocity * dt"
BOUNCE: Final = "velocity[i, axis] *= -balls.elasticity[i] * scene.arena.elasticity"
NEAR: Final = "normal = away / distance\napproach = (velocity[i] - velocity[j]) @ normal"
MEET: Final = "distance < balls.radius[i] + balls.radius[j] and approach > 0"
COLLIDE: Final = """restitution = balls.elasticity[i] * balls.elasticity[j]
impulse = (1 + restitution) * approach / (1 / balls.mass[i] + 1 / balls.mass[j])
velocity[i] -= impulse / balls.mass[i] * normal
velocity[j] += impulse / balls.mass[j] * normal"""
PARTS: Final = {
    "move": MOVE, "alone": "", "in_wall": "too_low or too_high", "bounce": BOUNCE, "others": "range(i)",
    "near": NEAR, "meet": MEET, "collide": COLLIDE, "finish": "",
}  # fmt: skip


def textbook(**replaced: str) -> str:
    """Return the source of the textbook's program with other parts."""
    parts = PARTS | replaced
    lines = re.sub(r"^( +)\{(\w+)\}$", lambda part: indent(parts[part[2]], part[1]), TEXTBOOK, flags=re.MULTILINE)
    return lines.format(**parts)


def program(
    wrong: str, scene: str, says: str = "", also: str = "", *figures: float, late: bool = True, source: str = "",
    **parts: str,
) -> Fault:  # fmt: skip
    """Make a program.

    wrong: what is wrong with it; scene: a bundled one's name, or TOML; says: keys of causes of which a verdict must
    name one; also: of others that are true; late: whether it finds contacts late too; source: if not the textbook's.
    """
    names: dict[str, Any] = {}
    exec(source or textbook(**parts), names)
    names["step"].__doc__ = wrong
    keys = {cause.key: cause for cause in Cause}
    must = frozenset(keys[key] for key in says.split())
    may = frozenset(keys[key] for key in [*also.split(), *(("late", "missed") if late else ())])
    shows = parse(scene, "program.toml") if "\n" in scene else load(scene)
    return Fault(names["step"], must | may, lambda _: False, shows, must, figures)


# Scenes. Contacts come one at a time, unless the mistake needs several; three balls have seven with each other.

EQUAL: Final = """seconds = 4
arena = { size = [400, 300] }
balls = [
    { radius = 20, position = [310, 140], velocity = [-70, 110] },
    { radius = 20, position = [210, 90], velocity = [130, 160] },
    { radius = 20, position = [160, 50], velocity = [-10, 20] },
]
"""
UNEQUAL: Final = """seconds = 4
arena = { size = [400, 300] }
balls = [
    { radius = 20, mass = 1, position = [350, 240], velocity = [-210, 50] },
    { radius = 15, mass = 4, position = [170, 220], velocity = [-40, -220] },
    { radius = 25, mass = 2, position = [270, 250], velocity = [100, -40] },
]
"""
LARGE_AND_SMALL: Final = UNEQUAL.replace("radius = 25", "radius = 15")
INELASTIC: Final = EQUAL.replace("radius = 20", "radius = 20, elasticity = 0.6")
DIFFERENT: Final = UNEQUAL.replace("mass = 1", "elasticity = 0.9").replace("mass = 2", "elasticity = 0.6")
BOX: Final = """seconds = 4
arena = { size = [400, 300] }
balls = [{ radius = 20, position = [110, 120], velocity = [230, 170] }]
"""
TWO_IN_A_BOX: Final = """seconds = 4
arena = { size = [600, 400], elasticity = 0.8 }
balls = [
    { radius = 20, position = [110, 70], velocity = [230, 40] },
    { radius = 20, position = [410, 300], velocity = [-210, -40] },
]
"""
CORNER: Final = """seconds = 2
arena = { size = [400, 300] }
balls = [{ radius = 20, position = [331, 231], velocity = [180, 182] }]
"""
FALL: Final = """seconds = 3
gravity = [0, 900]
arena = { size = [400, 300] }
balls = [
    { radius = 20, position = [330, 50], velocity = [70, 70] },
    { radius = 20, position = [320, 170], velocity = [20, 150] },
]
"""

FALLING: Final = "gravity = np.array(scene.gravity)\n"
MASS: Final = COLLIDE.replace("balls.mass", "mass")
IN_WALL: Final = "not balls.radius[i] <= position[i, axis] <= side - balls.radius[i]"
OVERLAP: Final = "overlap = balls.radius[i] + balls.radius[j] - distance\n"
HALVES: Final = "position[i] -= overlap / 2 * normal\nposition[j] += overlap / 2 * normal\n"
MIRRORED: Final = """
import numpy as np

def step(position, velocity, dt, scene):
    position += velocity * dt
    for i, radius in enumerate(scene.bodies.radius):
        for axis, side in enumerate(scene.arena.size):
            for wall, outward in ((radius, -1), (side - radius, 1)):
                if outward * (position[i, axis] - wall) > 0:
                    position[i, axis] = 2 * wall - position[i, axis]
                    velocity[i, axis] *= -1
"""
SPRINGS: Final = """
def step(position, velocity, dt, scene):
    radius, mass = scene.bodies.radius, scene.bodies.mass
    for i in range(len(position)):
        for axis, side in enumerate(scene.arena.size):
            below = max(0, radius[i] - position[i, axis])
            above = max(0, position[i, axis] + radius[i] - side)
            force = 500 * (below - above)
            velocity[i, axis] += force / mass[i] * dt
        for j in range(i):
            away = position[j] - position[i]
            distance = (away @ away) ** 0.5
            overlap = radius[i] + radius[j] - distance
            if overlap > 0:
                normal = away / distance
                force = 500 * overlap
                velocity[i] -= force / mass[i] * dt * normal
                velocity[j] += force / mass[j] * dt * normal
    position += velocity * dt
"""
POSITION_BASED: Final = """
import numpy as np

def step(position, velocity, dt, scene):
    radius, share = scene.bodies.radius, 1 / scene.bodies.mass
    before = position.copy()
    velocity += np.array(scene.gravity) * dt
    position += velocity * dt
    for _ in range(4):
        for i in range(len(position)):
            for j in range(i):
                away = position[j] - position[i]
                distance = (away @ away) ** 0.5
                overlap = radius[i] + radius[j] - distance
                if overlap > 0:
                    move = overlap * away / distance / (share[i] + share[j])
                    position[i] -= share[i] * move
                    position[j] += share[j] * move
            position[i] = np.clip(position[i], radius[i], np.array(scene.arena.size) - radius[i])
    velocity[:] = (position - before) / dt
"""


SUBSTEPS: Final = (
    textbook().replace("def step", "def substep")
    + """
def step(position, velocity, dt, scene):
    for _ in range(4):
        substep(position, velocity, dt / 4, scene)
"""
)


PROGRAMS: Final = {
    # Nothing is wrong but the time of contacts, or not even that
    "textbook": program("Right, except that contacts are found up to a step late.", UNEQUAL, "late"),
    "substeps": program(
        "Right, but for contacts that are a quarter of a step late.", UNEQUAL, "late", source=SUBSTEPS
    ),
    "moved_one_by_one": program(
        "Each ball is moved and then compared with the others, of which some have not moved yet.", EQUAL, "late early",
        move="", alone="position[i] += velocity[i] * dt", others="(j for j in range(len(position)) if j != i)",
    ),
    "mirrored_walls": program(
        "A ball found beyond a wall is mirrored at it, place and velocity: nothing is wrong, without gravity.",
        BOX, "", "rounding", late=False, source=MIRRORED,
    ),
    "single_precision": program(
        "The state is kept in single precision: there are only errors of rounding.", BOX, "", "rounding", late=False,
        source=MIRRORED + "    position[:], velocity[:] = position.astype(np.float32), velocity.astype(np.float32)",
    ),
    # Other laws of collision
    "position_based": program(
        "Overlaps are removed by inverse mass, and velocities follow from where the balls end.",
        UNEQUAL, "small", "pushed overshoot", source=POSITION_BASED,
    ),
    "springs": program(
        "Overlapping balls push each other like springs.", EQUAL, source=SPRINGS
    ),
    "whole_velocities_swapped": program(
        "Whole velocities are swapped, not only their parts along the line of centres.", "oblique", "velocity normal",
        collide="velocity[[i, j]] = velocity[[j, i]]",
    ),
    "parting_pairs_reversed": program(
        "An impulse wherever balls overlap: parting pairs are turned back.", INELASTIC, "turned large", "small",
        meet="distance < balls.radius[i] + balls.radius[j]",
    ),
    "impulse_without_restitution": program(
        "The impulse lacks the factor 1 + e: balls that meet do not part.", EQUAL, "small", "", 0.5, 50, 0,
        collide=COLLIDE.replace("(1 + restitution) * ", ""),
    ),
    "larger_elasticity": program(
        "The larger elasticity of two balls counts, not the product.", DIFFERENT, "large",
        collide=COLLIDE.replace("balls.elasticity[i] * balls.elasticity[j]", "max(balls.elasticity[[i, j]])"),
    ),
    "smaller_elasticity": program(
        "The smaller elasticity of two balls counts.", DIFFERENT, "large", "", 0.6,
        collide=COLLIDE.replace("balls.elasticity[i] * balls.elasticity[j]", "min(balls.elasticity[[i, j]])"),
    ),
    "mean_elasticity": program(
        "The mean of both elasticities counts.", DIFFERENT, "large", "", 0.75,
        collide=COLLIDE.replace("balls.elasticity[i] * balls.elasticity[j]", "balls.elasticity[[i, j]].mean()"),
    ),
    "one_elasticity": program(
        "The elasticity of one ball counts: it cannot be known how it is made of two that are equal.",
        INELASTIC, "large", "", 0.6, collide=COLLIDE.replace(" * balls.elasticity[j]", "", 1),
    ),
    # Masses
    "mass_not_reduced": program(
        "The mass of one ball stands for the reduced mass.", UNEQUAL.replace("= 4", "= 0.9"), "large",
        collide=COLLIDE.replace("/ (1 / balls.mass[i] + 1 / balls.mass[j])", "* balls.mass[i]"),
    ),
    "masses_added": program(
        "The sum of the masses stands for the reduced mass.", UNEQUAL.replace("= 4", "= 0.9"), "large",
        collide=COLLIDE.replace("/ (1 / balls.mass[i] + 1 / balls.mass[j])", "* (balls.mass[i] + balls.mass[j])"),
    ),
    "mass_as_radius_squared": program(
        "Masses are taken as radius².", UNEQUAL, "velocity", move=f"mass = balls.radius**2\n{MOVE}", collide=MASS,
    ),
    "mass_as_radius_cubed": program(
        "Masses are taken as radius³.", UNEQUAL, "velocity", move=f"mass = balls.radius**3\n{MOVE}", collide=MASS,
    ),
    "masses_ignored": program(
        "Velocities along the line of centres are swapped, whatever the masses.", UNEQUAL, "velocity",
        collide="velocity[i] -= approach * normal\nvelocity[j] += approach * normal",
    ),
    "only_one_changed": program(
        "Of two balls that meet only one changes its velocity.", EQUAL, "velocity", "", 0,
        collide=COLLIDE.replace("velocity[j] += ", ""),
    ),
    "pushed_by_half": program(
        "Overlapping balls are pushed apart by half of the overlap each, whatever their masses.", UNEQUAL,
        "pushed late",
        near=f"{NEAR}\n{OVERLAP}if overlap > 0:\n{indent(HALVES, '    ')}", meet="overlap > 0 and approach > 0",
    ),
    "pushed_twice": program(
        "Of two balls that overlap, each is put outside the other.", UNEQUAL, "pushed",
        collide=f"{COLLIDE}\n{OVERLAP}position[i] -= overlap * normal\nposition[j] += overlap * normal",
    ),
    # Where contacts are found
    "one_radius": program(
        "All balls are taken to have the radius of the first one.", LARGE_AND_SMALL, "early", "", 20, 5, 10,
        meet="distance < 2 * balls.radius[0] and approach > 0",
    ),
    "bounding_boxes": program(
        "Balls meet where their bounding boxes do: early, on a normal that will turn.", "oblique", "early",
        meet="np.all(np.abs(away) < balls.radius[i] + balls.radius[j]) and approach > 0",
    ),
    "one_contact_a_step": program(
        "Only the first contact of a ball in a step is resolved; in a corner, it keeps the other.",
        CORNER, "late missed", bounce=f"{BOUNCE}\nbreak",
    ),
    "whole_pixels": program(
        "Positions are whole pixels: what a step moves beyond them is lost.", BOX, "placed",
        move="position[:] = np.trunc(position + velocity * dt)",
    ),
    # Walls
    "walls_that_clamp": program(
        "A ball found in a wall is put on it, which discards the way that it has flown back already.", BOX, "overshoot",
        bounce=f"{BOUNCE}\nposition[i, axis] = balls.radius[i] if too_low else side - balls.radius[i]",
    ),
    "walls_that_mirror_places": program(
        "A ball found in a wall is mirrored at it, though it leaves more slowly than it came.",
        BOX.replace("radius = 20", "radius = 20, elasticity = 0.8"), "pushed",
        source=MIRRORED.replace("*= -1", "*= -scene.bodies.elasticity[i]"),
    ),
    "walls_that_put_too_far": program(
        "A ball found in a wall is mirrored at it, and put 0.3 px further away.", "bouncing", "", "placed pushed",
        move=FALLING + "position += velocity * dt + gravity * dt**2 / 2\nvelocity += gravity * dt",
        bounce=f"{BOUNCE}\nplace = balls.radius[i] + 0.15 if too_low else side - balls.radius[i] - 0.15\n"
        "position[i, axis] = 2 * place - position[i, axis]",
    ),
    "move_undone_on_an_axis": program(
        "Where a move along an axis leads into a wall, the place on that axis is put back.",
        BOX.replace("[230, 170]", "[460, 340]"), "overshoot",
        in_wall=IN_WALL, bounce=f"{BOUNCE}\nposition[i, axis] = before[i, axis]",
    ),
    "walls_that_flip": program(
        "A ball found in a wall is reversed in every step that it is there.", "bouncing", "turned", in_wall=IN_WALL,
        move=FALLING + "position += velocity * dt + gravity * dt**2 / 2\nvelocity += gravity * dt",
    ),
    "walls_at_centres": program(
        "A ball bounces off a wall when its centre gets there.", BOX, "late missed", "", 20,
        in_wall="(position[i, axis] < 0 and too_low) or (position[i, axis] > side and too_high)",
    ),
    "walls_without_elasticity": program(
        "Walls reverse a velocity in full, whatever their elasticity is.",
        TWO_IN_A_BOX, "large", "", 1, 1.1111, 11.11, 1.25, bounce="velocity[i, axis] *= -1",
    ),
    "restitution_of_whole_velocity": program(
        "Walls multiply the whole velocity by the elasticity.", TWO_IN_A_BOX, "velocity friction_large",
        bounce="velocity[i, axis] *= -1\nvelocity[i] *= balls.elasticity[i] * scene.arena.elasticity",
    ),
    "walls_that_stop_sliding": program(
        "A wall takes all of the velocity along it, though there is no friction.", TWO_IN_A_BOX,
        "velocity friction_large", bounce=f"{BOUNCE}\nvelocity[i, 1 - axis] = 0",
    ),
    # Flight
    "explicit_gravity": program(
        "Gravity is added after the move: each step falls g dt²/2 too little.", FALL, "gravity",
        move=f"{MOVE}\nvelocity += np.array(scene.gravity) * dt",
    ),
    "semi_implicit_gravity": program(
        "Gravity is added before the move: each step falls g dt²/2 too far.", FALL, "gravity",
        move=f"velocity += np.array(scene.gravity) * dt\n{MOVE}",
    ),
    "gravity_twice": program(
        "Gravity is applied twice a step, once as a weight and once as an acceleration.",
        FALL, "gravity", "", 2, 1800, 100, 200,
        move="twice = np.outer(balls.mass, scene.gravity) / balls.mass[:, None] + scene.gravity\n"
        "position += velocity * dt + twice * dt**2 / 2\nvelocity += twice * dt",
    ),
    "damped": program(
        "Every step multiplies each velocity by 0.99.",
        UNEQUAL, "damping untold", "", 0.99, 99, 1, 0.5472, 54.72, 45.28, move=f"velocity *= 0.99\n{MOVE}",
    ),
    "air_drag": program(
        "Air drags at each ball, with the square of its speed.", UNEQUAL, "untold", "", 0.0005,
        move=f"velocity *= 1 - 0.0005 * np.hypot(*velocity.T)[:, None] * dt\n{MOVE}",
    ),
    "rolling_friction": program(
        "A table takes 20 px/s off the balls' speeds each second, until they stand still.", UNEQUAL, "untold", "", 20,
        move=f"velocity *= np.maximum(0, 1 - 20 * dt / np.hypot(*velocity.T))[:, None]\n{MOVE}",
    ),
    "slow_balls_stopped": program(
        "A ball slower than 60 px/s is stopped.", EQUAL, "untold",
        move=f"velocity[np.hypot(*velocity.T) < 60] = 0\n{MOVE}",
    ),
    "speeds_limited": program(
        "No ball is faster than 150 px/s.", UNEQUAL, "untold", "", 150,
        move=f"velocity *= np.minimum(1, 150 / np.hypot(*velocity.T))[:, None]\n{MOVE}",
    ),
    "energy_rescaled": program(
        "All velocities are scaled after each step, so that the kinetic energy stays what it was.",
        TWO_IN_A_BOX, "untold damping", "large velocity",
        move=f"energy = np.sum(balls.mass * np.sum(velocity**2, axis=1))\n{MOVE}",
        finish="velocity *= (energy / np.sum(balls.mass * np.sum(velocity**2, axis=1))) ** 0.5",
    ),
    "fixed_dt": program(
        "The loop has a time step of its own, 1/50 s.", UNEQUAL, "placed untold", "", 1.2, 20, 120, 0.02,
        move="position += velocity / 50",
    ),
    "moved_twice": program(
        "The balls are moved when they are updated and once more when they are drawn.",
        FALL, "placed untold", "", 2, 100, 200,
        move=FALLING + "for _ in ('update', 'draw'):\n    position += velocity * dt + gravity * dt**2 / 2\n"
        "    velocity += gravity * dt",
    ),
}  # fmt: skip
FAULTS.update(PROGRAMS)
