"""A real window in real time: start and end, input by keys and mouse, files, the editor, a game and a replay.

Tests in `tests/window` show the details in one process, by events as SDL sends them. These show that events of a real X
server arrive, that pictures reach the screen, and that a process ends as it should.
"""

import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sandbox.action import Pull
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.files.load import load
from sandbox.window.app import EMPTY_VIEW
from sandbox.window.camera import Camera
from sandbox.window.mouse import ZOOM_PER_NOTCH
from sandbox.window.render.palette import BACKGROUND, ORANGE, SKY, WARNING
from sandbox.window.ui.scroll_column import COLUMN_WIDTH
from sandbox.window.ui.timeline import TIMELINE_HEIGHT
from tests.driven.driving import LIMIT, SCREEN, SIZE, DrivenWindow, OpenWindow, Shot, command, environment
from tests.driven.looking import (
    HUD,
    MESSAGES,
    are_different,
    centroid,
    colour_at,
    count_pixels,
    is_near,
    on_screen,
    shows_paused,
    window_camera,
)
from tests.driven.rooms import AT_REST, BALL_START, MOVING, write_scene
from tests.driven.xclient import XClient

pytestmark = pytest.mark.fail_slow(45)  # opens one or two windows in other processes: 2 to 13 s measured on busy cores

TARGET = (1.2, 0.4)
WITHIN = 2.0  # px: the mean over the pixels of a disc whose rim is antialiased
WITHIN_COVERED = 6.0  # px: the line to the mouse and the text of the picked ball cover some of its pixels


def wait_for_ball(window: DrivenWindow, camera: Camera, what: str, within: float = WITHIN) -> Shot:
    """Wait until the ball at rest is drawn where a camera projects its start."""
    return window.wait_until(lambda shot: is_near(centroid(shot, SKY), on_screen(camera, BALL_START), within), what)


def test_scene_runs_and_its_film_and_session_are_saved_at_the_end(drive: OpenWindow, tmp_path: Path) -> None:
    record = tmp_path / "all.json"
    window = drive("play", str(write_scene(tmp_path, MOVING)), "--record", str(record))
    first = window.shot()
    window.wait_until(lambda shot: are_different(shot, first), "the scene running")
    assert window.title() == "Moving - sandbox"
    window.key("ctrl+r")
    window.wait_until(lambda shot: count_pixels(shot, WARNING, HUD) > 60, "recording")
    begun = window.step_number()
    window.wait_for(lambda: window.step_number() > begun + 10, "a few pictures")
    window.key("Escape")
    assert window.exit_status() == 0
    session_line, film_line = window.stdout_lines()[-2:]
    assert session_line == f"session: {record}"
    assert film_line.startswith("recorded: sandbox-room-1.gif")  # a slow machine adds the pictures a second
    with Image.open(tmp_path / "sandbox-room-1.gif") as film:
        assert film.size[0] < SIZE[0] and film.size[1] < SIZE[1]  # the scene alone, without panel and time line
        assert getattr(film, "n_frames", 1) > 1
    session = Recording.load(record)
    assert session.duration > 0.1
    assert rerun(session).info["state_hash"] == session.state_hash


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
    assert (done.returncode, done.stdout) == (1, "")
    (line,) = done.stderr.splitlines()
    assert line.startswith("cannot open a window: ")


def test_window_without_a_scene_opens_the_typed_one_and_is_closed_by_its_button(
    drive: OpenWindow, display: str
) -> None:
    window = drive("play")
    assert window.title() == "sandbox"
    window.key("Escape", "p", "e", "comma", "ctrl+s")  # no scene is open: all of these do nothing
    window.wait_for(lambda: window.stdout_lines() == ["no session to save"], "the message")
    window.key("ctrl+o")
    window.wait_until(lambda shot: colour_at(shot, (896, 300)) == BACKGROUND, "the picker")
    window.type("two balls")
    window.key("Return")
    window.wait_for(lambda: window.title() == "Two balls - sandbox", "the scene")
    with XClient(display) as client:
        client.ask_to_close(window.window)
    assert window.exit_status() == 0
    assert window.stderr_text() == ""


def test_missing_audio_shows_a_warning_and_the_window_stays_open(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)), SDL_AUDIODRIVER="none-such")
    window.key("m")
    warned = window.wait_until(lambda shot: count_pixels(shot, ORANGE, MESSAGES) > 30, "a warning")
    window.wait_until(lambda shot: are_different(shot, warned), "the scene running")
    assert window.stderr_text() == ""


