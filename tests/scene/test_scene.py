"""The format of a scene: what it accepts, and its error messages."""

import json
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import NO_KEY, Command, require, scene_of
from pydantic import BaseModel

from sandbox.errors import SandboxError
from sandbox.scene.balls import MAX_BALLS
from sandbox.scene.fields import PALETTE
from sandbox.scene.files import bundled, load, parse, schema
from sandbox.scene.spawn import spawn, warnings
from sandbox.scene.toml_lines import line_of, lines_of_keys

ARENA = "[arena]\nsize = [800, 600]\n"  # lines 1 and 2; the first group's header is line 3
BALL = "radius = 5\nposition = [100, 100]"


def balls(*groups: str, more: str = "") -> str:
    """Return a scene whose first group's keys begin in line 4."""
    return ARENA + "".join(f"[[balls]]\n{group}\n" for group in groups) + more


def errors(text: str) -> list[str]:
    """Return the errors of a scene, without the name of the file."""
    with pytest.raises(SandboxError) as caught:
        parse(text, "mine.toml")
    return [line.removeprefix("mine.toml:") for line in str(caught.value).splitlines()]


# --- What the format accepts -----------------------------------------------------------------------------------


WAYS = {
    "position = [100, 200.5]": 1,
    "count = 7\nx = { from = 20, to = 780, step = 1 }\ny = { from = 20.5, to = 21 }": 7,
    "count = 3\ninside = [[0, 0], [800, 600]]": 3,
    "inside = [[300, 200], [100, 50]]": 1,  # corners in any order
    "grid = [4, 3]\nspacing = 30": 12,
    "grid = [4, 3]\nspacing = 30\nposition = [50, 60]\ncount = 5": 5,
    "positions = [[100, 200.5], [30, 40]]": 2,
    "position = [100, 100]\nvelocity = [120, -60.5]": 1,
    "position = [100, 100]\nvx = { from = -1, to = 1 }\nvy = { from = -120, to = -360, step = -120 }": 1,
    "position = [100, 100]\nspeed = 200": 1,
    "position = [100, 100]\nrms_speed = 0.5": 1,
    "position = [100, 100]\nvelocities = [[1, -2.5]]": 1,
}


@pytest.mark.parametrize("group", WAYS)
def test_every_way_to_place_and_throw(group: str) -> None:
    read = scene_of(f"radius = 10\n{group}").balls[0]
    assert read.ball_count == WAYS[group]
    assert as_written(read) == tomllib.loads(f"radius = 10\n{group}")


def as_written(model: BaseModel) -> object:
    return json.loads(model.model_dump_json(by_alias=True, exclude_unset=True))


def test_defaults() -> None:
    scene = parse(balls(BALL, more="[[walls]]\nfrom = [0, 0]\nto = [9, 9]\n"), "mine.toml")
    assert (scene.rate, scene.seconds, scene.seed, scene.gravity, scene.expect) == (60, 20, 0, (0, 0), ())
    assert (scene.arena.elasticity, scene.arena.friction, scene.arena.background) == (1, 0, "white")
    ball, wall = scene.balls[0], scene.walls[0]
    assert (ball.mass, ball.elasticity, ball.friction, ball.ball_count) == (1, 1, 0, 1)
    assert (wall.thickness, wall.elasticity, wall.friction) == (4, 1, 0)
    assert scene.pymunk.model_dump(exclude_none=True) == {"substeps": 1, "walls_first": 0}


def test_bodies_and_colours_are_in_scene_order() -> None:
    scene = scene_of(
        'radius = 5\nmass = 2\ngrid = [3, 1]\nspacing = 20\ncolors = ["red", "blue"]',
        "radius = 7\nelasticity = 0.5\nfriction = 0.25\nposition = [20, 20]",
    )
    assert scene.bodies.radius.tolist() == [5, 5, 5, 7]
    assert scene.bodies.mass.tolist() == [2, 2, 2, 1]
    assert scene.bodies.elasticity.tolist() == [1, 1, 1, 0.5]
    assert scene.bodies.friction.tolist() == [0, 0, 0, 0.25]
    assert scene.colors == ("red", "blue", "red", PALETTE[1])


