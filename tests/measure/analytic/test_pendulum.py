"""Pendulums by elliptic functions against DOP853 and published periods, and scenes that are no pendulums."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.analytic import solution
from sandbox.measure.analytic.pendulum import Pendulum, Swing
from sandbox.scene.compile.scene import Scene
from tests.measure.analytic.oracle import integrated, motion_of, scene_of, solution_of

G = 9.81
WORLD = "gravity = [0.0, -9.81]\nduration = 10.0"
TIME = np.linspace(0.0, 10.0, 201)
ROD = "[[joint]]\nkind = 'rod'\nbetween = ['bob']\nlength = 1.0\n"


def pendulum_scene(degrees: float, rate: float = 0.0, joint: str = ROD, extra: str = "", world: str = WORLD) -> Scene:
    """Return a bob on a rod of 1 m, at an angle from straight down, rotating at a rate in rad/s."""
    x, y = math.sin(math.radians(degrees)), -math.cos(math.radians(degrees))
    bob = (
        f"[[ball]]\nname = 'bob'\nposition = [{x!r}, {y!r}]\nvelocity = [{-y * rate!r}, {x * rate!r}]\n"
        f"radius = 0.1\nmass = 2.0\ncollides = 'none'\n{extra}"
    )
    return scene_of(bob, joint, world=world)


def swing_of(scene: Scene) -> Swing:
    form = solution_of(scene).alone[0]
    assert isinstance(form, Pendulum)
    return form.swing


@pytest.mark.parametrize(
    ("degrees", "rate"),
    [
        (5, 0.0), (90, 0.0), (170, 0.0), (-60, 2.0), (30, -4.0), (0, 6.0), (0, 6.5), (120, 8.0), (-100, -5.0),
        (179.9, 0.0),
    ],
)  # fmt: skip
def test_pendulum_agrees_with_dop853(degrees: float, rate: float) -> None:
    solved = integrated(lambda _, s: [s[1], -G * math.sin(s[0])], [math.radians(degrees), rate], TIME)
    found = motion_of(pendulum_scene(degrees, rate), TIME)
    expected = np.array([np.sin(solved[0]), -np.cos(solved[0])]).T
    # DOP853 errs by 1e-13 a step; near the top errors grow by e^(√g t) until it has fallen: at 179.9° by 7e5.
    tolerance = 1e-7 if degrees == 179.9 else 2e-10
    assert found.position == pytest.approx(expected, abs=tolerance)
    assert found.velocity == pytest.approx(
        solved[1][:, None] * np.column_stack((np.cos(solved[0]), np.sin(solved[0]))), abs=10 * tolerance
    )  # at up to 10 rad/s


def _flush_tiny(rate: float) -> float:
    """Return the rate, or 0 if its components are so small that doubles do not preserve their ratio."""
    return rate if abs(rate) > 1e-290 else 0.0


@given(degrees=st.floats(-179.0, 179.0), rate=st.floats(-12.0, 12.0).map(_flush_tiny))
def test_pendulum_conserves_energy_and_length(degrees: float, rate: float) -> None:
    found = motion_of(pendulum_scene(degrees, rate), TIME)
    energy = 0.5 * (found.velocity**2).sum(axis=1) + G * found.position[:, 1]
    assert energy == pytest.approx(np.full(len(TIME), energy[0]), abs=2e-11)  # 1e-13 of phase, of up to 90 J/kg
    assert np.hypot(*found.position.T) == pytest.approx(np.ones(len(TIME)), abs=1e-15)  # rounding of a sine


def test_pendulum_returns_after_one_period_swinging_or_rotating() -> None:
    for scene in (pendulum_scene(70, 1.0), pendulum_scene(70, 9.0), pendulum_scene(70, -9.0)):
        period = swing_of(scene).period
        found = motion_of(scene, np.array([0.0, period, 3.0 * period]))
        assert found.position == pytest.approx(np.repeat(found.position[:1], 3, axis=0), abs=1e-13)  # roundings


def test_pendulum_at_rest_at_top_or_bottom_stays_at_rest() -> None:
    for y in (1.0, -1.0):
        scene = scene_of(
            f"[[ball]]\nname = 'bob'\nposition = [0.0, {y}]\nradius = 0.1\ncollides = 'none'\n", ROD, world=WORLD
        )
        found = motion_of(scene, TIME)
        assert found.position == pytest.approx(np.tile([0.0, y], (len(TIME), 1)), abs=2e-16)  # cos(π/2) is 6e-17
        assert not found.velocity.any()


def test_pendulum_without_gravity_rotates_uniformly() -> None:
    found = motion_of(pendulum_scene(90, 2.0, world="duration = 10.0"), TIME)
    # roundings of 20 rad
    assert found.position == pytest.approx(np.column_stack((np.cos(2 * TIME), np.sin(2 * TIME))), abs=1e-14)


def test_plank_on_a_pivot_swings_by_its_moment_of_inertia() -> None:
    plank = (
        "[[box]]\nname = 'plank'\nposition = [0.5, 0.0]\nsize = [1.0, 0.2]\nmass = 3.0\ncollides = 'none'\n"
        "[[joint]]\nkind = 'pivot'\nbetween = ['plank']\nat = [0.0, 0.0]\n"
    )
    found = motion_of(scene_of(plank, world=WORLD), TIME)
    squared = 3.0 * G * 0.5 / (3.0 * (1.0 + 0.04) / 12.0 + 3.0 * 0.25)
    solved = integrated(lambda _, s: [s[1], -squared * math.sin(s[0])], [math.pi / 2, 0.0], TIME)
    assert found.angle == pytest.approx(solved[0] - math.pi / 2, abs=1e-10)  # DOP853 errs by 1e-13 a step
    assert found.spin == pytest.approx(solved[1], abs=1e-9)  # likewise, times ω
    assert found.position == pytest.approx(0.5 * np.column_stack((np.cos(found.angle), np.sin(found.angle))), abs=1e-15)


def test_bob_on_a_rod_at_its_centre_keeps_its_spin() -> None:
    found = motion_of(pendulum_scene(60, extra="angular_velocity = 3.0\n"), TIME)
    assert found.angle == pytest.approx(3.0 * TIME, abs=1e-14)  # one rounding of 30


@pytest.mark.parametrize(
    "scene",
    [
        pendulum_scene(60, joint=ROD + ROD),
        pendulum_scene(60, joint=ROD + "anchors = [[0.05, 0.0], [0.0, 0.0]]\n"),
        pendulum_scene(60, joint=ROD.replace("1.0", "1.001")),
        pendulum_scene(60, joint=ROD + "strength = 100.0\n"),
        pendulum_scene(60, joint="[[joint]]\nkind = 'slide'\nbetween = ['bob']\nleast = 0.0\nmost = 1.0\n"),
        pendulum_scene(60, world=WORLD + "\nlinear_drag = 0.1"),
        pendulum_scene(60, world=WORLD + "\nquadratic_drag = 0.1"),
        pendulum_scene(60, joint=ROD + "[[attraction]]\ntoward = [0.0, 5.0]\nstrength = 1.0\n"),
        pendulum_scene(60, joint=ROD + "[[thrust]]\nbody = 'bob'\nforce = [1.0, 0.0]\n"),
        pendulum_scene(60, joint=ROD + "[[ball]]\nposition = [3.0, 0.0]\nradius = 0.1\n[[joint]]\nkind = 'spring'\n"
             "between = ['bob', 'ball-2']\nstiffness = 1.0\n"),
    ],
    ids=["two rods", "off its centre", "too long", "may break", "string", "drag", "quadratic drag", "attraction",
         "thrust", "a spring to another"],
)  # fmt: skip
def test_scene_that_is_no_pendulum_has_no_closed_form(scene: Scene) -> None:
    assert solution(scene) is None


def test_bob_that_may_collide_or_strains_its_rod_has_no_closed_form() -> None:
    bob = "[[ball]]\nname = 'bob'\nposition = [1.0, 0.0]\nradius = 0.1\n"
    assert solution(scene_of(bob, ROD, world=WORLD)) is not None
    assert solution(scene_of(bob, ROD, "[[post]]\nposition = [0, -1]\nradius = 0.1\n", world=WORLD)) is None
    assert solution(scene_of(bob + "velocity = [0.01, 1.0]\n", ROD, world=WORLD)) is None