def test_mouse_moves_the_camera_and_home_resets_it(drive: OpenWindow, tmp_path: Path) -> None:
    path = write_scene(tmp_path, AT_REST)
    home = window_camera(path)
    window = drive("play", str(path))
    first = wait_for_ball(window, home, "the ball")
    window.wheel(on_screen(home, BALL_START), 1)
    zoomed = window.wait_until(lambda shot: count_pixels(shot, SKY) > 1.2 * count_pixels(first, SKY), "a larger ball")
    assert is_near(centroid(zoomed, SKY), on_screen(home, BALL_START), WITHIN)  # the point under the cursor is fixed
    window.key("Home")
    wait_for_ball(window, home, "the ball at its first position")
    window.wheel((400, 300), -2)
    camera = home.zoomed(ZOOM_PER_NOTCH**-2, (400, 300))
    wait_for_ball(window, camera, "a smaller ball")
    window.drag((400, 300), (440, 330), button=3)
    wait_for_ball(window, camera.panned((40, 30)), "the ball panned")
    window.key("Home")
    for size in ((20, 10), (1024, 700), SIZE):
        window.resize(*size)
        window.session()
    wait_for_ball(window, home, "the ball at its first position")


def test_dragged_ball_follows_the_mouse_until_it_is_released_or_the_focus_is_lost(
    drive: OpenWindow, display: str, tmp_path: Path
) -> None:
    path = write_scene(tmp_path, AT_REST)
    camera = window_camera(path)
    window = drive("play", str(path))
    wait_for_ball(window, camera, "the ball at its start")
    start, target = on_screen(camera, BALL_START), on_screen(camera, TARGET)
    window.press_and_move(start, target)
    window.wait_until(lambda shot: is_near(centroid(shot, SKY), target, WITHIN_COVERED), "the ball at the mouse")
    window.release()
    session = window.session()
    pulls = [action for action in session.actions if isinstance(action, Pull)]
    assert pulls[0].target == pytest.approx(BALL_START, abs=1 / camera.scale)  # a pixel
    assert pulls[-1].target is None
    # The drag is a critically damped spring: it has converged to within the accuracy of the picture.
    assert rerun(session).position[-1, 0] == pytest.approx(TARGET, abs=WITHIN_COVERED / camera.scale)

    window.press_and_move(target, start)
    pulled = window.wait_until(lambda shot: is_near(centroid(shot, SKY), start, WITHIN_COVERED), "the ball back")
    with XClient(display) as client:
        client.take_focus_away()
    window.wait_until(lambda shot: are_different(shot, pulled), "the mark of the drag gone")
    window.mouse(target)
    window.focus()
    last = window.session().actions[-1]
    assert isinstance(last, Pull)
    assert last.target is None


def test_screenshot_file_equals_the_displayed_picture(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)), "--paused")
    window.wait_until(shows_paused, "PAUSED")
    shot = window.shot()
    window.key("ctrl+p")
    window.wait_for(lambda: "screenshot: sandbox-room-1.png" in window.stdout_lines(), "the file")
    with Image.open(tmp_path / "sandbox-room-1.png") as image:
        assert image.size == SIZE
        picture = np.asarray(image.convert("RGB"))
    rate = np.s_[:30, 560:636]  # the displayed frame rate may have changed meanwhile
    changed = (picture != shot).any(axis=2)
    changed[rate] = False
    assert not changed.any()


def test_scene_is_drawn_run_edited_and_saved(drive: OpenWindow, tmp_path: Path) -> None:
    camera = Camera.fitting(EMPTY_VIEW, SIZE, inset=COLUMN_WIDTH, foot=TIMELINE_HEIGHT)  # of a new scene

    def is_drawn(shot: Shot, colour: tuple[int, int, int], area: float) -> bool:
        """Return whether a colour covers about an area, m²; edges and marks cover some of it."""
        found = count_pixels(shot[:, 60 : SIZE[0] - COLUMN_WIDTH], colour)
        return 0.5 * area * camera.scale**2 < found < 1.6 * area * camera.scale**2

    window = drive("play", "--edit")
    window.key("x")
    window.drag(on_screen(camera, (-1.0, 1.0)), on_screen(camera, (1.0, 2.0)))
    window.wait_until(lambda shot: is_drawn(shot, SKY, 2.0), "a box")
    window.key("b")
    window.drag(on_screen(camera, (0.0, 3.6)), on_screen(camera, (0.6, 3.6)))
    window.wait_until(
        lambda shot: is_drawn(shot, SKY, 2.0) and is_drawn(shot, ORANGE, 1.1),
        "a ball in the second colour, and the box still in the first one",
    )
    window.key("space")
    on_ground = on_screen(camera, (0.8, 0.2))  # a place that the box reaches when it falls
    window.wait_until(lambda shot: colour_at(shot, on_ground) == SKY, "a box that has fallen")
    window.key("ctrl+e")
    window.wait_until(lambda shot: is_drawn(shot, SKY, 2.0) and is_drawn(shot, ORANGE, 1.1), "the scene as edited")
    window.key("ctrl+s", "ctrl+a")
    window.type("drawn")
    window.key("Return")
    path = tmp_path / "drawn.toml"
    window.wait_for(path.exists, "the saved file")
    scene = load(path)
    pixel = 1.0 / camera.scale
    assert scene.boxes[0].size == pytest.approx((2.0, 1.0), abs=2 * pixel)
    assert scene.balls[0].position == pytest.approx((0.0, 3.6), abs=2 * pixel)  # the grid is 0.2 m
    window.wait_for(lambda: any("saved" in line for line in window.stdout_lines()), "a line on the terminal")
    window.key("Escape", "Escape", "Escape")  # the selected ball, the tool, and the window
    assert window.exit_status() == 0
    assert [each.name for each in tmp_path.iterdir() if "autosave" in each.name] == []


