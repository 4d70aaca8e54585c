"""Orbits by Kepler's equation against DOP853, and scenes that are no Kepler orbits."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.analytic import solution
from sandbox.scene.compile.scene import Scene
from tests.measure.analytic.oracle import integrated, motion_of, scene_of

TIME = np.linspace(0.0, 15.0, 61)
SUN = "[[attraction]]\ntoward = [0.2, -0.1]\nstrength = 1.0\n"


def planet(x: float, y: float, vx: float, vy: float, sun: str = SUN, world: str = "duration = 30.0") -> Scene:
    ball = f"[[ball]]\nname = 'p'\nposition = [{0.2 + x!r}, {-0.1 + y!r}]\nvelocity = [{vx!r}, {vy!r}]\nradius = 0.01\n"
    return scene_of(ball, sun, world=world)


def state_derivative(_: float, s: np.ndarray) -> list[float]:
    r = float(np.hypot(*s[:2]))
    return [*s[2:], *(-s[:2] / r**3)]


@pytest.mark.parametrize(
    "start",
    [
        (0.5, 0.0, 0.0, math.sqrt(3.0)), (1.0, 0.0, 0.0, 1.0), (1.0, 0.0, 0.4, 1.1), (-0.3, 1.0, 0.9, -0.2),
        (1.0, 0.0, 0.0, 0.3), (1.0, 0.0, 0.0, 1.8), (2.0, 1.0, -1.5, 0.2),
    ],
    ids=["e = ½", "circle", "rising", "backwards", "e = 0.91", "hyperbola", "hyperbola falling in"],
)  # fmt: skip
def test_orbit_agrees_with_dop853(start: tuple[float, float, float, float]) -> None:
    expected = integrated(state_derivative, start, TIME)
    found = motion_of(planet(*start), TIME)
    # 1e-13 a step, magnified at each periapsis: e = 0.91 passes four, at 40 times the mean speed.
    assert found.position - [0.2, -0.1] == pytest.approx(expected[:2].T, abs=3e-9)
    assert found.velocity == pytest.approx(expected[2:].T, abs=1e-7)


@given(x=st.floats(0.3, 3.0), vx=st.floats(-1.5, 1.5), vy=st.floats(0.2, 2.0), angle=st.floats(0.0, 6.28))
def test_orbit_conserves_energy_and_angular_momentum(x: float, vx: float, vy: float, angle: float) -> None:
    c, s = math.cos(angle), math.sin(angle)
    scene = planet(c * x, s * x, c * vx - s * vy, s * vx + c * vy)
    if solution(scene) is None:  # a parabola, to rounding
        assert abs(2.0 - x * (vx * vx + vy * vy)) <= 2e-6
        return
    found = motion_of(scene, TIME)
    r, v = (found.position - [0.2, -0.1]).T, found.velocity.T
    periapsis = float(np.hypot(*r).min())
    # At periapsis q the speed √(2/q) rounds by 1e-16; far out, the Lagrange coefficients f and g cancel.
    energy = 0.5 * (v**2).sum(axis=0) - 1.0 / np.hypot(*r)
    assert energy == pytest.approx(np.full(len(TIME), energy[0]), abs=1e-10 / periapsis**2)
    momentum = r[0] * v[1] - r[1] * v[0]
    assert momentum == pytest.approx(np.full(len(TIME), momentum[0]), abs=1e-10 / periapsis)


def test_orbit_about_a_fixed_body_equals_orbit_about_a_point() -> None:
    star = "[[ball]]\nname = 's'\nposition = [0.2, -0.1]\nradius = 0.01\nfixed = true\ncollides = 'none'\n"
    scene = planet(1.0, 0.0, 0.0, 0.9, sun=star + SUN.replace("[0.2, -0.1]", "'s'"))
    assert (motion_of(scene, TIME).position == motion_of(planet(1.0, 0.0, 0.0, 0.9), TIME).position).all()


@pytest.mark.parametrize(
    "scene",
    [
        planet(1.0, 0.0, 0.0, 1.0, sun=SUN + "softening = 0.01\n"),
        planet(1.0, 0.0, 0.0, 1.0, sun=SUN.replace("1.0\n", "-1.0\n")),
        planet(1.0, 0.0, 0.0, 1.0, sun=SUN + SUN),
        planet(1.0, 0.0, 0.0, 1.0, world="gravity = [0.0, -0.001]\nduration = 30.0"),
        planet(1.0, 0.0, 0.0, 1.0, world="linear_drag = 0.001\nduration = 30.0"),
        planet(1.0, 0.0, 0.0, math.sqrt(2.0)),
        planet(1.0, 0.0, -0.3, 0.0),
        planet(1.0, 0.0, 0.0, 1.0, sun=SUN + "[[ball]]\nposition = [9.0, 9.0]\nradius = 0.1\n"),
        planet(1.0, 0.0, 0.0, 1.0, sun=SUN + "[[plane]]\npoint = [0.0, -9.0]\nnormal = [0.0, 1.0]\n"),
        planet(1.0, 0.0, 0.0, 1.0, sun=SUN + "[[joint]]\nkind = 'spring'\nbetween = ['p']\nstiffness = 0.1\n"),
    ],
    ids=["softened", "repelled", "two suns", "gravity", "drag", "parabola", "falling in", "another ball", "a plane",
         "a spring"],
)  # fmt: skip
def test_scene_that_is_no_kepler_orbit_has_no_closed_form(scene: Scene) -> None:
    assert solution(scene) is None
