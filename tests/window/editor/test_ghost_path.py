"""Ghost paths: predicted motion of the selected body."""

import time

import numpy as np
import pytest

from sandbox.scene.files.load import loads
from sandbox.window.editor.ghost_path import PREDICTED_TIME, GhostPath, GhostPredictor, predict_path
from tests.toml_text import toml

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact`

FLIGHT = toml("world", gravity=[0, -9.81]) + toml("ball", name="a", position=[0, 10], velocity=[3, 4], radius=0.1)


def test_path_of_a_flight_is_its_parabola() -> None:
    path = predict_path(loads(FLIGHT), 0)
    assert path is not None
    assert path.engine == "exact"
    t = np.arange(len(path.points)) * path.interval
    assert t[-1] == pytest.approx(PREDICTED_TIME)
    parabola = np.column_stack((3 * t, 10 + 4 * t - 0.5 * 9.81 * t**2))
    assert np.abs(path.points - parabola).max() < 1e-12  # closed form, up to rounding


def test_path_is_of_an_engine_that_can_run_the_scene() -> None:
    box = predict_path(loads(FLIGHT + '[[box]]\nname = "b"\nposition = [5, 0]\nsize = [1, 1]\n'), 1)
    assert box is not None
    assert box.engine == "pymunk"
    assert box.points[-1, 1] < -10.0  # it falls


def test_path_ends_where_the_body_is_removed() -> None:
    bounded = FLIGHT.replace("gravity = [0, -9.81]", "gravity = [0, -9.81]\nbounds = [[-1, 0], [3, 20]]")
    path = predict_path(loads(bounded), 0)
    assert path is not None
    assert 0.9 < (len(path.points) - 1) * path.interval <= 1.01  # at x = 3 m, after 1 s


def test_path_of_many_bodies_is_shorter() -> None:
    grid = "[[grid]]\norigin = [0, 20]\ncolumns = 29\nrows = 10\nspacing = [1, 1]\nradius = 0.1\n"
    path = predict_path(loads(FLIGHT + grid), 0)
    assert path is not None
    assert len(path.points) * path.interval < PREDICTED_TIME
    crowd = predict_path(loads(FLIGHT + grid.replace("rows = 10", "rows = 30")), 0)
    assert crowd is not None
    assert crowd.engine == "pymunk"
    assert len(crowd.points) >= 2  # as many as 0.2 s suffice for
    assert predict_path(loads(FLIGHT + grid.replace("rows = 10", "rows = 104")), 0) is None


def wait_for(predictor: GhostPredictor, seconds: float = 20.0) -> GhostPath | None:
    """Return the path once there is one."""
    until = time.monotonic() + seconds
    while predictor.path is None and time.monotonic() < until:
        time.sleep(0.01)
    return predictor.path


def test_predictor_predicts_the_latest_scene() -> None:
    predictor = GhostPredictor()
    scenes = [loads(FLIGHT.replace("[3, 4]", f"[{k}, 4]")) for k in range(20)]
    try:
        for scene in scenes:
            predictor.submit(scene, 0)
        until = time.monotonic() + 20.0
        while time.monotonic() < until:
            path = predictor.path
            if path is not None and path.points[-1, 0] == pytest.approx(19 * PREDICTED_TIME):
                break
            time.sleep(0.01)
        assert predictor.path is not None
        assert predictor.path.points[-1, 0] == pytest.approx(19 * PREDICTED_TIME)
        predictor.submit(scenes[-1], None)
        assert predictor.path is None
        assert predictor.fault is None
    finally:
        predictor.close()


def test_path_of_many_bodies_waits_until_the_scene_rests() -> None:
    grid = "[[grid]]\norigin = [0, 20]\ncolumns = 20\nrows = 20\nspacing = [1, 1]\nradius = 0.1\n"
    predictor, scene = GhostPredictor(), loads(FLIGHT + grid)
    try:
        predictor.submit(loads(FLIGHT), 0)
        assert wait_for(predictor) is not None
        predictor.submit(scene, 0)
        assert predictor.path is None
        path = wait_for(predictor)
        assert path is not None
        assert path.engine == "pymunk"
    finally:
        predictor.close()


def test_invalid_preview_has_no_path() -> None:
    scene = loads(FLIGHT)
    broken = scene.model_copy(update={"balls": (scene.balls[0].model_copy(update={"radius": -1.0}),)})
    predictor = GhostPredictor()
    try:
        predictor.submit(broken, 0)
        predictor.submit(scene, 0)
        path = wait_for(predictor)
        assert path is not None
        assert predictor.fault is None
    finally:
        predictor.close()
