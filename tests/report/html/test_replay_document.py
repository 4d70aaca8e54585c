"""Replay documents: the included frames, shapes and bodies, and notes about omitted ones."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sandbox.measure.run.runner import run
from sandbox.report.html import replay as module
from sandbox.report.html.replay import Track, replay_document
from sandbox.report.html.replay_data import ABSENT, decompress
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.trajectory import Trajectory
from tests.toml_text import toml

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

FALL = (
    toml("world", gravity=[0.0, -10.0], duration=1.0)
    + toml("solver", dt=0.001)
    + toml("ball", name="a", position=[1000000.0, 5.0], radius=0.5)
    + toml("box", name="b", position=[1000002.0, 5.0], size=[1.0, 2.0], angular_velocity=1.0)
    + toml("box", name="still", position=[1000001.0, -2.0], size=[4.0, 0.1], fixed=True)
    + toml("joint", name="rod", kind="rod", between=["a", "b"])
)


@pytest.fixture(scope="module")
def fall_run() -> tuple[Scene, Trajectory]:
    scene = loads(FALL, "fall.toml")
    return scene, run(scene, "pymunk", audit=False)


def test_positions_are_restored_as_in_the_run(fall_run: tuple[Scene, Trajectory]) -> None:
    scene, found = fall_run
    document = replay_document(scene, [Track("pymunk", "e0", found)], None)
    time, step = document["time"], document["step"]
    assert len(time) == module.MAX_FRAMES
    assert (time[0], time[-1]) == (0.0, 1.0)
    codes = decompress(document["tracks"][0]["codes"], (len(time), 2, 3))
    frames = [round(t / 0.001) for t in time]
    left = document["view"][0]
    restored = codes[..., :2] * step - document["half"]
    expected = found.position[frames][:, :2]
    # Apart from the origin, positions agree within half a step and the rounding of 1e6 m.
    assert np.ptp(restored - expected, axis=(0, 1)) == pytest.approx(0.0, abs=step + 1e-9)
    assert left < restored[..., 0].min()
    turn = codes[-1, 1, 2] * (2.0 * math.pi / 65536.0)
    assert turn == pytest.approx(found.angle[-1, 1] % (2.0 * math.pi), abs=1e-4)  # half a step of an angle: 4.8e-5
    assert "600 of 1,001 frames" in document["note"]


def test_geometry_has_shapes_fixed_bodies_and_joints(fall_run: tuple[Scene, Trajectory]) -> None:
    scene, found = fall_run
    geometry = replay_document(scene, [Track("pymunk", "e0", found)], None)["geometry"]
    assert geometry["names"] == ["a", "b"]
    assert [len(geometry["shapes"][kind][0]) for kind in geometry["shape"]] == [3, 9]  # radius and corners
    assert len(geometry["solids"]) == 1
    ((_, symbol, a, b, *_),) = geometry["joints"]
    assert (symbol, a, b) == ("rod", 0, 1)


def test_run_that_ends_early_is_absent_later(fall_run: tuple[Scene, Trajectory]) -> None:
    scene, found = fall_run
    short = found.at(list(range(301)))
    tracks = [Track("whole", "e0", found), Track("short", "e1", short)]
    document = replay_document(scene, tracks, None)
    codes = decompress(document["tracks"][1]["codes"], (len(document["time"]), 2, 3))
    absent = codes[:, 0, 0] == ABSENT
    assert absent.tolist() == [t > 0.3011 for t in document["time"]]  # a frame up to half an interval later is present


def test_retired_body_is_absent_and_errors_are_kept(fall_run: tuple[Scene, Trajectory]) -> None:
    scene, found = fall_run
    retired = replace(found, retired_time=np.asarray([0.5, np.nan, np.nan]))
    error = found.time, np.where(found.time < 0.5, 0.125, math.inf)
    document = replay_document(scene, [Track("pymunk", "e0", retired, error)], None)
    codes = decompress(document["tracks"][0]["codes"], (len(document["time"]), 2, 3))
    assert (codes[:, 0, 0] == ABSENT).tolist() == [t >= 0.5 for t in document["time"]]
    assert document["tracks"][0]["errors"] == [0.125 if t < 0.5 else None for t in document["time"]]


def test_subset_of_many_bodies_is_drawn_and_noted() -> None:
    scene = loads(
        "[world]\nduration = 0.05\n[[scatter]]\nname = 'a'\ncount = 5000\nradius = 0.001\n"
        "lower = [0.0, 0.0]\nupper = [10.0, 10.0]\ncollides = 'none'\n",
        "crowd.toml",
    )
    found = run(scene, "pymunk", audit=False)
    document = replay_document(scene, [Track("pymunk", "e0", found)], None)
    assert document["bodies"] == 1667  # every third
    assert "1,667 of 5,000 bodies are drawn" in document["note"]


def test_data_budget_limits_the_number_of_frames(
    fall_run: tuple[Scene, Trajectory], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene, found = fall_run
    monkeypatch.setattr(module, "BUDGET", 100)
    document = replay_document(scene, [Track("pymunk", "e0", found)], None)
    assert len(document["time"]) == module.MIN_FRAMES


def test_bodies_of_a_run_with_a_longer_step_are_shown_between_its_frames(
    fall_run: tuple[Scene, Trajectory],
) -> None:
    scene, fine = fall_run
    coarse = run(scene, "pymunk", audit=False, dt=0.1)
    document = replay_document(scene, [Track("fine", "e0", fine), Track("coarse", "e1", coarse)], None)
    time, step = np.asarray(document["time"]), document["step"]
    codes = decompress(document["tracks"][1]["codes"], (len(time), 2, 3))
    assert (codes[..., 0] != ABSENT).all()
    height = codes[:, 0, 1] * step
    expected = np.interp(time, coarse.time, coarse.position[:, 0, 1])
    assert np.ptp(height - expected) <= step + 1e-9  # half a step up and down; rounding of 1e6 m
