"""Exact engine on random scenes: it ends, stays finite and is reproducible."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.exact.engine import ExactEngine
from sandbox.engines.exact.simulation import ExactSimulation
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests.strategies import Document, documents

pytestmark = pytest.mark.full  # property tests with many examples


@st.composite
def supported_scenes(draw: st.DrawFn) -> Scene:
    """Draw valid scenes without drag and without settings that only other engines support."""
    document: Document = draw(documents(most=3))
    document["solver"] = {"dt": document.get("solver", {}).get("dt", 0.01)}
    for key in ("linear_drag", "quadratic_drag"):
        document.get("world", {}).pop(key, None)
    scene = from_document(document)
    assume(not ExactEngine().missing(scene, scene.solver))
    return scene


def outcome(simulation: ExactSimulation) -> tuple[str | None, str]:
    """Run ten steps; return the reason of an early end, if any, and the final state hash."""
    ended = None
    try:
        for _ in range(10):
            simulation.step()
            frame = simulation.frame()
            state = (frame.position, frame.velocity, frame.angle, frame.angular_velocity)
            assert all(bool(np.isfinite(each).all()) for each in state)
    except (Divergence, Exhaustion) as reason:
        ended = str(reason)
    return ended, simulation.state_hash()


@pytest.mark.slow
@given(supported_scenes())
@settings(max_examples=80)
def test_any_scene_stays_finite_or_ends_with_a_reason_reproducibly(scene: Scene) -> None:
    first, again = ExactEngine().start(scene), ExactEngine().start(scene)
    first.contacts()  # recording contacts must not change the result
    assert outcome(first) == outcome(again)
    contacts = first.contacts()
    assert np.isfinite(contacts.time).all()
    assert np.isfinite(contacts.impulse).all()
