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
from tests.driven.driving import SIZE, Driven, Play
from tests.driven.looking import count, middle, near, on_screen, paused
from tests.driven.rooms import FALLING, MOVING, written

pytestmark = pytest.mark.full  # a window or a film

AREA = pygame.Rect(0, SIZE[1] - TIMELINE_HEIGHT, SIZE[0] - PANEL_WIDTH, TIMELINE_HEIGHT)
WITHIN = 2.0  # px: the mean over the pixels of a disc whose rim is antialiased


def stored(folder: Path, text: str) -> RecordedRun:
    """Run a scene, store the run as `run.npz`, and return it as it is shown."""
    run = sandbox.run(sandbox.load(written(folder, text)))
    run.save(folder / "run.npz")
    return RecordedRun(run)


def seen_by(film: RecordedRun) -> Camera:
    return Camera.fitting(view_bounds(film.scene), SIZE, inset=PANEL_WIDTH, foot=TIMELINE_HEIGHT)


def ball_at(window: Driven, film: RecordedRun, time: float) -> None:
    """Wait until the ball is seen where it was at a time, s."""
    x, y = film.frame(time).position[0].tolist()
    place = on_screen(seen_by(film), (x, y))
    window.wait_until(lambda shot: near(middle(shot, SKY), place, WITHIN), f"the ball as it was at {time:g} s")


@pytest.mark.slow
def test_stored_run_is_played_to_its_end_and_scrubbed_by_clicks(drive: Play, tmp_path: Path) -> None:
    film = stored(tmp_path, MOVING)
    window = drive("replay", "run.npz")
    ball_at(window, film, film.duration)
    bar = Timeline()
    bar.draw(pygame.Surface(SIZE), AREA, 0.0, film.duration, film.duration)
    for share in (0.5, 0.3):
        place = round(AREA.left + share * AREA.width), AREA.centery
        time = bar.handle_event(pygame.event.Event(pygame.MOUSEBUTTONDOWN, pos=place, button=1), AREA)
        assert time is not None
        window.click(place)
        ball_at(window, film, time)
        assert paused(window.shot())
    window.click((AREA.left + 2, AREA.centery))
    ball_at(window, film, 0.0)
    window.key("o", "o")
    ball_at(window, film, 2 * film.scene.solver.dt)
    window.key("comma")
    ball_at(window, film, film.scene.solver.dt)


@pytest.mark.slow
def test_stored_run_cannot_be_changed_and_says_so(drive: Play, tmp_path: Path) -> None:
    stored(tmp_path, MOVING)
    window = drive("replay", "run", "--paused", "--record", "all.json")
    for key in ("e", "g", "ctrl+l"):
        window.key(key)
    window.key("ctrl+s")
    window.wait_for(lambda: "a stored run is already saved" in window.said(), "that it is stored")
    assert paused(window.shot())
    window.key("Escape")
    assert window.status() == 1
    assert window.complained() == "--record: all.json: there is no session to save\n"


@pytest.mark.slow
def test_stored_run_is_the_ghost_of_another_engine(drive: Play, tmp_path: Path) -> None:
    film = stored(tmp_path, FALLING)
    window = drive("replay", "run.npz", "--engine", "reference", "--paused")
    window.key(*["o"] * 8)
    assert window.step_number() == 8
    camera = seen_by(film)
    x, y = film.frame(0.8).position[0].tolist()
    ghost = on_screen(camera, (x, y))
    ring = pygame.Rect(0, 0, 9, 9)
    ring.center = round(ghost[0]), round(ghost[1] - 0.5 * camera.scale)
    window.wait_until(lambda shot: count(shot, INK, ring) > 5, "the top of the ghost's ring")
    session = window.session()
    assert session.engine == "reference"


def test_session_is_replayed_pauses_at_its_end_and_goes_on(drive: Play, tmp_path: Path) -> None:
    window = drive("play", str(written(tmp_path, MOVING)), "--paused")
    window.key("o", "o", "n")
    window.click((window.size[0] // 2, 450))
    window.key("o", "o", "o")
    session = window.session()
    window.key("Escape")
    assert window.status() == 0

    window = drive("replay", "sandbox-room-1.json")
    window.wait_until(paused, "the end of what was recorded")
    again = window.session()
    assert "session: sandbox-Moving-1.json" in window.said()  # a replay has no scene file: its title it is
    assert again.duration == session.duration
    assert again.state_hash == session.state_hash
    window.key("p")
    window.wait_for(lambda: window.session().duration > session.duration, "it going on")
    assert window.title() == "Moving - sandbox"