def test_keys_fly_the_lander_and_the_session_replays_the_game(drive: OpenWindow) -> None:
    window = drive("play", "landing")
    assert window.step_number() == 0
    window.hold("Up")  # ignored: the game has not begun
    window.release_key("Up")
    window.key("space")
    window.wait_for(window.step_number, "the game")
    assert not window.session().presses
    window.hold("Up")
    window.wait_for(lambda: window.session().presses, "the engine")
    window.release_key("Up")
    window.wait_for(lambda: len(window.session().presses) == 2, "the engine stopped")
    session = window.session()
    assert [(press.control, press.value) for press in session.presses] == [("engine", 1.0), ("engine", 0.0)]
    run = rerun(session)
    assert run.info["state_hash"] == session.state_hash
    assert run.info["game"]["score"] == session.score == 0
    assert run.info["game"]["otherwise"] is None


@pytest.mark.usefixtures("russian_display")
def test_keys_of_a_game_work_by_their_place_on_a_russian_keyboard(drive: OpenWindow) -> None:
    """Keys are given by the numbers that X has for them: on this layout, xdotool finds none that types `z`."""
    z_key, slash_key, save = "52", "61", "ctrl+39"
    window = drive("play", "pinball/classic")
    window.key("space")
    window.wait_for(lambda: window.session(save).duration, "the game")
    for number in (z_key, slash_key):
        window.hold(number)
        window.release_key(number)
    pressed = [(press.control, press.value) for press in window.session(save).presses]
    assert pressed == [(f"{side} flipper", level) for side in ("left", "right") for level in (1.0, 0.0)]
    before = window.session(save).duration
    window.wait_for(lambda: window.session(save).duration > before, "the game, which `/` has not paused")


def test_text_is_copied_from_one_window_to_another(drive: OpenWindow, tmp_path: Path) -> None:
    """The path of `save as`, which is selected as a whole by Ctrl+A, goes through the clipboard of the X server."""
    path = write_scene(tmp_path, AT_REST)
    first = drive("play", "--edit", str(path))
    first.key("ctrl+shift+s", "ctrl+a", "ctrl+c", "End", "BackSpace", "ctrl+z", "Escape", "ctrl+s")
    first.wait_for(first.stdout_lines, "the saved file: all keys before have been handled")
    first.move((SCREEN[0], 0))  # the screenshots of the second would show it
    second = drive("play", "--edit")
    second.key("ctrl+s", "ctrl+a", "ctrl+v", "Home", "Delete", "ctrl+z", "Return", "Return")  # it exists: asks once
    second.wait_for(lambda: "Rest" not in path.read_text(), "the new scene in the file whose path was copied")
    assert "[world]" in path.read_text()


def test_session_replay_pauses_at_its_end_and_can_be_continued(drive: OpenWindow, tmp_path: Path) -> None:
    window = drive("play", str(write_scene(tmp_path, MOVING)), "--paused")
    window.key("o", "o", "n")
    window.click((window.size[0] // 2, 450))
    window.key("o", "o", "o")
    session = window.session()
    window.key("Escape")
    assert window.exit_status() == 0

    window = drive("replay", "sandbox-room-1.json")
    window.wait_until(shows_paused, "the end of the recording")
    replayed = window.session()
    assert "session: sandbox-Moving-1.json" in window.stdout_lines()  # a replay has no scene file: named by its title
    assert (replayed.duration, replayed.state_hash) == (session.duration, session.state_hash)
    window.key("p")
    window.wait_for(lambda: window.session().duration > session.duration, "the continued session")
    assert window.title() == "Moving - sandbox"
