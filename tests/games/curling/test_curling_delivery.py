"""Deliveries computed by the closed form reach their targets on the engine."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.registry import start
from sandbox.engines.tabletop.motion import curled
from sandbox.games.curling.delivery import Delivery, Ice
from sandbox.games.curling.sheet import RELEASE, STONE, WEIGHT
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of tables

SCENE = load(find("games/curling"))
assert SCENE.surface is not None
ICE = Ice.of(SCENE.surface)
TURN = st.sampled_from([1, -1])


@given(speed=st.floats(1.0, 4.0), heading=st.floats(-0.1, 0.1), turn=TURN, fraction=st.floats(0.01, 1.0))
def test_closed_form_path_is_that_of_the_engine(speed: float, heading: float, turn: int, fraction: float) -> None:
    delivery = Delivery(speed, heading, turn)
    x, y, _, _ = curled(*delivery.velocity, ICE.slowing, turn * ICE.curl, (1.0 - fraction) * speed / ICE.slowing)
    offset = ICE.displacement(delivery, fraction)
    assert (offset.real, offset.imag) == pytest.approx((x, y), abs=1e-11)  # rounding of 80 m; 1 − s^(2−iκ) cancels


@given(x=st.floats(-5, 2), y=st.floats(-2, 2), turn=TURN)
def test_a_draw_comes_to_rest_at_its_target(x: float, y: float, turn: int) -> None:
    offset = ICE.displacement(ICE.to_rest((x, y), turn), 0.0)
    assert (RELEASE + offset.real, offset.imag) == pytest.approx((x, y), abs=1e-12)  # rounding of 28 m


@given(x=st.floats(-5, 2), y=st.floats(-2, 2), turn=TURN, speed=st.floats(1.0, 5.0))
def test_a_takeout_passes_or_just_reaches_its_target(x: float, y: float, turn: int, speed: float) -> None:
    delivery = ICE.through((x, y), turn, speed)
    path = np.asarray([RELEASE + ICE.displacement(delivery, k / 2000) - complex(x, y) for k in range(2001)])
    steps = np.diff(path)
    along = np.clip(-(path[:-1] * steps.conj()).real / np.abs(steps) ** 2, 0.0, 1.0)
    # Chords are 13 cm at most. The radius is 2/κ times the remaining path, so the chords get shorter towards its end.
    assert np.abs(path[:-1] + along * steps).min() < 1e-4
    assert delivery.speed >= min(speed, ICE.to_rest((x, y), turn).speed) - 1e-12


@pytest.mark.parametrize("turn", [1, -1])
def test_a_stone_thrown_on_the_engine_stops_at_the_tee(turn: int) -> None:
    delivery = ICE.to_rest((0.0, 0.0), turn)
    state = {"position": (RELEASE, 0.0), "velocity": delivery.velocity, "angular_velocity": delivery.spin}
    stone = Ball(name="stone", radius=STONE, mass=WEIGHT, **state)
    scene = Scene(surface=SCENE.surface, balls=(stone,), solver=SCENE.solver.replace(dt=0.05))
    simulation = start(scene, "pymunk")
    while simulation.frame().velocity.any():
        simulation.step()
    assert simulation.frame().position[0] == pytest.approx([0.0, 0.0], abs=1e-10)  # rounding of 500 steps of 28 m
    assert simulation.frame().angular_velocity[0] * turn > 0.0  # it rotated until it came to rest


def test_a_draw_has_the_time_and_curl_of_real_stones() -> None:
    # Draws take about 24 s from hog line to tee, and curl about 1 m: the scene's parameters are chosen for that.
    delivery = ICE.to_rest((0.0, 0.0), 1)
    assert delivery.speed / ICE.slowing == pytest.approx(24.0, abs=1.0)
    aside = -RELEASE * math.tan(delivery.heading)
    assert aside == pytest.approx(-1.0, abs=0.2)
