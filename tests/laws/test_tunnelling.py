"""Case 19: the fraction of bullets that tunnel through a thin wall is the predicted one."""

import numpy as np
import pytest

from sandbox.measure.preflight.tunnelling import tunnelling_risks
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads

BULLETS = 2500
RADIUS, THICK, SPEED = 0.01, 0.02, 100.0
WALL = 1.0


def scene_of_bullets(ratio: float) -> Scene:
    """Return bullets that start within one step of travel, which is `ratio` times the distance that the wall stops."""
    step = ratio * (RADIUS + THICK / 2.0)
    return loads(
        f"[world]\nduration = {(WALL + 4.0 * step) / SPEED!r}\nseed = 7\n[solver]\ndt = {step / SPEED!r}\n"
        f"[[wall]]\nname = 'wall'\npoints = [[{WALL}, -1.0], [{WALL}, 101.0]]\nthickness = {THICK}\nrestitution = 0.5\n"
        f"[[scatter]]\nname = 'bullet'\ncount = {BULLETS}\nlower = [0.0, 0.0]\nupper = [{step!r}, 100.0]\n"
        f"velocity = [{SPEED}, 0.0]\nradius = {RADIUS}\ncollides = 'fixed'\n"
    )


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("engine", ["pymunk", "reference"])
@pytest.mark.parametrize("ratio", [0.9, 1.1, 1.5, 3.0, 10.0])
def test_fraction_of_tunnelling_bullets_is_the_predicted_one(ratio: float, engine: str) -> None:
    scene = scene_of_bullets(ratio)
    (forecast,) = tunnelling_risks(scene)
    result = run(scene, engine, audit=False)
    assert result.status == "ok"
    passed = float(np.mean(result.position[-1, :, 0] > WALL))
    odds = forecast.odds(scene.solver.dt)
    assert odds == pytest.approx(max(0.0, 1.0 - 1.0 / ratio), abs=1e-12)  # rounding
    # 3 %: three standard deviations of 2,500 bullets at even odds.
    assert passed == pytest.approx(odds, abs=0.03)
    assert (passed > 0.0) == (ratio > 1.0)
