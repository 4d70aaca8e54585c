"""Balls on a surface move on every engine as on `exact`, before chaos, with every collision model."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

R = 0.0285
RAIL = {"height": 0.036, "restitution": 0.85, "friction": 0.2}
CORNERS = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]]

offsets = st.floats(-0.3, 0.3)


def shot(ball_ball: str, cushion: str, aim: float, **more: Any) -> Scene:
    """Return a scene of a cue ball in a box, struck so that it hits a ball 0.3 m away off centre."""
    ball = {"radius": R, "mass": 0.17, "restitution": 0.95**0.5}
    target = [0.5 + 0.3 * math.cos(aim + 0.05), 0.5 + 0.3 * math.sin(aim + 0.05)]
    document = {
        "world": {"duration": 0.9},
        "solver": {"dt": 0.01, "substeps": 10},
        "surface": {"sliding_friction": 0.2, "rolling_friction": 0.01, "spinning_friction": 0.0127},
        "contact_models": {"ball_ball": ball_ball, "cushion": cushion},
        "wall": [{"points": CORNERS, "closed": True, **RAIL}, {"points": [[0.2, 1.2], [0.25, 1.3]], **RAIL}],
        "post": [{"position": [0.8, 1.1], "radius": 0.02, **RAIL}, {"position": [0.5, 1.0], "radius": 0.02, **RAIL}],
        "ball": [{"name": "cue", "position": [0.5, 0.5], **ball}, {"name": "a", "position": target, **ball}],
        "shot": [{"aim": aim, **more}],
    }
    return from_document(document)


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
@pytest.mark.parametrize("cushion", ["simple", "han2005", "mathavan2010"])
@pytest.mark.parametrize("ball_ball", ["elastic", "frictional"])
@settings(max_examples=6)
@given(aim=st.floats(0.0, 6.28), speed=st.floats(0.5, 1.5), side=offsets, height=offsets)
def test_engines_agree_over_the_first_hits(
    engine: str, ball_ball: str, cushion: str, aim: float, **stroke: float
) -> None:
    scene = shot(ball_ball, cushion, aim, **stroke)
    exact, native = run(scene, "exact", account=True), run(scene, engine, account=True)
    # m: both resolve each hit at its exact time, so only rounding is left, which a hit of balls amplifies tenfold
    assert np.abs(exact.position - native.position).max() < 1e-8
    for trajectory in (exact, native):
        energy = trajectory.energy
        assert np.diff(energy).max() <= 5e-8  # J: energy of a hop
        assert np.abs(energy - energy[0] - trajectory.account.sum(axis=1)).max() <= 1e-12 * energy[0]  # rounding