def test_touching_the_arena_is_inside_it() -> None:
    scene = scene_of("radius = 20\nposition = [20, 580]", "radius = 20\nposition = [780, 20]")
    assert spawn(scene).position.tolist() == [[20, 580], [780, 20]]


def test_a_grid_that_fills_the_arena_is_inside_it() -> None:
    spawned = spawn(scene_of("radius = 0.05\ngrid = [10, 10]\nspacing = 0.1", size="[1, 1]"))
    assert spawned.position[-1].tolist() == pytest.approx([0.95, 0.95], abs=1e-12)


# --- Errors ----------------------------------------------------------------------------------------------------


def test_errors_in_keys_and_in_tables_together_are_reported_with_all_others() -> None:
    text = (
        "seconds = 2\ngravity = 900\n[arena]\nsize = [400, 300]\n"
        "[[balls]]\nradius = 10\nposition = [100, 100]\npositions = [[100, 100], [200, 100]]\n"
        "[[balls]]\nradius = 10\nposition = [395, 100]\n"
        "[[balls]]\nradius = 10\nmas = 2\npositions = [[20, 20], [200, 205]]\n"
        "[[walls]]\nfrom = [100, 200]\nto = [300, 200]\n"
        '[[expect]]\nat = 1\nball = 5\nposition = [1, 1]\ntolerance = 1\nbecause = "a law"\n'
        '[[expect]]\nat = 3\nmomentum = [0, 0]\ntolerance = 1\nbecause = "a law"\n'
    )
    in_wall = "puts a ball into wall 0: its centre must be at least 12 px from the wall's centre line"
    assert errors(text) == [
        "2: gravity must be a list in brackets, such as [0, 900], got 900",
        "8: balls[0].positions cannot be combined with position; keep one of them",
        "11: balls[1].position puts a ball outside the arena: x must be from 10 to 390, got 395",
        f"14: balls[2].mas {NO_KEY}; did you mean mass?",
        f"15: balls[2].positions[1] {in_wall}, got 5 (or allow it with overlap in [arena])",
        "21: expect[0].ball must be at most 4, got 5",
        "26: expect[1].at must be at most 2, the seconds of the run, got 3",
    ]


KNOWN = "about, arena, balls, expect, gravity, pegs, pymunk, rate, seconds, seed, title, topic, units, walls"
ALL_KEYS = {
    f"1: radius {NO_KEY}; known are {KNOWN}": "radius = 1\n" + balls(BALL),
    f"9: walls[0].start {NO_KEY}; known are elasticity, friction, from, joined, thickness, to": balls(
        BALL, more="[[walls]]\nfrom = [1, 1]\nto = [9, 9]\nstart = [1, 1]\n"
    ),
    f"5: balls[0].x.width {NO_KEY}; known are from, step, to": balls(
        "radius = 5\nx = { from = 9, to = 9, width = 1 }\ny = { from = 9, to = 9 }"
    ),
}


@pytest.mark.parametrize(("message", "text"), ALL_KEYS.items(), ids=ALL_KEYS)
def test_an_unknown_key_like_no_other_is_reported_with_the_known_ones(text: str, message: str) -> None:
    assert errors(text) == [message]


