"""What is shown over balls is where the numbers say."""

import numpy as np
import pygame
import pytest
from conftest import scene_of
from pygame import Color, Surface

from sandbox.run.lockstep import Lockstep
from sandbox.scene.files import load
from sandbox.scene.model import Scene, rgb
from sandbox.scene.spawn import spawn
from sandbox.state import CONTACT, State
from sandbox.view.overlay import ARROW, SPARK, SPARKS, TRAIL, Overlay, RecentContacts, Trail, ball_at, round_up
from sandbox.view.palette import palette, paper
from sandbox.view.primitives import lettering

BLUE = "#0072b2"
GREY = (128, 128, 128)


@pytest.fixture
def scene() -> Scene:
    light = f'radius = 20\nmass = 1\nposition = [200, 300]\nvelocity = [300, -150]\ncolors = ["{BLUE}"]'
    return scene_of(light, "radius = 20\nmass = 3\nposition = [600, 300]\nvelocity = [0, 100]")


def overlay_of(scene: Scene, scale: float = 1.0) -> Overlay:
    surface = Surface((round(800 * scale), round(600 * scale)))
    surface.fill(GREY)
    return Overlay(surface, scene, scale, 16)


def drawn(overlay: Overlay) -> pygame.Rect:
    """Return the smallest rectangle with all that was drawn on grey."""
    x, y = np.nonzero((pygame.surfarray.array3d(overlay.surface) != GREY).any(axis=2))
    return pygame.Rect(int(x.min()), int(y.min()), int(np.ptp(x)) + 1, int(np.ptp(y)) + 1)


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0])
def test_a_velocity_s_arrow_goes_from_the_ball_to_where_it_would_be(scale: float) -> None:
    scene = scene_of("radius = 20\nposition = [200, 300]\nvelocity = [300, -150]")
    overlay = overlay_of(scene, scale)
    overlay.velocity(spawn(scene))
    box = drawn(overlay)
    assert box.bottomleft == pytest.approx((200 * scale, 300 * scale), abs=2)
    assert box.topright == pytest.approx(((200 + 300 * ARROW) * scale, (300 - 150 * ARROW) * scale), abs=2)
    middle = round((200 + 150 * ARROW) * scale), round((300 - 75 * ARROW) * scale)
    assert overlay.surface.get_at(middle) == Color("black")


def test_an_arrow_of_momentum_is_longer_for_a_heavier_ball(scene: Scene) -> None:
    overlay = overlay_of(scene)
    overlay.momentum(spawn(scene))
    colour = palette("white").momentum
    heavy = overlay.surface.subsurface((500, 200, 200, 300))
    rows = [y for y in range(300) if any(heavy.get_at((x, y)) == colour for x in range(80, 120))]
    assert max(rows) + 200 == pytest.approx(300 + 100 * 3 / 2 * ARROW, abs=2)
    assert heavy.get_at((100, 105)) == colour


def test_what_does_not_move_has_no_arrow() -> None:
    scene = scene_of("radius = 20\nposition = [200, 300]")
    overlay = overlay_of(scene)
    overlay.velocity(spawn(scene))
    overlay.momentum(spawn(scene))
    assert (pygame.surfarray.array3d(overlay.surface) == GREY).all()


def state_at(time: float, x: float) -> State:
    return State(time, np.array([[x, 100.0]]), np.zeros((1, 2)))


def test_a_trail_keeps_the_latest_places_and_forgets_what_is_undone() -> None:
    trail = Trail(1)
    for step in range(TRAIL + 10):
        trail.add(state_at(step / 60, step))
    assert trail.places()[:, 0, 0].tolist() == list(range(10, TRAIL + 10))
    trail.add(state_at((TRAIL + 5) / 60, -1))  # gone back, and on another way
    assert trail.places()[-2:, 0, 0].tolist() == [TRAIL + 4, -1]
    trail.add(state_at(1e3, 7))  # nobody looked for long
    assert trail.places()[:, 0, 0].tolist() == [7]


def test_trails_of_many_balls_take_no_more_memory_than_those_of_few() -> None:
    trail = Trail(5_000)
    for step in range(100):
        trail.add(State(step / 60, np.zeros((5_000, 2)), np.zeros((5_000, 2))))
    assert trail.places().shape == (4, 5_000, 2)


