"""Random drives and levels on bodies among others: the state stays finite and within its constraints."""

import numpy as np
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from sandbox.action import Drive
from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.description.forces import PlungerDrive
from sandbox.scene.files.load import from_document
from tests import strategies

pytestmark = pytest.mark.nightly  # about 30 s together

BODIES = [
    {"name": "a", "position": [0.0, 0.0], "size": [1.0, 0.4], "restitution": 0.5, "friction": 0.5},
    {"name": "b", "position": [1.5, 0.0], "size": [0.3, 2.0], "restitution": 1.0},
]

CONFIGS = {
    "pymunk": ("pymunk", {}),
    "reference": ("reference", {}),
    "verlet": ("reference", {"integrator": "velocity_verlet", "detection": "shrink"}),
    "springs": ("reference", {"response": "penalty", "damping": 0.5}),
}


@st.composite
def sessions(draw):
    """Draw a scene of two driven boxes among balls over a floor, and levels of their drives."""
    first, second = draw(strategies.drives(["a"])), draw(strategies.drives(["b"]))
    position = st.tuples(strategies.numbers(-2, 3), strategies.numbers(1.2, 4)).map(list)
    balls = st.fixed_dictionaries({"position": position, "radius": strategies.numbers(0.05, 0.3)})
    document = {
        "world": {"gravity": [0.0, -9.81], "duration": 1.0, "linear_drag": draw(st.sampled_from([0.0, 0.3]))},
        "solver": {"dt": 0.01, "substeps": draw(st.sampled_from([1, 5]))},
        "plane": [{"point": [0, -3], "normal": [0, 1], "restitution": 0.5}],
        "box": BODIES,
        "ball": draw(st.lists(balls, min_size=1, max_size=3)),
        "drive": [{**first, "name": "first"}, {**second, "name": "second"}],
    }
    level = st.tuples(st.integers(0, 59), st.sampled_from(["first", "second"]), strategies.numbers(0, 1))
    return from_document(document), draw(st.lists(level, max_size=6))


def start_with(scene, config):
    """Start the scene in one of the configurations."""
    engine, overrides = CONFIGS[config]
    return start(scene, engine, scene.solver.replace(**overrides))


@pytest.mark.parametrize("config", CONFIGS)
@settings(max_examples=10)
@given(sessions())
def test_driven_bodies_stay_within_the_limits_of_their_drives(config, session):
    scene, levels = session
    running, resumed = start_with(scene, config), start_with(scene, config)
    try:
        for k in range(60):
            if k == 30:
                resumed = SwitchableSimulation.resumed(resumed.checkpoint())  # a checkpoint is enough to continue
            for each in (running, resumed):
                for when, drive, level in levels:
                    if when == k:
                        each.apply(Drive(time=0.0, drive=drive, level=level))
                each.step()
            _check(scene, running.frame())
            _check(scene, resumed.frame())
    except (Divergence, Exhaustion):  # a ball is squeezed between a kinematic body and the floor
        reject()  # a property that almost always diverges fails


def _check(scene, frame):
    arrays = (frame.position, frame.velocity, frame.angle, frame.angular_velocity, frame.drives)
    assert all(np.isfinite(array).all() for array in arrays)
    names = scene.bodies.names
    for k, drive in enumerate(scene.drives):
        index = names.index(drive.body)
        if isinstance(drive, PlungerDrive):
            rest, unit = scene.bodies.position[index], np.asarray(drive.direction) / np.hypot(*drive.direction)
            pull = float((rest - frame.position[index]) @ unit)
            assert -1e-12 <= pull <= drive.travel + 1e-12  # rounding of metres
            assert abs(frame.drives[k, 1] - pull) < 1e-12
            continue
        low, high = sorted(drive.stops)
        assert low <= frame.angle[index] <= high
        positions = scene.bodies.position[index], frame.position[index]
        arm, current = (np.hypot(*(position - np.asarray(drive.pivot))) for position in positions)
        assert np.isclose(current, arm, rtol=1e-13, atol=1e-13)