PLACED = {
    "3: balls[0] needs a placement: position, positions, x and y, inside, or grid with spacing": "radius = 5",
    "5: balls[0].x must be given together with y": "radius = 5\nx = { from = 9, to = 9 }",
    "5: balls[0].grid must be given together with spacing": "radius = 5\ngrid = [2, 2]",
    "6: balls[0].speed cannot be combined with velocity; keep one of them": f"{BALL}\nspeed = 4\nvelocity = [1, 1]",
    "7: balls[0].count must be at most 4, the number of places in grid, got 5": (
        "radius = 5\ngrid = [2, 2]\nspacing = 20\ncount = 5"
    ),
    "5: balls[0].x puts a ball outside the arena: x must be from 5 to 795, got 796": (
        "radius = 5\nx = { from = 9, to = 796, step = 1 }\ny = { from = 9, to = 9 }"
    ),
    "5: balls[0].grid puts a ball outside the arena: y must be from 5 to 595, got 0": (
        "radius = 5\ngrid = [2, 61]\nspacing = 10"
    ),
    "7: balls[0].position puts a ball outside the arena: x must be from 5 to 795, got 796": (
        "radius = 5\ngrid = [2, 1]\nspacing = 10\nposition = [786, 9]"
    ),
    "5: balls[0].inside puts a ball outside the arena: x must be from 5 to 795, got 4": (
        "radius = 5\ninside = [[-1, 0], [50, 50]]"
    ),
    "5: balls[0].inside is smaller than one ball, which is 10 wide": "radius = 5\ninside = [[0, 0], [9, 50]]",
    "4: balls[0].radius 301 is too large for an arena of 800 x 600": "radius = 301\nposition = [301, 301]",
    "6: balls[0].count must be 2, the number of places in positions, got 3": (
        "radius = 5\npositions = [[9, 9], [99, 99]]\ncount = 3"
    ),
    "5: balls[0].positions must have at least 1 entries, got 0": "radius = 5\npositions = []",
    "5: balls[0].positions puts a ball outside the arena: y must be from 5 to 595, got 599": (
        "radius = 5\npositions = [[9, 9], [99, 599]]"
    ),
    "7: balls[0].velocities must have one entry per ball, 3, got 2": (
        "radius = 5\ngrid = [3, 1]\nspacing = 20\nvelocities = [[1, 2], [3, 4]]"
    ),
    "6: balls[0].vx is empty: from 2 is greater than to 1": f"{BALL}\nvx = {{ from = 2, to = 1 }}",
    "6: balls[0].vx is empty: steps of -2 from 1 never reach 9": f"{BALL}\nvx = {{ from = 1, to = 9, step = -2 }}",
    "6: balls[0].vx.to is not reached in steps of 3 from 1; write 7": f"{BALL}\nvx = {{ from = 1, to = 9, step = 3 }}",
    "6: balls[0].vx must have whole numbers as from, to and step": f"{BALL}\nvx = {{ from = 1, to = 2, step = 0.5 }}",
    "6: balls[0].vx.to is missing": f"{BALL}\nvx = {{ from = 1 }}",
    "6: balls[0].vx must be a table of keys, got 3": f"{BALL}\nvx = 3",
    "6: balls[0].elasticity must be at most 1, got 1.5": f"{BALL}\nelasticity = 1.5",
    "6: balls[0].colors must contain at least one colour": f"{BALL}\ncolors = []",
    "4: balls[0].radius must be a number, got true": "radius = true\nposition = [9, 9]",
    "5: balls[0].position must have at most 2 entries, got 3": "radius = 5\nposition = [9, 9, 9]",
    "6: balls[0].filter.categories must have at most 32 bits, got 0x100000000": (
        "radius = 5\nposition = [9, 9]\nfilter = { categories = 0x1_0000_0000 }"
    ),
    "5: balls[0].position must be a list of two, got [9]": "radius = 5\nposition = [9]",
}


@pytest.mark.parametrize(("message", "group"), PLACED.items(), ids=PLACED)
def test_errors_in_a_group(group: str, message: str) -> None:
    assert errors(balls(group)) == [message]


