"""Files written by a real window: screenshots, films and sessions."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.window.render.palette import WARNING
from tests.driven.driving import SIZE, OpenWindow
from tests.driven.looking import HUD, count_pixels, shows_paused
from tests.driven.rooms import MOVING, write_scene

pytestmark = pytest.mark.slow  # a real window in real time


def test_screenshot_file_equals_the_displayed_picture(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)), "--paused")
    window.wait_until(shows_paused, "PAUSED")
    shot = window.shot()
    for number in (1, 2):
        window.key("ctrl+p")
        line = f"screenshot: sandbox-room-{number}.png"
        window.wait_for(lambda line=line: line in window.stdout_lines(), line)
    with Image.open(tmp_path / "sandbox-room-1.png") as image:
        assert image.size == SIZE
        picture = np.asarray(image.convert("RGB"))
    rate = np.s_[:30, 560:636]  # the displayed frame rate may have changed meanwhile
    changed = (picture != shot).any(axis=2)
    changed[rate] = False
    assert not changed.any()


def test_film_is_recorded_until_it_is_stopped(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)))
    window.key("ctrl+r")
    window.wait_until(lambda shot: count_pixels(shot, WARNING, HUD) > 60, "recording")
    begun = window.step_number()
    window.wait_for(lambda: window.step_number() > begun + 20, "a few pictures")
    window.key("ctrl+r")
    window.wait_for(lambda: "recorded: sandbox-room-1.gif" in window.stdout_lines(), "the film")
    with Image.open(tmp_path / "sandbox-room-1.gif") as film:
        assert film.size == SIZE
        assert getattr(film, "n_frames", 1) > 1
    assert not list(tmp_path.glob(".*.tmp"))


def test_film_is_finished_when_the_window_closes(drive: OpenWindow, tmp_path: Path) -> None:
    record = tmp_path / "all.json"
    window = drive("play", str(write_scene(tmp_path, MOVING)), "--record", str(record))
    window.key("ctrl+r")
    begun = window.step_number()
    window.wait_for(lambda: window.step_number() > begun + 10, "a few pictures")
    window.key("Escape")
    assert window.exit_status() == 0
    assert window.stdout_lines()[-2:] == [f"session: {record}", "recorded: sandbox-room-1.gif"]
    with Image.open(tmp_path / "sandbox-room-1.gif") as film:
        assert getattr(film, "n_frames", 1) > 1
    session = Recording.load(record)
    assert session.duration > 0.1
    assert rerun(session).info["state_hash"] == session.state_hash


def test_session_file_replays_to_the_same_state(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)))
    window.key("n", "b", "o", "period", "comma", "p")
    session = window.session()
    assert json.loads((tmp_path / "sandbox-room-1.json").read_text(encoding="utf-8"))["format"] == 1
    assert rerun(session).info["state_hash"] == session.state_hash
