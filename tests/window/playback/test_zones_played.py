"""Zones in a session: seeking reproduces the same visits, and a recording replays to the same end."""

from typing import Any

import numpy as np
import pytest

from sandbox.action import Impulse
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import HELD
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.playback.session import Session

HOLES: list[dict[str, Any]] = [
    {"name": "mouth", "points": [[0.3, -1], [0.3, 1]], "thickness": 0.1, "to_layer": "up"},
    {"name": "slope", "position": [0.8, 0], "radius": 0.3, "layers": ["up"], "gravity": [-0.5, 0.0]},
    {"name": "hole", "position": [1.5, 0], "radius": 0.1, "layers": ["up"], "holds": True},
]


def run_session(scene: Scene, steps: int, kick: int | None = None) -> Session:
    session = Session(scene)
    while session.step_number < steps:
        session.advance()
        if session.step_number == kick:
            session.apply(Impulse(time=0.0, body=session.bodies.names[0], impulse=(0.3, 0.1)))
    return session


def course() -> Scene:
    ball = {"name": "ball", "position": [0, 0], "velocity": [1.5, 0], "radius": 0.1}
    return from_document({"ball": [ball], "zone": HOLES})


@pytest.mark.parametrize("name", ["holes", "overpass"])
def test_seeking_back_and_forth_reproduces_the_same_visits(name: str) -> None:
    """The run is long enough for checkpoints, also inside zones; each state is compared with the first pass."""
    session = run_session(course() if name == "holes" else load(find(name)), 320, kick=200)
    known = {k: session.history.get(k) for k in range(321)}
    assert session.history.keyframe_steps
    assert {int(mark) for frame in known.values() if frame is not None for mark in np.unique(frame.visits)} >= {0, 1}
    for step in (150, 40, 210, 199, 320, 0, 320):
        for _ in session.seek(step):
            pass
        assert session.frame.state_hash() == known[step].state_hash()
        assert np.array_equal(session.frame.visits, known[step].visits)
        assert np.array_equal(session.frame.layer, known[step].layer)
    assert session.history.checkpoints_enabled  # no checkpoint replayed differently


def test_recording_replays_to_the_same_end() -> None:
    session = run_session(course(), 260, kick=200)
    assert any(frame.visits[0, 2] == HELD for k in range(200) if (frame := session.history.get(k)) is not None)
    recording = session.recording()
    copy = Recording.from_json(recording.to_json())
    assert rerun(copy, audit=False).info["state_hash"] == recording.state_hash