EXPECTED = {
    "nothing": (
        "",
        "[0] must contain position, velocity, spin, energy_ratio, momentum, centre_of_mass, overlap or columns",
        6,
    ),
    "whose": ("position = [1, 1]", "[0].ball is missing; position, velocity and spin are those of one ball", 6),
    "of-all-balls": (
        "ball = 0\nenergy_ratio = 1",
        "[0].ball requires position, velocity or spin; energy_ratio is of all balls",
        10,
    ),
    "no-column": (
        "columns = { from = 9, to = 9, shares = [1] }",
        "[0].columns.to must be greater than from, 9, got 9",
        10,
    ),
    "no-share": (
        "columns = { from = 0, to = 9, shares = [0, 0] }",
        "[0].columns.shares must contain a number greater than 0",
        10,
    ),
    "no-such-ball": ("ball = 1\nvelocity = [1, 1]", "[0].ball must be at most 0, got 1", 10),
}  # fmt: skip


@pytest.mark.parametrize(("keys", "message", "line"), EXPECTED.values(), ids=EXPECTED)
def test_errors_in_an_expectation(keys: str, message: str, line: int) -> None:
    text = balls(BALL, more=f'[[expect]]\nat = 1\ntolerance = 1\nbecause = "a law"\n{keys}\n')
    assert errors(text) == [f"{line}: expect{message}"]


def test_both_entries_of_an_empty_pair_are_one_error() -> None:
    assert errors("[arena]\nsize = []\n[[balls]]\n" + BALL) == ["2: arena.size must be a list of two, got []"]


@pytest.mark.parametrize("key", ["\\u001b[31m", "a\\nb"], ids=["escape", "newline"])
def test_a_message_is_printable_and_on_one_line(key: str) -> None:
    (message,) = errors(balls(f'{BALL}\n"{key}" = 1'))
    assert message.isprintable()


def test_a_long_key_is_cut_off_in_the_message() -> None:
    (message,) = errors(balls(f"{BALL}\n{'radius' * 100_000} = 1"))
    assert message.startswith(f'6: balls[0]."{"radius" * 6}... is not a key of ')


@pytest.mark.parametrize(
    ("value", "got"),
    [
        pytest.param("0x" + "f" * 5000, "0x" + "f" * 35 + "...", id="number-too-long-for-decimals"),
        pytest.param("9" * 4000, "9" * 37 + "...", id="4000-digits"),
        pytest.param('"NaN Infinity"', '"NaN Infinity"', id="text-like-a-number"),
        pytest.param("[nan, -inf, 0.5, true]", "[nan, -inf, 0.5, true]", id="list"),
        pytest.param('{ a = { b = [] }, "c d" = "e" }', '{"a": {"b": []}, "c d": "e"}', id="table"),
        pytest.param("1979-05-27", '"1979-05-27"', id="date"),
    ],
)
def test_values_are_shortened_in_messages(value: str, got: str) -> None:
    assert errors(balls(f"{BALL}\nmass = {value}")) == [f"6: balls[0].mass must be a number, got {got}"]


def test_what_is_nested_too_deeply_is_an_error() -> None:
    assert errors("a = " + "[" * 1000) == [" is nested too deeply, or contains a number with too many digits"]
    (message,) = errors(balls(f"{BALL}\nmass{'.a' * 1000} = 1"))
    assert message.startswith("6: balls[0].mass must be a number, got <dict")


def test_dots_and_brackets_in_text_are_not_nesting() -> None:
    dots = ".a" * 40 + "[{" * 40
    scene = parse(f"about = \"{dots}\"\ntitle = '''\n{dots[60:]}'''  # {dots}\n{balls(BALL)}", "mine.toml")
    assert (scene.about, scene.title) == (dots, dots[60:])


def open_arena(ball: str, walls: str = "false") -> str:
    return f"[arena]\nsize = [800, 600]\nwalls = {walls}\n[[balls]]\n{ball}\n"


