"""What a real window writes to disk."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.window.render.palette import WARNING
from tests.driven.driving import SIZE, Play
from tests.driven.looking import HUD, count, paused
from tests.driven.rooms import MOVING, written

pytestmark = pytest.mark.slow  # a real window in real time


def test_screenshot_is_what_is_seen(drive: Play, tmp_path: Path) -> None:
    window = drive("play", str(written(tmp_path, MOVING)), "--paused")
    window.wait_until(paused, "PAUSED")
    shot = window.shot()
    for number in (1, 2):
        window.key("ctrl+p")
        line = f"screenshot: sandbox-room-{number}.png"
        window.wait_for(lambda line=line: line in window.said(), line)
    with Image.open(tmp_path / "sandbox-room-1.png") as image:
        assert image.size == SIZE
        picture = np.asarray(image.convert("RGB"))
    rate = np.s_[:30, 560:636]  # how fast pictures come may have changed meanwhile
    differs = (picture != shot).any(axis=2)
    differs[rate] = False
    assert not differs.any()


def test_film_is_recorded_until_it_is_stopped(drive: Play, tmp_path: Path) -> None:
    window = drive("play", str(written(tmp_path, MOVING)))
    window.key("ctrl+r")
    window.wait_until(lambda shot: count(shot, WARNING, HUD) > 60, "recording")
    begun = window.step_number()
    window.wait_for(lambda: window.step_number() > begun + 20, "a few pictures")
    window.key("ctrl+r")
    window.wait_for(lambda: "recorded: sandbox-room-1.gif" in window.said(), "the film")
    with Image.open(tmp_path / "sandbox-room-1.gif") as film:
        assert film.size == SIZE
        assert getattr(film, "n_frames", 1) > 1
    assert not list(tmp_path.glob(".*.tmp"))


def test_film_is_finished_when_the_window_closes(drive: Play, tmp_path: Path) -> None:
    record = tmp_path / "all.json"
    window = drive("play", str(written(tmp_path, MOVING)), "--record", str(record))
    window.key("ctrl+r")
    begun = window.step_number()
    window.wait_for(lambda: window.step_number() > begun + 10, "a few pictures")
    window.key("Escape")
    assert window.status() == 0
    assert window.said()[-2:] == [f"session: {record}", "recorded: sandbox-room-1.gif"]
    with Image.open(tmp_path / "sandbox-room-1.gif") as film:
        assert getattr(film, "n_frames", 1) > 1
    session = Recording.load(record)
    assert session.duration > 0.1
    assert rerun(session).info["state_hash"] == session.state_hash


def test_session_is_replayed_to_its_own_state(drive: Play, tmp_path: Path) -> None:
    window = drive("play", str(written(tmp_path, MOVING)))
    window.key("n", "b", "o", "period", "comma", "p")
    session = window.session()
    assert json.loads((tmp_path / "sandbox-room-1.json").read_text(encoding="utf-8"))["format"] == 1
    assert rerun(session).info["state_hash"] == session.state_hash