def test_a_trail_runs_through_its_places_and_fades_to_the_past() -> None:
    scene = scene_of(f'radius = 5\nposition = [100, 100]\ncolors = ["{BLUE}"]')
    overlay = overlay_of(scene)
    places = np.array([[[float(x), 100.0]] for x in range(100, 501, 100)] + [[[500.0, 300.0]]])
    overlay.trails(places)
    assert overlay.surface.get_at((500, 299)) == Color(BLUE)
    assert drawn(overlay).topleft == (100, 100)
    assert drawn(overlay).bottomright == pytest.approx((501, 301), abs=2)
    ground = Color("white")
    away = [abs(overlay.surface.get_at(at).r - ground.r) for at in ((110, 100), (310, 100), (500, 250))]
    assert 0 < away[0] < away[1] < away[2]


def contacts_of(*rows: tuple[float, int, int, tuple[float, float], float]) -> np.ndarray:
    return np.array([(*row, 0.0) for row in rows], CONTACT)


def test_a_contact_is_where_the_ball_touched_when_it_did() -> None:
    sparks = RecentContacts(np.array([20.0]))
    state = State(1.0, np.array([[90.0, 300.0]]), np.array([[-100.0, 0.0]]))  # it has flown 0.1 s since
    sparks.add(contacts_of((0.9, 0, -3, (1.0, 0.0), 5.0)), state)
    assert sparks.latest()["point"].tolist() == [[120.0, 300.0]]
    assert sparks.latest()["impulse"].tolist() == [5.0]
    sparks.add(contacts_of(), State(0.9 + SPARK + 0.01, state.position, state.velocity))
    assert len(sparks.latest()) == 0


def test_a_contact_without_an_impulse_is_a_dot() -> None:
    surface = pygame.Surface((800, 600))
    overlay = Overlay(surface, scene_of("radius = 20\nposition = [200, 300]"), 1.0, 20)
    surface.fill("white")
    sparks = RecentContacts(overlay.scene.bodies.radius)
    sparks.add(contacts_of((0.0, 0, -1, (0.0, 1.0), -0.0)), State(0.0, np.array([[200.0, 300.0]]), np.zeros((1, 2))))
    overlay.contacts(sparks.latest(), 0.0)
    assert surface.get_at((200, 320)) == overlay.palette.contact


def test_contacts_after_a_step_back_are_forgotten_and_many_are_not_kept() -> None:
    sparks = RecentContacts(np.array([20.0]))
    state = State(1.0, np.zeros((1, 2)), np.zeros((1, 2)))
    sparks.add(contacts_of(*[(1.0, 0, -1, (1.0, 0.0), float(k)) for k in range(3 * SPARKS)]), state)
    assert sparks.latest()["impulse"].tolist() == list(range(2 * SPARKS, 3 * SPARKS))
    sparks.add(contacts_of(), State(0.99, state.position, state.velocity))
    assert len(sparks.latest()) == 0


@pytest.mark.parametrize("engine", ["pymunk", "impulse", "exact"])
def test_the_contact_of_a_head_on_collision_is_between_the_balls(engine: str) -> None:
    scene = load("head-on")
    lockstep = Lockstep(scene, [engine])
    lockstep.engines[engine].contacts()
    sparks = RecentContacts(scene.bodies.radius)
    while not len(sparks.latest()):
        lockstep.step()
        sparks.add(lockstep.engines[engine].contacts(), lockstep.states()[engine])
    [spark] = sparks.latest()
    (left, right), (u, v) = lockstep.initial.position[:, 0], lockstep.initial.velocity[:, 0]
    radius, approach = scene.bodies.radius[0], u - v
    meet = left + radius + u * (right - left - 2 * radius) / approach
    late = {"pymunk": 7, "impulse": 7, "exact": 1e-9}[engine]  # px that a ball goes in a step
    assert spark["point"] == pytest.approx([meet, 300], abs=late)
    assert spark["impulse"] == pytest.approx(approach * 1 * 1 / (1 + 1) * 2, rel=1e-6)  # equal masses, e = 1