@pytest.mark.parametrize(
    "ball",
    [
        "radius = 5\nposition = [-5000, 300]",
        "radius = 5\npositions = [[10, 10], [10, 9000]]",
        "radius = 5\ngrid = [50, 2]\nspacing = 40",
        "radius = 900\nposition = [0, 0]",
    ],
    ids=["position", "positions", "grid", "larger-than-the-view"],
)
def test_without_walls_a_ball_may_be_outside_the_arena(ball: str) -> None:
    assert len(parse(open_arena(ball), "open.toml").bodies) > 0
    with pytest.raises(SandboxError, match=r"outside the arena|too large"):
        parse(open_arena(ball, walls="true"), "closed.toml")


def test_without_walls_balls_at_random_are_inside_the_arena_all_the_same() -> None:
    with pytest.raises(
        SandboxError, match=r"balls\[0\]\.inside puts a ball outside the arena: x must be from 5 to 795"
    ):
        parse(open_arena("radius = 5\ninside = [[0, 0], [900, 600]]"), "open.toml")


def test_walls_must_be_true_or_false() -> None:
    with pytest.raises(SandboxError, match=r'arena\.walls must be true or false, got "no"'):
        parse(open_arena(BALL, walls='"no"'), "open.toml")


def test_of_very_many_errors_the_first_hundred_are_reported() -> None:
    found = errors(balls(BALL, *["radius = 0\ngrid = [1, 1]\nspacing = 1"] * 200))
    assert found[:2] == [
        "7: balls[1].radius must be greater than 0, got 0",
        "11: balls[2].radius must be greater than 0, got 0",
    ]
    assert len(found) == 101
    assert found[100] == " has more than these 100 errors"


@pytest.mark.parametrize("end", ["\r\n", "\r\r\n"])
def test_lines_of_a_file_from_windows(end: str) -> None:
    text = balls("radius = -5\nposition = [100, 100]").replace("\n", end)
    assert errors(text) == ["4: balls[0].radius must be greater than 0, got -5"]


def test_line_of_every_kind_of_key() -> None:
    text = (
        'about = """one\n[[balls]]\ntwo"""  # [[balls]]\n'
        "arena.size = [\n  800,  # ]\n  600,\n]\n"
        "[[balls]]\n'radius' = 5\nx.from = 1\nx.to = 2\n"
        '[[balls]]\n[balls.y]\nto = \'# not a comment\'\nfrom = "\\"["\n'
    )
    lines = lines_of_keys(text)
    assert lines == {
        ("about",): 1,
        ("arena",): 4,
        ("arena", "size"): 4,
        ("balls", 0): 8,
        ("balls", 0, "radius"): 9,
        ("balls", 0, "x"): 10,
        ("balls", 0, "x", "from"): 10,
        ("balls", 0, "x", "to"): 11,
        ("balls", 1): 12,
        ("balls", 1, "y"): 13,
        ("balls", 1, "y", "to"): 14,
        ("balls", 1, "y", "from"): 15,
    }
    assert line_of(("balls", 1, "radius"), lines) == 12
    assert line_of(("walls", 0), lines) is None


# --- Limits ----------------------------------------------------------------------------------------------------

ANYWHERE = "x = { from = 9, to = 9 }\ny = { from = 9, to = 9 }"


def test_two_hundred_thousand_balls_are_allowed() -> None:
    scene = parse(balls(*[f"radius = 1\ncount = {MAX_BALLS // 2}\n{ANYWHERE}"] * 2), "mine.toml")
    assert MAX_BALLS == 200_000
    assert len(scene.bodies) == MAX_BALLS


def test_one_more_is_an_error() -> None:
    one, rest = (f"radius = 1\ncount = {count}\n{ANYWHERE}" for count in (1, MAX_BALLS))
    assert errors(balls(rest.replace("200000", "200001"))) == ["5: balls[0].count must be at most 200000, got 200001"]
    (message,) = errors(balls(one, rest))
    assert message.endswith("balls must contain at most 200000 balls in all, got 200001")


