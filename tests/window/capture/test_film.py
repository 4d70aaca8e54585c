"""Films of stored runs: interpolated states, snapshots, and pixels at the positions of the run."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sandbox.action import Action, Move, Remove, Spawn
from sandbox.games.players import PlayerSpec
from sandbox.measure.run.runner import run
from sandbox.scene.description.discs import Ball
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import load, loads
from sandbox.trajectory import Trajectory
from sandbox.window.camera import Camera
from sandbox.window.capture.export import RunRenderer, frame_times
from sandbox.window.capture.image_files import offscreen, rgb_pixels
from sandbox.window.playback.recorded import CONTACT_DURATION, RecordedRun, bodies_of_run, scene_of_run
from sandbox.window.playback.snapshot import OVERLAYS
from sandbox.window.render.lamps import LAMP_RADIUS
from sandbox.window.render.palette import BACKGROUND, SKY
from sandbox.window.view_bounds import crowd_bounds
from tests.toml_text import toml

FALL = (
    toml(title="Fall")
    + toml("world", gravity=[0, -10], duration=1.0)
    + toml("solver", dt=0.1)
    + toml("ball", name="a", position=[0, 0], velocity=[2, 0], angular_velocity=3, radius=0.5)
    + toml("ball", name="b", position=[5, 0], velocity=[2, 0], radius=0.5)
)

BOUNCE = (
    toml("world", gravity=[0, -10], duration=1.0)
    + toml("plane", point=[0, 0], normal=[0, 1])
    + toml("ball", position=[0, 1], radius=0.5, restitution=1)
)


def film_of(text: str = FALL, *actions: Action) -> RecordedRun:
    return RecordedRun(run(loads(text), actions=actions))


def test_frames_at_stored_times_equal_the_stored_states() -> None:
    film = film_of()
    stored = film.trajectory
    for k, time in enumerate(stored.time.tolist()):
        frame = film.frame(time)
        assert frame.time == time
        assert np.array_equal(frame.position, stored.position[k])
        assert np.array_equal(frame.velocity, stored.velocity[k])
        assert np.array_equal(frame.angle, stored.angle[k])
        assert frame.present.all()


def test_frames_between_stored_times_interpolate_position_and_angle() -> None:
    film = film_of()
    stored = film.trajectory
    frame = film.frame(0.325)
    middle = stored.position[3] + 0.25 * (stored.position[4] - stored.position[3])
    assert frame.position == pytest.approx(middle, rel=1e-12)  # a few roundings of 0.325, 0.3 and 0.4
    assert frame.angle[0] == pytest.approx(3 * 0.325, rel=1e-12)  # as above
    assert frame.velocity[0] == pytest.approx((2, -3.25), rel=1e-12)  # as above
    assert np.array_equal(film.frame(-1.0).position, stored.position[0])
    assert np.array_equal(film.frame(99.0).position, stored.position[-1])


def test_removed_body_is_present_until_its_removal() -> None:
    film = film_of(FALL, Remove(time=0.45, body="b"))
    stored = film.trajectory
    retired = float(stored.retired_time[1])
    assert retired == pytest.approx(0.5)
    before, after = film.frame(retired - 0.01), film.frame(retired + 0.01)
    assert before.present.tolist() == [True, True]
    assert np.array_equal(before.position[1], stored.position[4, 1])
    assert after.present.tolist() == [True, False]
    assert after.velocity[1].tolist() == [0.0, 0.0]
    assert after.position[0] != pytest.approx(stored.position[5, 0], abs=1e-3)  # m: the other one keeps moving


def test_spawned_body_is_absent_before_its_spawn() -> None:
    film = film_of(FALL, Spawn(time=0.2, ball=Ball(position=(3.0, 3.0), radius=0.25)))
    assert film.bodies.names == ("a", "b", "spawned-3")
    assert film.bodies.radius.tolist() == [0.5, 0.5, 0.25]
    first = int(np.flatnonzero(np.isfinite(film.trajectory.position[:, 2, 0]))[0])
    earlier, time = film.trajectory.time[first - 1 : first + 1].tolist()
    assert film.frame((earlier + time) / 2).present.tolist() == [True, True, False]
    assert film.frame(time).present.all()


def test_moved_body_jumps_without_interpolation() -> None:
    film = film_of(FALL, Move(time=0.3, body="a", position=(50.0, 0.0)))
    jump = int(np.argmax(np.abs(np.diff(film.trajectory.position[:, 0, 0]))))
    time = float(film.trajectory.time[jump]) + 0.05
    frame = film.frame(time)
    assert np.array_equal(frame.position[0], film.trajectory.position[jump, 0])
    assert frame.position[1] == pytest.approx(film.trajectory.position[jump : jump + 2, 1].mean(axis=0))


def test_body_with_a_state_that_is_not_finite_is_absent() -> None:
    stored = run(loads(FALL))
    position = stored.position.copy()
    position[5:, 0] = np.nan, np.inf
    film = RecordedRun(replace(stored, position=position))
    assert film.frame(0.44).present.all()
    assert np.array_equal(film.frame(0.44).position[0], position[4, 0])
    assert film.frame(0.55).present.tolist() == [False, True]


@pytest.mark.parametrize(
    ("start", "end", "fps", "speed", "count"),
    [(0.0, 3.0, 30.0, 1.0, 90), (0.5, 1.0, 24.0, 0.25, 48), (0.0, 1.0, 30.0, 4.0, 7), (1.0, 1.0, 30.0, 1.0, 1)],
)
def test_frame_times_are_multiples_of_one_over_fps_and_fill_the_duration(
    start: float, end: float, fps: float, speed: float, count: int
) -> None:
    times, shown = frame_times(start, end, fps, speed)
    assert len(times) == len(shown) == count
    assert times == pytest.approx(start + np.arange(count) / fps * speed, rel=1e-14)  # a few roundings
    assert shown[:-1] == pytest.approx(1 / fps, rel=1e-14)  # as above
    assert shown.sum() == pytest.approx((end - start) / speed or 1 / fps, rel=1e-12)  # of up to 90 roundings


def test_contacts_are_shown_for_the_contact_duration() -> None:
    film = film_of(BOUNCE)
    (first, *_) = film.trajectory.contact_time.tolist()
    everything = frozenset(OVERLAYS)
    assert len(film.snapshot(first - 1e-6, everything).contacts) == 0
    assert film.snapshot(first, everything).contacts.time.tolist() == [first]
    assert len(film.snapshot(first + 0.9 * CONTACT_DURATION, everything).contacts) == 1
    assert len(film.snapshot(first + 1.1 * CONTACT_DURATION, everything).contacts) == 0
    assert len(film.snapshot(first + 0.5 * CONTACT_DURATION, everything, speed=0.25).contacts) == 0


def test_trails_end_at_the_current_positions() -> None:
    film = film_of(FALL, Remove(time=0.45, body="b"))
    past, now = film.snapshot(0.75, frozenset({"trails"})).trails
    assert np.array_equal(past[:, 0], film.trajectory.position[: len(past), 0])
    assert len(past) == 8
    assert np.isnan(past[5:, 1]).all()
    assert np.isnan(now[0, 1]).all()
    assert np.array_equal(now[0, 0], film.frame(0.75).position[0])
    assert film.snapshot(0.75, frozenset({"shapes"})).trails == ()


def test_missed_contact_flashes_at_its_position() -> None:
    text = (
        "[world]\nduration = 0.1\n[solver]\ndt = 0.01\n[[wall]]\npoints = [[1, -1], [1, 1]]\n"
        "[[ball]]\nposition = [0.5, 0]\nvelocity = [90, 0]\nradius = 0.01\n"
    )
    film = film_of(text)
    (missed,) = film.trajectory.missed_time.tolist()
    (flash,) = film.snapshot(missed + 0.02, frozenset()).flashes
    assert flash.age == pytest.approx(0.02)
    assert flash.position == tuple(film.frame(missed).position[0])
    assert film.snapshot(missed - 1e-9, frozenset()).flashes == ()


@pytest.mark.parametrize("time", [0.0, 0.33, 1.0])
def test_body_is_drawn_at_the_position_of_the_run(time: float) -> None:
    film, size = film_of(), (320, 180)
    surface, camera = offscreen(size), Camera.fitting(film.bounds, size)
    RunRenderer(film).draw(surface, camera, time, caption=False)
    pixels = rgb_pixels(surface, size).astype(int)
    x, y = camera.to_screen(film.frame(time).position[0])
    reach = 0.5 * camera.scale
    for dx, dy in ((0.0, 0.6), (-0.6, 0.0), (0.0, -0.6)):  # not on the spoke that shows its angle
        pixel = pixels[int(y + dy * reach), int(x + dx * reach)]
        assert np.abs(pixel - SKY).max() <= 40  # of 255: a disc may be shaded
    for dx, dy in ((1.3, 0.0), (-1.3, 0.0), (0.0, 1.3), (0.0, -1.3)):
        column, row = int(x + dx * reach), int(y + dy * reach)
        if 0 <= column < size[0] and 0 <= row < size[1]:
            assert np.abs(pixels[row, column] - BACKGROUND).max() <= 40  # of 255: a grid line may be there


def test_caption_changes_only_its_corner() -> None:
    film, size = film_of(), (480, 270)
    camera = Camera.fitting(film.bounds, size)
    pictures = []
    for caption in (False, True):
        surface = offscreen(size)
        RunRenderer(film).draw(surface, camera, 0.5, caption=caption)
        pictures.append(rgb_pixels(surface, size).astype(int))
    rows, columns = np.nonzero(np.abs(pictures[1] - pictures[0]).sum(axis=2))
    assert len(rows) > 100  # a few letters
    assert rows.max() < 60
    assert columns.max() < 240


def test_energy_graph_changes_only_its_corner_at_any_time() -> None:
    film, size = film_of(BOUNCE), (960, 540)
    camera = Camera.fitting(film.bounds, size)
    for time in (1.0, 0.0, 0.5):  # also backwards
        plain, graph = offscreen(size), offscreen(size)
        RunRenderer(film).draw(plain, camera, time)
        RunRenderer(film).draw(graph, camera, time, frozenset({"shapes", "energy"}))
        rows, columns = np.nonzero((rgb_pixels(plain, size) != rgb_pixels(graph, size)).any(axis=2))
        assert rows.min() > 540 / 2
        assert columns.min() > 960 / 2


def test_every_overlay_can_be_drawn() -> None:
    film, size = film_of(BOUNCE, Spawn(time=0.2, ball=Ball(position=(3.0, 3.0), radius=0.25))), (320, 180)
    plain, full = offscreen(size), offscreen(size)
    camera = Camera.fitting(film.bounds, size)
    RunRenderer(film).draw(plain, camera, 0.35)
    RunRenderer(film).draw(full, camera, 0.35, frozenset(OVERLAYS))
    assert not np.array_equal(rgb_pixels(plain, size), rgb_pixels(full, size))


def test_crowd_bounds_contain_few_bodies_and_ignore_outliers_of_many() -> None:
    rng = np.random.default_rng(3)
    position = rng.uniform(-1.0, 1.0, (50, 40, 2))
    low, high = crowd_bounds(position, np.full(40, 0.1), np.empty((0, 2)))
    assert np.array([low, high]) == pytest.approx(
        np.array([position.min(axis=(0, 1)) - 0.1, position.max(axis=(0, 1)) + 0.1])
    )
    position[:, 7] = np.linspace(0.0, 1e6, 50)[:, None]
    position[3, 8], position[9, 9] = np.nan, np.inf
    low, high = crowd_bounds(position, np.full(40, 0.1), np.array([[-1.5, 0.0], [1e9, 0.0]]))
    # 0.05 m: the upper bound is the extreme of 38 random bodies
    assert (low[0], high[0]) == (-1.5, pytest.approx(1.1, abs=0.05))
    single = np.zeros((3, 1, 2))
    single[:, 0, 1] = 0.0, 5.0, 10.0
    assert crowd_bounds(single, np.array([0.5]), np.empty((0, 2))) == ((-0.5, -0.5), (0.5, 10.5))
    assert crowd_bounds(np.empty((1, 0, 2)), np.empty(0), np.empty((0, 2))) == ((-1.0, -1.0), (1.0, 1.0))


def damaged_run(**info: object) -> Trajectory:
    stored = run(loads(FALL))
    return replace(stored, info={**stored.info, **info})


@pytest.mark.parametrize(
    ("info", "path"),
    [
        ({"scene": None}, "info.scene"),
        ({"scene": {"nonsense": 1}}, "nonsense"),
        ({"actions": [{"kind": "nonsense"}]}, "info.actions"),
        ({"scene": {"ball": [{"position": [0, 0], "radius": 1}]}}, "names"),
    ],
)
def test_run_with_missing_or_invalid_info_is_refused(info: dict[str, object], path: str) -> None:
    with pytest.raises(SceneError) as caught:
        RecordedRun(damaged_run(**info), "my run")
    assert {(fault.file, fault.path) for fault in caught.value.faults} == {("my run", path)}


def test_scene_and_bodies_of_a_run_equal_the_original() -> None:
    scene = loads(FALL)
    stored = run(scene)
    assert scene_of_run(stored) == scene
    assert bodies_of_run(stored, scene) is scene.bodies


def test_frame_of_the_same_time_is_cached() -> None:
    film = film_of()
    frame = film.frame(0.123)
    assert film.snapshot(0.123, frozenset(OVERLAYS)).frame is frame
    assert film.frame(0.123) is frame
    other = film.frame(0.2)
    assert other.time == 0.2
    assert film.frame(0.123).state_hash() == frame.state_hash()


def test_contacts_of_a_film_equal_those_of_its_snapshots() -> None:
    film = film_of(BOUNCE)
    (first, *_) = film.trajectory.contact_time.tolist()
    for speed in (0.5, 1.0):
        time = first + 0.75 * CONTACT_DURATION
        found = film.contacts(time, speed)
        assert found.time.tolist() == film.snapshot(time, frozenset(), speed).contacts.time.tolist()
        assert (first in found.time.tolist()) == (speed == 1.0)


CLASSIC = Path(__file__).parents[3] / "scenes" / "pinball" / "classic.toml"


@pytest.fixture(scope="module")
def stored_run() -> Trajectory:
    scene = load(CLASSIC, ("world.duration=8.0",))
    return run(scene, audit=False, bout=PlayerSpec("skilled").start_game(scene))


@pytest.mark.fail_slow(60)  # takes over half a second
def test_frame_of_a_stored_run_shows_its_lit_lamps(stored_run: Trajectory, tmp_path: Path) -> None:
    stored_run.save(tmp_path / "run.npz")
    film = RecordedRun(Trajectory.load(tmp_path / "run.npz"))
    dark = RecordedRun(replace(stored_run, info=stored_run.info | {"game": None}))
    time, names = next((time, names) for time, names in stored_run.info["game"]["lamps"] if names)
    assert film.snapshot(time, frozenset()).lit == frozenset(names)
    lamps = {part.name: part.light for part in film.scene.play.parts}
    pictures = []
    for each in (film, dark):
        surface = offscreen((540, 960))
        camera = Camera.fitting(each.bounds, (540, 960))
        RunRenderer(each).draw(surface, camera, time, caption=False)
        pictures.append(rgb_pixels(surface, (540, 960)).astype(int).sum(axis=2))
    brighter = np.argwhere(pictures[0] > pictures[1])
    assert len(brighter)
    rows_and_columns = camera.to_screen(np.asarray([lamps[name] for name in names]))[:, ::-1]
    distance = np.linalg.norm(brighter[:, None] - rows_and_columns[None], axis=2).min(axis=1)
    assert distance.max() <= 6.5 * LAMP_RADIUS * camera.scale + 2.0  # within the radius of the glow


@pytest.mark.fail_slow(60)  # takes over half a second
def test_invalid_lamp_records_are_an_error(stored_run: Trajectory) -> None:
    info = stored_run.info | {"game": stored_run.info["game"] | {"lamps": [["never", 3]]}}
    with pytest.raises(SceneError, match=r"info\.game: invalid lamp record"):
        RecordedRun(replace(stored_run, info=info))
