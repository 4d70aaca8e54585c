"""Springs in closed form against DOP853, and nonlinear scenes without a closed form."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.analytic import solution
from sandbox.measure.analytic.oscillator import damped
from sandbox.scene.compile.scene import Scene
from tests.measure.analytic.oracle import integrated, motion_of, scene_of

TIME = np.linspace(0.0, 10.0, 101)
CRITICAL = (0.0, 1.0, 7.9999999, 8.0, 8.0000001, 30.0)
"""Damping in N·s/m around the critical value."""


def spring_scene(
    position: str = "[1.3, 0.0]",
    velocity: str = "[0.0, 0.0]",
    rest: float = 1.0,
    stiffness: float = 8.0,
    damping: float = 0.0,
    world: str = "duration = 10.0",
    extra: str = "",
) -> Scene:
    """Return a body of 2 kg on a spring to the origin."""
    return scene_of(
        f"[[ball]]\nname = 'm'\nposition = {position}\nvelocity = {velocity}\nradius = 0.1\nmass = 2.0\n"
        f"angular_velocity = 0.5\n[[joint]]\nkind = 'spring'\nbetween = ['m']\nrest_length = {rest}\n"
        f"stiffness = {stiffness}\ndamping = {damping}\n{extra}",
        world=world,
    )


def spring_derivative(
    rest: float, k: float, c: float, gravity: tuple[float, float], drag: float = 0.0, wind=(0.0, 0.0)
):
    """Return the state derivative by the spring law of the engines: F = −k (l − l₀) − c l̇ along the line, in 2D."""

    def derivative(_: float, s: np.ndarray) -> list[float]:
        length = float(np.hypot(*s[:2]))
        n = s[:2] / length if length else np.zeros(2)
        a = -(k * (length - rest) + c * (s[2:] @ n)) / 2.0 * n + gravity - drag * (s[2:] - wind)
        return [*s[2:], *a]

    return derivative


@pytest.mark.parametrize(
    ("start", "rest", "damping", "gravity", "drag", "wind"),
    [
        *(([1.3, 0.0, 0.4, 0.0], 1.0, damping, [0.0, 0.0], 0.0, [0.0, 0.0]) for damping in CRITICAL),
        ([0.0, -1.2, 0.0, 0.5], 1.0, 0.3, [0.0, -1.5], 0.2, [0.0, 0.3]),  # hangs in wind, about its equilibrium
        ([1.0, 0.5, -0.7, 0.5], 0.0, 0.0, [0.3, -1.5], 0.2, [0.0, 0.0]),  # moves along both axes
    ],
)
def test_spring_agrees_with_dop853(start, rest, damping, gravity, drag, wind):
    world = f"gravity = {gravity}\nlinear_drag = {drag}\nwind = {wind}\nduration = 10.0"
    scene = spring_scene(str(start[:2]), str(start[2:]), rest=rest, damping=damping, world=world)
    expected = integrated(spring_derivative(rest, 8.0, damping, gravity, drag, wind), start, TIME)
    found = motion_of(scene, TIME)
    assert np.column_stack((found.position, found.velocity)) == pytest.approx(expected.T, abs=1e-11)  # 1e-13 a step
    assert found.angle == pytest.approx(0.5 * TIME, abs=1e-15)  # a spring at the centre exerts no torque


def test_spring_is_anchored_at_a_rotated_fixed_body() -> None:
    nail = (
        "[[box]]\nname = 'nail'\nposition = [0.0, 1.0]\nangle = 1.5707963267948966\nsize = [0.2, 0.2]\nfixed = true\n"
    )
    ball = "[[ball]]\nname = 'm'\nposition = [0.0, 3.1]\nradius = 0.1\ncollides = 'none'\nvelocity = [0.0, 0.2]\n"
    for ends in (
        "between = ['m', 'nail']\nanchors = [[0, 0], [0.1, 0]]",
        "between = ['nail', 'm']\nanchors = [[0.1, 0], [0, 0]]",
    ):
        joint = f"[[joint]]\nkind = 'spring'\n{ends}\nstiffness = 2.0\n"
        found = motion_of(scene_of(ball, nail, joint), TIME)
        # roundings of 3 m
        assert found.position[:, 1] - 3.1 == pytest.approx(0.2 / 2**0.5 * np.sin(2**0.5 * TIME), abs=1e-14)
        assert solution(scene_of(ball, nail.replace("fixed = true\n", "collides = 'none'\n"), joint)) is None


@given(squared=st.floats(1e-3, 1e7), damping=st.floats(0.0, 1e5))
def test_damped_oscillation_has_its_initial_values_and_never_gains_energy(squared: float, damping: float) -> None:
    c, s = damped(np.array([0.0, 1.0, 1e3]), squared, damping)
    assert (c[0], s[0]) == (1.0, 0.0)
    # The energy of u = C, ω²C² + C'² with C' = −γC − …, never exceeds its start; 1e-12 for rounding of large phases.
    u, rate = c + damping * s, -squared * s
    assert (squared * u**2 + rate**2 <= squared * (1.0 + 1e-12)).all()


@pytest.mark.parametrize(
    "scene",
    [
        spring_scene("[1.3, 0.1]", "[0.1, 0.0]"),
        spring_scene(velocity="[0.0, 0.1]"),
        spring_scene(world="gravity = [0.0, -1.0]\nduration = 10.0"),
        spring_scene("[2.1, 0.0]"),
        spring_scene("[1.0, 0.5]", "[0.3, 0.0]", rest=0.0, damping=0.1),
        spring_scene(world="quadratic_drag = 0.1\nduration = 10.0"),
        spring_scene(extra="anchors = [[0.05, 0.0], [0.0, 0.0]]\n"),
        spring_scene(extra="strength = 3.0\n"),
        spring_scene(extra="[[joint]]\nkind = 'spring'\nbetween = ['m']\nstiffness = 1.0\n"),
        spring_scene(extra="[[joint]]\nkind = 'rotary_spring'\nbetween = ['m']\nstiffness = 1.0\n"),
        spring_scene(extra="[[post]]\nposition = [9.0, 0.0]\nradius = 0.1\n"),
        spring_scene(extra="[[ball]]\nposition = [9.0, 0.0]\nradius = 0.1\n"),
    ],
    ids=["aside", "sideways", "gravity across", "through its anchor", "damped in the plane", "drag", "off its centre",
         "may break", "a second spring", "a rotary spring", "a post", "another ball"],
)  # fmt: skip
def test_nonlinear_scene_has_no_closed_form(scene: Scene) -> None:
    assert solution(scene) is None
