"""Small programs of the kind that tutorials on bouncing balls have, and what is wrong with each.

`tutorials/` has a file for each, with a function `step(position, velocity, dt, scene)`, which is an engine that reports
no contacts: `sandbox compare oblique --engines tests/tutorials/verlet.py:step,exact` runs one. Each was written from a
description of a typical mistake. What is not its mistake is right, except that most find contacts at the end of a step.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

from sandbox.scene.files import load, parse
from sandbox.scene.model import Scene

FOLDER: Final = Path(__file__).parent / "tutorials"


@dataclass(frozen=True)
class Program:
    """A program, the scene that shows what is wrong with it, and what a true verdict says.

    name: of its file, without the ending; scene_text: a bundled scene's name, or TOML; says: keys of causes of which a
    verdict must name one, none if nothing is wrong; also: keys of other causes that are true of it; figures: the
    parameter of the mistake in the forms in which it may be said, of which one must be, if there are any, to within
    `tolerance` as a fraction.
    """

    name: str
    scene_text: str
    says: frozenset[str]
    also: frozenset[str] = frozenset()
    figures: tuple[float, ...] = ()
    tolerance: float = 0.005

    @property
    def file(self) -> Path:
        return FOLDER / f"{self.name}.py"

    @property
    def spec(self) -> str:
        """The name to give to `--engines`."""
        return f"{self.file}:step"

    @property
    def source(self) -> str:
        return self.file.read_text()

    @property
    def wrong(self) -> str:
        """What is wrong with it, in a line: the docstring of its file."""
        return self.source.split('"""')[1]

    @cached_property
    def scene(self) -> Scene:
        return parse(self.scene_text, f"{self.name}.toml") if "\n" in self.scene_text else load(self.scene_text)

    @property
    def true(self) -> frozenset[str]:
        """Keys of all causes that a verdict may name; any other than these and `unknown` is false."""
        return self.says | self.also

    def has_figure(self, numbers: list[float]) -> bool:
        """Return whether one of some numbers is the parameter of the mistake."""
        return not self.figures or any(
            abs(number - figure) <= self.tolerance * max(abs(figure), 0.1)
            for number in numbers
            for figure in self.figures
        )


# Scenes. Contacts come one at a time, unless the mistake needs several; three balls have seven with each other.

_EQUAL: Final = """seconds = 4
[arena]
size = [400, 300]
[[balls]]
radius = 20
position = [310, 140]
velocity = [-70, 110]
[[balls]]
radius = 20
position = [210, 90]
velocity = [130, 160]
[[balls]]
radius = 20
position = [160, 50]
velocity = [-10, 20]
"""
_UNEQUAL: Final = """seconds = 4
[arena]
size = [400, 300]
[[balls]]
radius = 20
mass = 1
position = [350, 240]
velocity = [-210, 50]
[[balls]]
radius = 15
mass = 4
position = [170, 220]
velocity = [-40, -220]
[[balls]]
radius = 25
mass = 2
position = [270, 250]
velocity = [100, -40]
"""
_LARGE_AND_SMALL: Final = _UNEQUAL.replace("radius = 25", "radius = 15")
_INELASTIC: Final = _EQUAL.replace("radius = 20\n", "radius = 20\nelasticity = 0.6\n")
_DIFFERENT: Final = _UNEQUAL.replace("mass = 1\n", "elasticity = 0.9\n").replace("mass = 2\n", "elasticity = 0.6\n")
_BOX: Final = """seconds = 4
[arena]
size = [400, 300]
[[balls]]
radius = 20
position = [110, 120]
velocity = [230, 170]
"""
_TWO_IN_A_BOX: Final = """seconds = 4
[arena]
size = [600, 400]
elasticity = 0.8
[[balls]]
radius = 20
position = [110, 70]
velocity = [230, 40]
[[balls]]
radius = 20
position = [410, 300]
velocity = [-210, -40]
"""
_CORNER: Final = """seconds = 2
[arena]
size = [400, 300]
[[balls]]
radius = 20
position = [331, 231]
velocity = [180, 182]
"""
_FALL: Final = """seconds = 3
gravity = [0, 900]
[arena]
size = [400, 300]
[[balls]]
radius = 20
position = [330, 50]
velocity = [70, 70]
[[balls]]
radius = 20
position = [320, 170]
velocity = [20, 150]
"""

_LATE: Final = frozenset({"late", "missed"})  # true of what finds contacts at the end of a step


def _program(name: str, scene: str, says: str = "", also: str = "", *figures: float, late: bool = True) -> Program:
    """Make a program. says, also: keys of causes, separated by spaces; late: whether it finds contacts late too."""
    return Program(name, scene, frozenset(says.split()), frozenset(also.split()) | (_LATE if late else set()), figures)


