"""`sandbox replay`: stored runs and recorded sessions, in a real window."""

from pathlib import Path

import pygame
import pytest

import sandbox
from sandbox.window.camera import Camera
from sandbox.window.playback.recorded import RecordedRun
from sandbox.window.render.palette import INK, SKY
from sandbox.window.ui.panel import PANEL_WIDTH
from sandbox.window.ui.timeline import TIMELINE_HEIGHT, Timeline
from sandbox.window.view_bounds import view_bounds
from tests.driven.driving import SIZE, DrivenWindow, OpenWindow
from tests.driven.looking import centroid, count_pixels, is_near, on_screen, shows_paused
from tests.driven.rooms import FALLING, MOVING, write_scene

pytestmark = pytest.mark.full  # a window or a film

AREA = pygame.Rect(0, SIZE[1] - TIMELINE_HEIGHT, SIZE[0] - PANEL_WIDTH, TIMELINE_HEIGHT)
WITHIN = 2.0  # px: the mean over the pixels of a disc whose rim is antialiased


def store_run(folder: Path, text: str) -> RecordedRun:
    """Run a scene, store the run as `run.npz`, and return it as the window plays it."""
    run = sandbox.run(sandbox.load(write_scene(folder, text)))
    run.save(folder / "run.npz")
    return RecordedRun(run)


def replay_camera(film: RecordedRun) -> Camera:
    return Camera.fitting(view_bounds(film.scene), SIZE, inset=PANEL_WIDTH, foot=TIMELINE_HEIGHT)


def wait_for_ball(window: DrivenWindow, film: RecordedRun, time: float) -> None:
    """Wait until the window shows the ball at its position of a time, s."""
    x, y = film.frame(time).position[0].tolist()
    point = on_screen(replay_camera(film), (x, y))
    window.wait_until(lambda shot: is_near(centroid(shot, SKY), point, WITHIN), f"the ball of {time:g} s")


@pytest.mark.slow
def test_stored_run_plays_to_its_end_and_clicks_seek(drive: OpenWindow, tmp_path: Path) -> None:
    film = store_run(tmp_path, MOVING)
    window = drive("replay", "run.npz")
    wait_for_ball(window, film, film.duration)
    bar = Timeline()
    bar.draw(pygame.Surface(SIZE), AREA, 0.0, film.duration, film.duration)
    for fraction in (0.5, 0.3):
        point = round(AREA.left + fraction * AREA.width), AREA.centery
        time = bar.handle_event(pygame.event.Event(pygame.MOUSEBUTTONDOWN, pos=point, button=1), AREA)
        assert time is not None
        window.click(point)
        wait_for_ball(window, film, time)
        assert shows_paused(window.shot())
    window.click((AREA.left + 2, AREA.centery))
    wait_for_ball(window, film, 0.0)
    window.key("o", "o")
    wait_for_ball(window, film, 2 * film.scene.solver.dt)
    window.key("comma")
    wait_for_ball(window, film, film.scene.solver.dt)


@pytest.mark.slow
def test_stored_run_cannot_be_changed_or_saved_as_a_session(drive: OpenWindow, tmp_path: Path) -> None:
    store_run(tmp_path, MOVING)
    window = drive("replay", "run", "--paused", "--record", "all.json")
    for key in ("e", "g", "ctrl+l"):
        window.key(key)
    window.key("ctrl+s")
    window.wait_for(lambda: "a stored run is already saved" in window.stdout_lines(), "the message")
    assert shows_paused(window.shot())
    window.key("Escape")
    assert window.exit_status() == 1
    assert window.stderr_text() == "--record: all.json: there is no session to save\n"


@pytest.mark.slow
def test_stored_run_is_shown_as_ghost_of_another_engine(drive: OpenWindow, tmp_path: Path) -> None:
    film = store_run(tmp_path, FALLING)
    window = drive("replay", "run.npz", "--engine", "reference", "--paused")
    window.key(*["o"] * 8)
    assert window.step_number() == 8
    camera = replay_camera(film)
    x, y = film.frame(0.8).position[0].tolist()
    ghost = on_screen(camera, (x, y))
    ring = pygame.Rect(0, 0, 9, 9)
    ring.center = round(ghost[0]), round(ghost[1] - 0.5 * camera.scale)
    window.wait_until(lambda shot: count_pixels(shot, INK, ring) > 5, "the top of the ghost's ring")
    session = window.session()
    assert session.engine == "reference"


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
    assert replayed.duration == session.duration
    assert replayed.state_hash == session.state_hash
    window.key("p")
    window.wait_for(lambda: window.session().duration > session.duration, "the continued session")
    assert window.title() == "Moving - sandbox"
