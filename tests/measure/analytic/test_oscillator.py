"""Springs in closed form, against DOP853; what is not truly linear has no form."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.analytic import solution
from sandbox.measure.analytic.oscillator import damped
from sandbox.scene.compile.scene import Scene
from tests.measure.analytic.oracle import integrated, motion_of, scene_of

TIME = np.linspace(0.0, 10.0, 101)


def sprung(
    position: str = "[1.3, 0.0]",
    velocity: str = "[0.0, 0.0]",
    rest: float = 1.0,
    stiffness: float = 8.0,
    damping: float = 0.0,
    world: str = "duration = 10.0",
    extra: str = "",
) -> Scene:
    """A body of 2 kg on a spring to the origin."""
    return scene_of(
        f"[[ball]]\nname = 'm'\nposition = {position}\nvelocity = {velocity}\nradius = 0.1\nmass = 2.0\n"
        f"angular_velocity = 0.5\n[[joint]]\nkind = 'spring'\nbetween = ['m']\nrest_length = {rest}\n"
        f"stiffness = {stiffness}\ndamping = {damping}\n{extra}",
        world=world,
    )


def law(rest: float, k: float, c: float, gravity: tuple[float, float], drag: float = 0.0, wind=(0.0, 0.0)):
    """The engines' own law, in two dimensions: F = −k (l − l₀) − c l̇ along the line."""

    def of(_: float, s: np.ndarray) -> list[float]:
        length = float(np.hypot(*s[:2]))
        n = s[:2] / length if length else np.zeros(2)
        a = -(k * (length - rest) + c * (s[2:] @ n)) / 2.0 * n + gravity - drag * (s[2:] - wind)
        return [*s[2:], *a]

    return of


@pytest.mark.parametrize("damping", [0.0, 1.0, 7.9999999, 8.0, 8.0000001, 30.0], ids=str)
def test_spring_with_a_damper_is_dop853s_on_both_sides_of_the_critical(damping: float) -> None:
    scene = sprung(velocity="[0.4, 0.0]", damping=damping)
    right = integrated(law(1.0, 8.0, damping, (0.0, 0.0)), [1.3, 0.0, 0.4, 0.0], TIME)
    found = motion_of(scene, TIME)
    assert np.column_stack((found.position, found.velocity)) == pytest.approx(right.T, abs=1e-11)  # 1e-13 a step
    assert found.angle == pytest.approx(0.5 * TIME, abs=1e-15)  # a spring at the centre turns nothing


def test_weight_on_a_spring_swings_about_where_it_would_hang_in_a_wind_from_below() -> None:
    world = "gravity = [0.0, -1.5]\nlinear_drag = 0.2\nwind = [0.0, 0.3]\nduration = 10.0"
    scene = sprung("[0.0, -1.2]", "[0.0, 0.5]", damping=0.3, world=world)
    right = integrated(law(1.0, 8.0, 0.3, (0.0, -1.5), 0.2, (0.0, 0.3)), [0.0, -1.2, 0.0, 0.5], TIME)
    found = motion_of(scene, TIME)
    assert np.column_stack((found.position, found.velocity)) == pytest.approx(right.T, abs=1e-11)  # 1e-13 a step


def test_spring_of_no_rest_length_swings_in_both_directions_at_once() -> None:
    world = "gravity = [0.3, -1.5]\nlinear_drag = 0.2\nduration = 10.0"
    scene = sprung("[1.0, 0.5]", "[-0.7, 0.5]", rest=0.0, world=world)
    right = integrated(law(0.0, 8.0, 0.0, (0.3, -1.5), 0.2), [1.0, 0.5, -0.7, 0.5], TIME)
    found = motion_of(scene, TIME)
    assert np.column_stack((found.position, found.velocity)) == pytest.approx(right.T, abs=1e-11)  # 1e-13 a step


def test_spring_to_a_fixed_body_that_is_turned_is_held_where_that_is() -> None:
    nail = (
        "[[box]]\nname = 'nail'\nposition = [0.0, 1.0]\nangle = 1.5707963267948966\nsize = [0.2, 0.2]\nfixed = true\n"
    )
    joint = "[[joint]]\nkind = 'spring'\nbetween = ['m', 'nail']\nanchors = [[0, 0], [0.1, 0]]\nstiffness = 2.0\n"
    ball = "[[ball]]\nname = 'm'\nposition = [0.0, 3.1]\nradius = 0.1\ncollides = 'none'\nvelocity = [0.0, 0.2]\n"
    found = motion_of(scene_of(ball, nail, joint), TIME)
    assert found.position[:, 1] - 3.1 == pytest.approx(0.2 / 2**0.5 * np.sin(2**0.5 * TIME), abs=1e-14)  # of 3 m


@given(squared=st.floats(1e-3, 1e7), damping=st.floats(0.0, 1e5))
def test_swing_satisfies_its_equation_at_the_start_and_never_grows(squared: float, damping: float) -> None:
    c, s = damped(np.array([0.0, 1.0, 1e3]), squared, damping)
    assert (c[0], s[0]) == (1.0, 0.0)
    # Energy of u = C: ω²C² + C'² with C' = −γC − … is at most what it began with; 1e-12 for rounding of large phases.
    u, rate = c + damping * s, -squared * s
    assert (squared * u**2 + rate**2 <= squared * (1.0 + 1e-12)).all()


@pytest.mark.parametrize(
    "scene",
    [
        sprung("[1.3, 0.1]", "[0.1, 0.0]"),
        sprung(velocity="[0.0, 0.1]"),
        sprung(world="gravity = [0.0, -1.0]\nduration = 10.0"),
        sprung("[2.1, 0.0]"),
        sprung("[1.0, 0.5]", "[0.3, 0.0]", rest=0.0, damping=0.1),
        sprung(world="quadratic_drag = 0.1\nduration = 10.0"),
        sprung(extra="anchors = [[0.05, 0.0], [0.0, 0.0]]\n"),
        sprung(extra="strength = 3.0\n"),
        sprung(extra="[[joint]]\nkind = 'spring'\nbetween = ['m']\nstiffness = 1.0\n"),
        sprung(extra="[[joint]]\nkind = 'rotary_spring'\nbetween = ['m']\nstiffness = 1.0\n"),
        sprung(extra="[[post]]\nposition = [9.0, 0.0]\nradius = 0.1\n"),
        sprung(extra="[[ball]]\nposition = [9.0, 0.0]\nradius = 0.1\n"),
    ],
    ids=["aside", "sideways", "gravity across", "through its anchor", "damped in the plane", "drag", "off its centre",
         "may break", "a second spring", "a rotary spring", "a post", "another ball"],
)  # fmt: skip
def test_what_is_not_linear_has_no_form(scene: Scene) -> None:
    assert solution(scene) is None