@pytest.mark.parametrize(
    "group",
    [
        pytest.param("radius = 1e-300\ncount = 2\ninside = [[0, 0], [800, 600]]", id="radius-whose-square-is-0"),
        pytest.param(f"{BALL}\nvelocity = [1.7e308, 0]\n", id="velocity-times-rate"),
        pytest.param(f"{BALL}\nvx = {{ from = -1e308, to = 1e308 }}", id="range-wider-than-a-number"),
        pytest.param(f"{BALL}\nvx = {{ from = -1e308, to = 1e308, step = 1 }}", id="steps-beyond-a-number"),
    ],
)
@pytest.mark.filterwarnings("default")
def test_extreme_numbers_cause_no_traceback(command: Command, tmp_path: Path, group: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(balls(group))
    code, out, err = command("check", file)
    assert code in (0, 2)
    assert max(map(len, (out + err).splitlines())) < 300 + len(str(file))
    assert not re.search(r"\b(nan|RuntimeWarning)\b", out + err)


@pytest.mark.parametrize(
    "line", [f"rate = {10**400}", "[pymunk]\niterations = 99999999999999999999", "seconds = 1e300"]
)
def test_a_run_too_large_for_any_machine_is_an_error(command: Command, tmp_path: Path, line: str) -> None:
    top, table = ("", line) if line.startswith("[") else (line, "")
    file = tmp_path / "mine.toml"
    file.write_text(f"{top}\n{balls(BALL)}{table}\n")
    steps = [] if line.startswith("seconds") else ["--steps", 1]
    code, _, err = command("trace", file, "--engine", "pymunk", *steps)
    assert code == 2
    assert str(file) in err


# --- Broken files, through the command -------------------------------------------------------------------------

BROKEN: dict[str, str | bytes] = {
    ":3: is not valid TOML: Expected ']]' at the end of an array declaration": ARENA + "[[balls]\n",
    ": arena is missing\n{file}: balls is missing": "",
    ": is larger than 2,000,000 bytes": b"#" * 10_000_000,
    ":3: is not UTF-8 text: byte 0xff": b'[arena]\nsize = [8, 6]\ntitle = "\xff"\n',
    ":1: is not valid TOML: Expected '=' after a key in a key/value pair": "t = 3".encode("utf-16-le"),
    ":6: balls[0].radius is given twice, first in line 4": balls(f"{BALL}\nradius = 6"),
    ":8: units is given twice, first in line 6": balls(BALL, more="[units]\nlength = 'px'\n[units]\n"),
    ':6: balls[0].colors[0] is not a valid colour: "rde"; did you mean red?': balls(f'{BALL}\ncolors = ["rde"]'),
    ":9: walls[0].thickness must be greater than 0 where to is the same point as from": balls(
        BALL, more="[[walls]]\nfrom = [5, 5]\nto = [5, 5]\nthickness = 0\n"
    ),
    ":9: walls[0].joined requires that from and to are not the same point": balls(
        BALL, more="[[walls]]\nfrom = [5, 5]\nto = [5, 5]\njoined = true\n"
    ),
    """:5: balls[0].position puts a ball into wall 1: its centre must be at least 10 px from the peg's centre, \
got 4 (or allow it with overlap in [arena])""": balls(
        BALL, more="[[pegs]]\nradius = 5\npositions = [[700, 500], [104, 100]]\n"
    ),
    ":3000: pegs and walls must be at most 1000 together, got 1001": balls(
        BALL,
        more="[[walls]]\nfrom = [5, 5]\nto = [5, 9]\n" * 998 + f"[[pegs]]\nradius = 1\npositions = {[[300, 9]] * 3}\n",
    ),
    ": is nested too deeply, or contains a number with too many digits": "a = " + "[" * 20_000 + "]" * 20_000,
    ":6: is not valid TOML: Illegal character '\\x00'": balls(BALL, more='title = "\0"\n'),
}


@pytest.mark.parametrize(("message", "content"), BROKEN.items(), ids=BROKEN)
def test_a_broken_scene_is_one_clear_message(
    command: Command, tmp_path: Path, content: str | bytes, message: str
) -> None:
    file = tmp_path / "broken.toml"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    code, out, err = command("check", file)
    assert (code, out, err) == (2, "", f"{file}{message.replace('{file}', str(file))}\n")


def make_link(path: Path) -> None:
    path.symlink_to(path)


UNREADABLE: dict[str, Callable[[Path], object]] = {
    "cannot be read: No such file or directory": Path,
    "cannot be read: Too many levels of symbolic links": make_link,
    "is larger than 2,000,000 bytes": lambda path: path.symlink_to("/dev/zero"),
}


@pytest.mark.parametrize(("message", "make"), UNREADABLE.items(), ids=UNREADABLE)
def test_a_file_that_cannot_be_read(
    make: Callable[[Path], object], message: str, command: Command, tmp_path: Path
) -> None:
    file = tmp_path / "mine.toml"
    make(file)
    assert command("check", file) == (2, "", f"{file}: {message}\n")


def test_a_name_too_long_for_a_file(command: Command) -> None:
    code, _, err = command("check", "x" * 5000)
    assert code == 2
    assert len(err.splitlines()) == 1


def test_check_continues_after_an_error(command: Command, tmp_path: Path) -> None:
    good, bad = tmp_path / "good.toml", tmp_path / "bad.toml"
    good.write_text(balls(BALL, BALL))
    bad.write_text("[arena\n")
    code, out, err = command("check", bad, good, tmp_path)
    assert code == 2
    warning = f"{good}: warning: 1 overlap at the start, the deepest of balls 0 and 1 by 10 px\n"
    assert out == f"{good}: 2 balls, no errors\n{warning}"
    assert err == (
        f"{bad}:1: is not valid TOML: Expected ']' at the end of a table declaration\n"
        f"{tmp_path}: cannot be read: Is a directory\n"
    )


# --- Schema and bundled scenes ---------------------------------------------------------------------------------

FOLDER = Path(__file__).parents[2] / "scenes"


def test_the_schema_in_the_checkout_is_the_models(command: Command) -> None:
    committed = (FOLDER / "scene.schema.json").read_text()
    assert json.loads(committed) == schema()
    assert command("schema") == (0, committed, "")


def _taplo(*files: Path) -> subprocess.CompletedProcess[str]:
    program = shutil.which("taplo", path=str(Path(sys.executable).parent)) or shutil.which("taplo")
    if program is None:
        require("taplo")
    assert program is not None
    return subprocess.run([program, "check", *files], capture_output=True, text=True, check=False, timeout=60)


def test_taplo_accepts_the_bundled_scenes() -> None:
    files = list(FOLDER.glob("*.toml"))
    assert len(files) >= 10
    ran = _taplo(*files)
    assert ran.returncode == 0, ran.stderr
    assert f"found files total={len(files)} " in ran.stderr


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        pytest.param("radius = 20", "radios = 20", "('radios' was unexpected)", id="unknown-key"),
        pytest.param("radius = 20", "radius = -20", "-20 is less than or equal to the minimum of 0", id="negative"),
    ],
)
def test_taplo_rejects_a_broken_scene(tmp_path: Path, old: str, new: str, message: str) -> None:
    shutil.copy(FOLDER / "scene.schema.json", tmp_path)
    text = (FOLDER / "article.toml").read_text()
    assert old in text
    file = tmp_path / "broken.toml"
    file.write_text(text.replace(old, new))
    ran = _taplo(file)
    assert ran.returncode != 0
    assert message in ran.stderr


@pytest.mark.parametrize("name", bundled() or [pytest.param("none", marks=pytest.mark.xfail(strict=True))])
def test_a_bundled_scene(name: str) -> None:
    scene = load(name)
    assert scene.name == name
    assert scene.title
    assert scene.about.endswith(".")
    assert bundled()[name].read_text().startswith("#:schema ./scene.schema.json\n")
    initial = spawn(scene)
    assert len(initial.position) == len(scene.bodies) == len(scene.colors)
    assert list(warnings(scene, initial)) == []
