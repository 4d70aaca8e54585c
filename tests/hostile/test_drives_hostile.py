"""Drives under attack: bodies of any shape, on any drive, told anything, among others: all stays finite and lawful."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.action import Drive
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.description.forces import PlungerDrive
from sandbox.scene.files.load import from_document
from tests import strategies

pytestmark = pytest.mark.slow  # some 30 s together

BODIES = [
    {"name": "a", "position": [0.0, 0.0], "size": [1.0, 0.4], "restitution": 0.5, "friction": 0.5},
    {"name": "b", "position": [1.5, 0.0], "size": [0.3, 2.0], "restitution": 1.0},
]

HOW = {
    "pymunk": ("pymunk", {}),
    "reference": ("reference", {}),
    "verlet": ("reference", {"integrator": "velocity_verlet", "detection": "shrink"}),
    "springs": ("reference", {"response": "penalty", "damping": 0.5}),
}


@st.composite
def sessions(draw):
    """A scene of two driven boxes among balls over a floor, and what is told to their drives."""
    first, second = draw(strategies.drives(["a"])), draw(strategies.drives(["b"]))
    place = st.tuples(strategies.numbers(-2, 3), strategies.numbers(1.2, 4)).map(list)
    balls = st.fixed_dictionaries({"position": place, "radius": strategies.numbers(0.05, 0.3)})
    document = {
        "world": {"gravity": [0.0, -9.81], "duration": 1.0, "linear_drag": draw(st.sampled_from([0.0, 0.3]))},
        "solver": {"dt": 0.01, "substeps": draw(st.sampled_from([1, 5]))},
        "plane": [{"point": [0, -3], "normal": [0, 1], "restitution": 0.5}],
        "box": BODIES,
        "ball": draw(st.lists(balls, min_size=1, max_size=3)),
        "drive": [{**first, "name": "first"}, {**second, "name": "second"}],
    }
    told = st.tuples(st.integers(0, 59), st.sampled_from(["first", "second"]), strategies.numbers(0, 1))
    return from_document(document), draw(st.lists(told, max_size=6))


def begun(scene, how):
    """The scene, started in one of the ways."""
    engine, own = HOW[how]
    return start(scene, engine, scene.solver.replace(**own))


@pytest.mark.parametrize("how", HOW)
@settings(max_examples=10, deadline=None)
@given(sessions())
def test_driven_bodies_stay_where_their_drives_let_them(how, session):
    scene, told = session
    running, again = begun(scene, how), begun(scene, how)
    try:
        for k in range(60):
            if k == 30:
                again = SwitchableSimulation.resumed(
                    again.checkpoint()
                )  # taken up from what can be known: it must go on
            for each in (running, again):
                for when, drive, level in told:
                    if when == k:
                        each.apply(Drive(time=0.0, drive=drive, level=level))
                each.step()
            _check(scene, running.frame())
            _check(scene, again.frame())
    except (Divergence, Exhaustion):  # a ball between a kinematic body and the floor has nowhere to go
        return


def _check(scene, frame):
    arrays = (frame.position, frame.velocity, frame.angle, frame.angular_velocity, frame.drives)
    assert all(np.isfinite(array).all() for array in arrays)
    names = scene.bodies.names
    for k, drive in enumerate(scene.drives):
        number = names.index(drive.body)
        if isinstance(drive, PlungerDrive):
            home, unit = scene.bodies.position[number], np.asarray(drive.direction) / np.hypot(*drive.direction)
            pull = float((home - frame.position[number]) @ unit)
            assert -1e-12 <= pull <= drive.travel + 1e-12  # rounding of metres
            assert abs(frame.drives[k, 1] - pull) < 1e-12
            continue
        low, high = sorted(drive.stops)
        assert low <= frame.angle[number] <= high
        places = scene.bodies.position[number], frame.position[number]
        arm, now = (np.hypot(*(place - np.asarray(drive.pivot))) for place in places)
        assert np.isclose(now, arm, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("how", HOW)
@settings(max_examples=8, deadline=None)
@given(sessions())
def test_account_closes_whatever_is_driven(how, session):
    scene, told = session
    running = begun(scene, how)
    running.account()
    begin, most = total_energy(running), 1.0
    try:
        for k in range(60):
            for when, drive, level in told:
                if when == k:
                    running.apply(Drive(time=0.0, drive=drive, level=level))
            running.step()
            most = max(most, abs(total_energy(running)))
    except (Divergence, Exhaustion):
        return
    entries = running.account()
    turned_over = sum(abs(value) for value in entries.values()) + most
    # Rounding of each substep's sums, of a hundred places from the origin whose heights they hold
    assert abs(begin + sum(entries.values()) - total_energy(running)) < 1e-10 * turned_over
