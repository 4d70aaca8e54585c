"""Pendulums by elliptic functions, against DOP853 and the published periods; what is no pendulum has no form."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ellipk

from sandbox.measure.analytic import solution
from sandbox.measure.analytic.pendulum import Pendulum, Swing
from sandbox.scene.compile.scene import Scene
from tests.measure.analytic.oracle import form_of, integrated, motion_of, scene_of

G = 9.81
WORLD = "gravity = [0.0, -9.81]\nduration = 10.0"
TIME = np.linspace(0.0, 10.0, 201)
ROD = "[[joint]]\nkind = 'rod'\nbetween = ['bob']\nlength = 1.0\n"


def hung(degrees: float, rate: float = 0.0, joint: str = ROD, extra: str = "", world: str = WORLD) -> Scene:
    """A bob on a rod of 1 m, at an angle from straight down, turning at a rate."""
    x, y = math.sin(math.radians(degrees)), -math.cos(math.radians(degrees))
    bob = (
        f"[[ball]]\nname = 'bob'\nposition = [{x!r}, {y!r}]\nvelocity = [{-y * rate!r}, {x * rate!r}]\n"
        f"radius = 0.1\nmass = 2.0\ncollides = 'none'\n{extra}"
    )
    return scene_of(bob, joint, world=world)


def swing_of(scene: Scene) -> Swing:
    form = form_of(scene).alone[0]
    assert isinstance(form, Pendulum)
    return form.swing


@pytest.mark.parametrize(
    ("degrees", "rate"),
    [
        (5, 0.0),
        (90, 0.0),
        (170, 0.0),
        (-60, 2.0),
        (30, -4.0),
        (0, 6.0),
        (0, 6.5),
        (120, 8.0),
        (-100, -5.0),
        (179.9, 0.0),
    ],
)
def test_swing_is_dop853s(degrees: float, rate: float) -> None:
    right = integrated(lambda _, s: [s[1], -G * math.sin(s[0])], [math.radians(degrees), rate], TIME)
    found = motion_of(hung(degrees, rate), TIME)
    expected = np.array([np.sin(right[0]), -np.cos(right[0])]).T
    # The oracle's 1e-13 a step, and near the top e^(√g t) of growth until it has fallen: at 179.9° 7e5-fold.
    tolerance = 1e-7 if degrees == 179.9 else 2e-10
    assert found.position == pytest.approx(expected, abs=tolerance)
    assert found.velocity == pytest.approx(
        right[1][:, None] * np.column_stack((np.cos(right[0]), np.sin(right[0]))), abs=10 * tolerance
    )  # at up to 10 /s


@pytest.mark.parametrize(("degrees", "period"), [(5, 2.0070219), (90, 2.3678419), (170, 4.8935243)])
def test_period_is_the_published_one(degrees: float, period: float) -> None:
    found = swing_of(hung(degrees)).period
    assert found == pytest.approx(period, abs=6e-8)  # given to seven decimals
    exact = 4.0 / math.sqrt(G) * ellipk(math.sin(math.radians(degrees) / 2) ** 2)
    assert found == pytest.approx(exact, rel=1e-14)  # scipy rounds its parameter, too


def _sound(rate: float) -> float:
    """Return a rate, or 0 for one whose components are so small that doubles no longer hold their ratio."""
    return rate if abs(rate) > 1e-290 else 0.0


@given(degrees=st.floats(-179.0, 179.0), rate=st.floats(-12.0, 12.0).map(_sound))
def test_energy_and_length_stay(degrees: float, rate: float) -> None:
    found = motion_of(hung(degrees, rate), TIME)
    energy = 0.5 * (found.velocity**2).sum(axis=1) + G * found.position[:, 1]
    assert energy == pytest.approx(np.full(len(TIME), energy[0]), abs=2e-11)  # 1e-13 of phase, of up to 90 J/kg
    assert np.hypot(*found.position.T) == pytest.approx(np.ones(len(TIME)), abs=1e-15)  # the rounding of a sine


def test_pendulum_is_back_after_a_period_whether_it_swings_or_turns_over() -> None:
    for scene in (hung(70, 1.0), hung(70, 9.0), hung(70, -9.0)):
        period = swing_of(scene).period
        found = motion_of(scene, np.array([0.0, period, 3.0 * period]))
        assert found.position == pytest.approx(np.repeat(found.position[:1], 3, axis=0), abs=1e-13)  # roundings


def test_pendulum_at_its_top_and_at_its_bottom_stays() -> None:
    for y in (1.0, -1.0):
        scene = scene_of(
            f"[[ball]]\nname = 'bob'\nposition = [0.0, {y}]\nradius = 0.1\ncollides = 'none'\n", ROD, world=WORLD
        )
        found = motion_of(scene, TIME)
        assert found.position == pytest.approx(np.tile([0.0, y], (len(TIME), 1)), abs=2e-16)  # cos(π/2) is 6e-17
        assert not found.velocity.any()


def test_pendulum_without_gravity_goes_round_evenly() -> None:
    found = motion_of(hung(90, 2.0, world="duration = 10.0"), TIME)
    assert found.position == pytest.approx(
        np.column_stack((np.cos(2 * TIME), np.sin(2 * TIME))), abs=1e-14
    )  # of 20 rad


def test_plank_on_a_pivot_swings_by_its_moment_and_turns_with_it() -> None:
    plank = (
        "[[box]]\nname = 'plank'\nposition = [0.5, 0.0]\nsize = [1.0, 0.2]\nmass = 3.0\ncollides = 'none'\n"
        "[[joint]]\nkind = 'pivot'\nbetween = ['plank']\nat = [0.0, 0.0]\n"
    )
    found = motion_of(scene_of(plank, world=WORLD), TIME)
    squared = 3.0 * G * 0.5 / (3.0 * (1.0 + 0.04) / 12.0 + 3.0 * 0.25)
    right = integrated(lambda _, s: [s[1], -squared * math.sin(s[0])], [math.pi / 2, 0.0], TIME)
    assert found.angle == pytest.approx(right[0] - math.pi / 2, abs=1e-10)  # the oracle's 1e-13 a step
    assert found.spin == pytest.approx(right[1], abs=1e-9)  # likewise, times ω
    assert found.position == pytest.approx(0.5 * np.column_stack((np.cos(found.angle), np.sin(found.angle))), abs=1e-15)


def test_bob_keeps_the_spin_that_a_rod_at_its_centre_cannot_change() -> None:
    found = motion_of(hung(60, extra="angular_velocity = 3.0\n"), TIME)
    assert found.angle == pytest.approx(3.0 * TIME, abs=1e-14)  # one rounding of 30


@pytest.mark.parametrize(
    "scene",
    [
        hung(60, joint=ROD + ROD),
        hung(60, joint=ROD + "anchors = [[0.05, 0.0], [0.0, 0.0]]\n"),
        hung(60, joint=ROD.replace("1.0", "1.001")),
        hung(60, joint=ROD + "strength = 100.0\n"),
        hung(60, joint="[[joint]]\nkind = 'slide'\nbetween = ['bob']\nleast = 0.0\nmost = 1.0\n"),
        hung(60, world=WORLD + "\nlinear_drag = 0.1"),
        hung(60, world=WORLD + "\nquadratic_drag = 0.1"),
        hung(60, joint=ROD + "[[attraction]]\ntoward = [0.0, 5.0]\nstrength = 1.0\n"),
        hung(60, joint=ROD + "[[thrust]]\nbody = 'bob'\nforce = [1.0, 0.0]\n"),
        hung(60, joint=ROD + "[[ball]]\nposition = [3.0, 0.0]\nradius = 0.1\n[[joint]]\nkind = 'spring'\n"
             "between = ['bob', 'ball-2']\nstiffness = 1.0\n"),
    ],
    ids=["two rods", "off its centre", "too long", "may break", "string", "drag", "quadratic drag", "attraction",
         "thrust", "a spring to another"],
)  # fmt: skip
def test_what_is_no_pendulum_has_no_form(scene: Scene) -> None:
    assert solution(scene) is None


def test_bob_that_could_meet_something_or_pulls_at_its_rod_has_no_form() -> None:
    bob = "[[ball]]\nname = 'bob'\nposition = [1.0, 0.0]\nradius = 0.1\n"
    assert solution(scene_of(bob, ROD, world=WORLD)) is not None
    assert solution(scene_of(bob, ROD, "[[post]]\nposition = [0, -1]\nradius = 0.1\n", world=WORLD)) is None
    assert solution(scene_of(bob + "velocity = [0.01, 1.0]\n", ROD, world=WORLD)) is None