def test_a_contact_is_drawn_along_its_normal_with_its_impulse() -> None:
    scene = scene_of("radius = 20\nposition = [200, 300]")
    overlay = overlay_of(scene)
    sparks = RecentContacts(np.array([20.0]))
    sparks.add(contacts_of((0.0, 0, -1, (0.0, 1.0), 250.0)), State(0.0, np.array([[200.0, 300.0]]), np.zeros((1, 2))))
    overlay.contacts(sparks.latest(), 0.0)
    colour = palette("white").contact
    assert [overlay.surface.get_at((200, y)) == colour for y in (280, 300, 320, 340, 360)] == [0, 1, 1, 1, 0]
    number = lettering("250", Color("black"), 13)
    place = number.get_rect(midleft=(200 + 3 * overlay.width + 2, 320))
    expected = Surface(place.size)
    expected.fill(GREY)
    expected.blit(number, (0, 0))
    shown = pygame.surfarray.array3d(overlay.surface.subsurface(place))
    ink = pygame.surfarray.array3d(expected)
    assert np.array_equal(shown[4:], ink[4:])  # of the dot, some is behind


def test_the_centre_of_mass_is_nearer_to_the_heavier_ball(scene: Scene) -> None:
    overlay = overlay_of(scene)
    overlay.centre(spawn(scene))
    assert drawn(overlay).center == pytest.approx((500, 300), abs=1)
    quarters = [tuple(overlay.surface.get_at((500 + dx, 300 + dy)))[:3] for dx, dy in ((3, -3), (-4, -4))]
    assert quarters == [(0, 0, 0), (255, 255, 255)]


def test_balls_have_their_numbers_in_scene_order(scene: Scene) -> None:
    overlay = overlay_of(scene)
    overlay.numbers(spawn(scene))
    for number, x in enumerate((200, 600)):
        ink = lettering(str(number), Color("white" if number == 0 else "black"), 16)
        place = ink.get_rect(center=(x, 300))
        expected = Surface(place.size)
        expected.fill(GREY)
        expected.blit(ink, (0, 0))
        shown = overlay.surface.subsurface(place)
        assert np.array_equal(pygame.surfarray.array3d(shown), pygame.surfarray.array3d(expected))


@pytest.mark.parametrize(("scale", "cell"), [(1.0, 50), (0.3, 200), (3.0, 20)])
def test_the_grid_stands_at_round_places(scene: Scene, scale: float, cell: int) -> None:
    overlay = overlay_of(scene, scale)
    overlay.grid()
    faint = palette("white").faint
    low = round(590 * scale)  # below the numbers
    lines = [x for x in range(1, overlay.surface.get_width()) if overlay.surface.get_at((x, low)) == faint]
    assert [x for x in lines if x > 40] == [x for k in range(1, 800 // cell) if (x := round(k * cell * scale)) > 40]


def test_a_ball_is_found_by_its_edge_not_its_centre() -> None:
    state = State(0.0, np.array([[100.0, 100.0], [160.0, 100.0]]), np.zeros((2, 2)))
    assert ball_at(state, np.array([50.0, 5.0]), (145.0, 100.0)) == (0, -5.0)
    assert ball_at(state, np.array([50.0, 5.0]), (153.0, 100.0)) == (1, 2.0)


@pytest.mark.parametrize(("size", "up"), [(1, 1), (1.1, 2), (3, 5), (7, 10), (0.03, 0.05), (400, 500), (2e-7, 2e-7)])
def test_numbers_are_rounded_up_to_1_2_or_5(size: float, up: float) -> None:
    assert round_up(size) == pytest.approx(up, rel=1e-12)


def test_colours_stand_out_from_light_and_dark_and_no_two_engines_share_a_dash() -> None:
    def luminance(colour: Color) -> float:
        parts = [part / 255 for part in (colour.r, colour.g, colour.b)]
        red, green, blue = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue

    def against(a: Color, b: Color) -> float:
        low, high = sorted((luminance(a), luminance(b)))
        return (high + 0.05) / (low + 0.05)

    for background in ("white", "black", "#22262b", "#f5f5dc", "#14532d", "tomato"):
        on_paper = palette(paper(background))
        for line in on_paper.lines:
            assert against(line.colour, on_paper.ground) > 2.6
        colours = palette(background)
        ground = Color(*rgb(background))
        assert against(colours.ink, ground) > 7
        if background == "tomato":  # which no colour but black and white stands out from
            continue
        for colour in (colours.momentum, colours.contact):
            assert against(colour, ground) > 2.6
        assert len({line.dash for line in colours.lines}) == len({tuple(line.colour) for line in colours.lines}) == 5
        assert colours.line(7) == colours.line(2)
