"""Plots of shots: maps of rest positions, and aims coloured by pocketed balls."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from sandbox.measure.shots.shot import Spread, shot_setup
from sandbox.measure.shots.study import ShotStudy, study_shot
from sandbox.report.shots_plot import draw_aims, draw_rests, plot_shots
from sandbox.scene.files.load import loads

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact`

FLOOR = "[surface]\nsliding_friction = 0.2\nrolling_friction = 0.01\nspinning_friction = 0.01\n"
WALLS = "[[wall]]\npoints = [[-0.5, -0.5], [1.5, -0.5], [1.5, 0.5], [-0.5, 0.5]]\nclosed = true\nrestitution = 0.8\n"
CUE = '[[ball]]\nname = "cue"\nposition = [0, 0]\nradius = 0.03\nrestitution = 1\n'
OBJECT = '[[ball]]\nname = "$8$"\nposition = [0.5, 0]\nradius = 0.03\nrestitution = 1\n'
HOLE = '[[pocket]]\nname = "hole"\nposition = [1.2, 0]\nradius = 0.06\n'
SHOT = "[[shot]]\naim = 0\nspeed = 2\n"


def studied(*parts: str, pots: tuple[tuple[str, str], ...] = ()) -> ShotStudy:
    attempt = shot_setup(loads(FLOOR + "".join(parts) + SHOT))
    return study_shot(attempt, Spread(0.005, 0.05), count=300, pots=pots)


def meshes(figure: Figure) -> list[QuadMesh]:
    return [each for panel in figure.axes for each in panel.collections if isinstance(each, QuadMesh)]


def test_every_resting_ball_counts_in_its_map() -> None:
    found = studied(WALLS, CUE, OBJECT, HOLE)
    maps = meshes(draw_rests(found.odds))[:2]
    rests = found.odds.batch.pocket < 0
    counts = [int(np.ma.filled(np.ma.asarray(each.get_array()), 0.0).sum()) for each in maps]
    assert counts == [int(rests[:, k].sum()) for k in (0, 1)]
    assert 0 < counts[1] < 300


def test_every_potting_aim_is_coloured() -> None:
    found = studied(WALLS, CUE, OBJECT, HOLE, pots=(("$8$", "hole"),))
    _, lower = draw_aims(found).axes
    (image,) = lower.images
    potted = np.asarray(image.get_array())[1] == 0
    low, high, _, _ = image.get_extent()
    (window,) = found.windows[0].found
    assert potted.mean() * (high - low) == pytest.approx(
        2e3 * window.half, abs=0.1
    )  # mrad; the spacing of shots is smaller
    assert [label.get_text() for label in lower.get_yticklabels()] == ["cue", "$8$"]


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    "parts", [(CUE,), (CUE, HOLE), (CUE, OBJECT), (WALLS, CUE, OBJECT, HOLE)], ids=["lone", "hole", "open", "table"]
)
def test_pictures_are_written_for_any_parts_of_a_floor(parts: tuple[str, ...], tmp_path: Path) -> None:
    found = studied(*parts)
    files = plot_shots(found, tmp_path)
    assert [file.name for file in files] == ["rests.png", "aims.png"]
    assert all(file.stat().st_size > 5_000 for file in files)


def test_ball_that_is_always_pocketed_has_an_empty_map(tmp_path: Path) -> None:
    near = HOLE.replace("1.2", "0.4")
    found = studied(CUE, near)
    assert found.odds.rest("cue") is None
    plot_shots(found, tmp_path)