PROGRAMS: Final = {
    program.name: program
    for program in (
        # Nothing is wrong but the time of contacts, or not even that
        _program("textbook", _UNEQUAL, "late"),
        _program("substeps", _UNEQUAL, "late"),
        _program("moved_one_by_one", _EQUAL, "late early"),
        _program("mirrored_walls", _BOX, "", "rounding", late=False),
        _program("single_precision", _BOX, "", "rounding", late=False),
        # Other laws of collision
        _program("verlet", _EQUAL, "small", "pushed overshoot"),
        _program("position_based", _UNEQUAL, "small", "pushed overshoot"),
        _program("springs", _EQUAL, "soft"),
        _program("springs_damped", _EQUAL, "soft small"),
        _program("whole_velocities_swapped", "oblique", "velocity normal"),
        _program("angles_reflected", _EQUAL, "velocity"),
        _program("angles_reflected_and_parted", _EQUAL, "velocity"),
        _program("each_reflected", _EQUAL, "velocity", "pushed"),
        _program("normal_from_velocities", _UNEQUAL, "normal velocity"),
        _program("tangential_parts_swapped", _EQUAL, "velocity"),
        _program("centre_of_mass_formula", _INELASTIC, "large", "turned overshoot"),
        _program("parting_pairs_reversed", _INELASTIC, "turned large", "small"),
        _program("impulse_without_restitution", _EQUAL, "small", "", 0.5, 50, 0),
        _program("merged", _UNEQUAL, "velocity"),
        _program("slowed_by_contacts", _UNEQUAL, "velocity", "", 0.9),
        _program("larger_elasticity", _DIFFERENT, "large"),
        # Masses
        _program("mass_as_radius_squared", _UNEQUAL, "velocity"),
        _program("mass_as_radius_cubed", _UNEQUAL, "velocity"),
        _program("masses_ignored", _UNEQUAL, "velocity"),
        _program("only_one_changed", _EQUAL, "velocity", "", 0),
        _program("pushed_by_half", _UNEQUAL, "pushed late"),
        _program("pushed_first_only", _UNEQUAL, "pushed"),
        _program("pushed_twice", _UNEQUAL, "pushed"),
        _program("pushed_together", _EQUAL, "pushed"),
        # Where contacts are found
        _program("one_radius", _LARGE_AND_SMALL, "early", "", 20, 5, 10),
        _program("bounding_boxes", "oblique", "early"),
        _program("one_contact_a_step", _CORNER, "late missed unconverged"),
        _program("whole_pixels", _BOX, "placed"),
        # Walls
        _program("walls_that_clamp", _BOX, "overshoot"),
        _program("move_undone", _TWO_IN_A_BOX.replace("[230, 40]", "[460, 80]"), "overshoot", "late pushed"),
        _program("move_undone_on_an_axis", _BOX.replace("[230, 170]", "[460, 340]"), "overshoot"),
        _program("walls_that_flip", "bouncing", "turned"),
        _program("walls_at_centres", _BOX, "late missed", "", 20),
        _program("walls_without_elasticity", _TWO_IN_A_BOX, "large", "", 1, 1.1111, 11.11, 1.25),
        _program("restitution_of_whole_velocity", _TWO_IN_A_BOX, "velocity friction_large", "", 0.8, 80, 20),
        _program("walls_that_stop_sliding", _TWO_IN_A_BOX, "velocity friction_large"),
        # Flight
        _program("explicit_gravity", _FALL, "gravity"),
        _program("semi_implicit_gravity", _FALL, "gravity"),
        _program("gravity_twice", _FALL, "gravity", "", 2, 1800, 100, 200),
        _program("several_at_once", _FALL, "gravity damping untold", "overshoot pushed"),
        _program("damped", _UNEQUAL, "damping untold", "", 0.99, 99, 1, 0.5472, 54.72, 45.28),
        _program("air_drag", _UNEQUAL, "untold", "", 0.0005),
        _program("rolling_friction", _UNEQUAL, "untold", "", 20),
        _program("slow_balls_stopped", _EQUAL, "untold"),
        _program("speeds_limited", _UNEQUAL, "untold", "", 150),
        _program("energy_rescaled", _TWO_IN_A_BOX, "untold damping", "large velocity"),
        _program("fixed_dt", _UNEQUAL, "placed untold", "", 1.2, 20, 120, 0.02),
        _program("moved_twice", _FALL, "placed untold", "", 2, 100, 200),
        _program("substeps_of_a_whole_step", _UNEQUAL, "placed untold", "", 4, 300, 400),
    )
}
