"""Films of games with lamps: frames of a stored run show the lamps that were lit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sandbox.games.players import PlayerSpec
from sandbox.measure.run.runner import run
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import load
from sandbox.trajectory import Trajectory
from sandbox.window.camera import Camera
from sandbox.window.capture.export import RunRenderer
from sandbox.window.capture.image_files import offscreen, rgb_pixels
from sandbox.window.playback.recorded import RecordedRun
from sandbox.window.render.lamps import RADIUS

CLASSIC = Path(__file__).parents[3] / "scenes" / "pinball" / "classic.toml"


@pytest.fixture(scope="module")
def stored_run() -> Trajectory:
    scene = load(CLASSIC, ("world.duration=8.0",))
    return run(scene, audit=False, bout=PlayerSpec("skilled").start_game(scene))


@pytest.mark.full
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
    assert distance.max() <= 6.5 * RADIUS * camera.scale + 2.0  # within the radius of the glow


def test_invalid_lamp_records_are_an_error(stored_run: Trajectory) -> None:
    info = stored_run.info | {"game": stored_run.info["game"] | {"lamps": [["never", 3]]}}
    with pytest.raises(SceneError, match=r"info\.game: invalid lamp record"):
        RecordedRun(replace(stored_run, info=info))
