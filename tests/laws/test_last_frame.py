"""The last frame of a run is a state that the engine computed, wherever dt does not divide the duration."""

import itertools
import math

import numpy as np
import pytest

from sandbox.engines.registry import ENGINES
from sandbox.measure.run.runner import run
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find

STEPS_AND_DURATIONS = [*itertools.product((0.01, 0.013, 0.05, 0.07, 0.0967), (0.305, 0.33, 0.38, 0.41, 0.55))]
WHOLE_STEPS = ("pymunk", "box2d")
"""Engines that start from the impulses of the last step, which a shorter one would apply wrongly."""


@pytest.mark.parametrize("engine", ENGINES)
def test_two_balls_have_the_velocities_before_or_after_their_impact(engine: str) -> None:
    for dt, duration in STEPS_AND_DURATIONS:
        scene = load(find("two_balls"), [f"world.duration={duration}", f"solver.dt={dt}"])
        done = run(scene, engine, audit=False)
        steps = math.ceil(duration / dt - 1e-9)  # rounding of the quotient
        end = steps * dt if engine in WHOLE_STEPS else duration
        assert done.time[-1] == pytest.approx(end, rel=1e-12)  # rounding of the product
        assert len(done.warnings) == (end > duration * (1.0 + 1e-9))
        velocity, before, after = done.velocity[-1, :, 0], done.velocity[0, :, 0], np.array([2.5, 4.5])
        if engine == "box2d":  # its restitution is too low at long steps; momentum is kept, to 32 bits
            assert velocity @ [3.0, 1.0] == pytest.approx(12.0, rel=1e-5)
        else:  # by momentum and restitution; 0.375 s is the impact
            np.testing.assert_allclose(
                velocity, before if end < 0.375 else after, atol=1e-9, err_msg=f"{dt} {duration}"
            )


@pytest.mark.parametrize("engine", [each for each in ENGINES if each not in WHOLE_STEPS])
def test_contact_within_the_last_shorter_step_is_recorded(engine: str) -> None:
    scene = load(find("two_balls"), ["world.duration=0.395", "solver.dt=0.26"])
    done = run(scene, engine)
    assert len(done.contact_time) == 1
    assert done.contact_time[0] == pytest.approx(0.375 if engine == "exact" else 0.395, rel=1e-12)  # rounding
    assert done.missed_contacts == 0
