"""Start, exit and error handling of a real window."""

import signal
import subprocess
from pathlib import Path

import pytest

from sandbox.cli.main import call
from sandbox.window.render.palette import ORANGE, WARNING
from tests.driven.driving import LIMIT, OpenWindow, command, environment
from tests.driven.looking import MESSAGES, are_different, count_pixels, on_screen, window_layout
from tests.driven.rooms import AT_REST, LEAVING, MOVING, write_scene
from tests.driven.xclient import XClient

pytestmark = pytest.mark.full  # a window or a film


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGTERM, 0), (signal.SIGINT, 130)], ids=["terminated", "interrupted"]
)
def test_signal_closes_the_window_cleanly(drive: OpenWindow, tmp_path: Path, number: int, status: int) -> None:
    record = tmp_path / "all.json"
    window = drive("play", str(write_scene(tmp_path, MOVING)), "--record", str(record))
    window.process.send_signal(number)
    assert window.exit_status() == status
    assert window.stdout_lines() == [f"session: {record}"]
    assert window.stderr_text() == ""


def test_escape_and_the_close_button_close_the_window(drive: OpenWindow, display: str, tmp_path: Path) -> None:
    path = str(write_scene(tmp_path, MOVING))
    window = drive("play", path)
    window.key("Escape")
    assert window.exit_status() == 0
    window = drive("play", path)
    with XClient(display) as client:
        client.ask_to_close(window.window)
    assert window.exit_status() == 0
    assert window.stderr_text() == ""


@pytest.mark.parametrize("driver", [None, "x11"])
def test_missing_display_is_a_one_line_error(tmp_path: Path, driver: str | None) -> None:
    display = None if driver is None else ":4095"
    hidden: dict[str, str | None] = {"WAYLAND_DISPLAY": None, "XDG_RUNTIME_DIR": None}
    done = subprocess.run(
        command("play", str(write_scene(tmp_path, AT_REST))),
        env=environment(DISPLAY=display, SDL_VIDEODRIVER=driver, **hidden),
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )
    assert done.returncode == 1
    assert done.stdout == ""
    (line,) = done.stderr.splitlines()
    assert line.startswith("cannot open a window: ")


def test_missing_audio_shows_a_warning_and_the_window_stays_open(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)), SDL_AUDIODRIVER="none-such")
    window.key("m")
    warned = window.wait_until(lambda shot: count_pixels(shot, ORANGE, MESSAGES) > 30, "a warning")
    window.wait_until(lambda shot: are_different(shot, warned), "the scene running")
    assert window.stderr_text() == ""


def test_diverging_scene_shows_an_error_and_the_window_stays_open(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, LEAVING)))
    window.wait_until(lambda shot: count_pixels(shot, WARNING, MESSAGES) > 30, "an error message")
    ended = window.step_number()
    assert ended > 0
    assert window.step_number() == ended
    window.key("comma")
    assert window.step_number() == ended - 1
    assert window.stderr_text() == ""


def test_unsupported_edit_shows_a_warning_and_the_window_stays_open(drive: OpenWindow, tmp_path: Path) -> None:
    path = write_scene(tmp_path, AT_REST)
    window = drive("play", str(path), "--paused", "--engine", "exact")
    window.mouse(on_screen(window_layout(path).camera, (1.0, 0.0)))
    window.key("shift+b")
    window.wait_until(
        lambda shot: count_pixels(shot, ORANGE, MESSAGES) > 30, "a warning that the exact engine has no boxes"
    )
    window.key("o")
    assert window.step_number() == 1
    assert window.session().actions == ()


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (("play", "none-such"), "none-such: "),
        (("play", "room.toml", "--engine", "none-such"), "--engine: "),
        (("play", "room.toml", "--set", "ball.a.radius=-1"), "room.toml: ball.a.radius (set): "),
        (("play", "--set", "world.seed=2"), "--set: "),
        (("play", "room.toml", "--size", "none"), "sandbox play: "),
        (("play", "room.toml", "--record", "no/where.json"), "--record: "),
        (("play", "faulty.toml"), "faulty.toml:3: ball.a.position"),
        (("replay", "none-such"), "none-such: "),
        (("replay", "room.toml"), "room.toml: "),
        (("replay", "."), ".: "),
    ],
)
def test_invalid_input_is_a_one_line_error(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    line: str,
) -> None:
    write_scene(tmp_path, AT_REST)
    write_scene(tmp_path, '[[ball]]\nname = "a"\nposition = [0.0]\nradius = 1.0\n', "faulty.toml")
    monkeypatch.chdir(tmp_path)
    assert call(list(arguments)) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1
    assert err.startswith(line)
