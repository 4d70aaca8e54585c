"""Case 19: bullets that get past a thin wall, in the share that is forecast of them."""

import numpy as np
import pytest

from sandbox.measure.preflight.tunnelling import tunnelling_risks
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads

BULLETS = 2500
RADIUS, THICK, SPEED = 0.01, 0.02, 100.0
WALL = 1.0


def salvo(ratio: float) -> Scene:
    """Bullets that start anywhere within one step's way, and cover `ratio` times what the wall can stop in each."""
    step = ratio * (RADIUS + THICK / 2.0)
    return loads(
        f"[world]\nduration = {(WALL + 4.0 * step) / SPEED!r}\nseed = 7\n[solver]\ndt = {step / SPEED!r}\n"
        f"[[wall]]\nname = 'wall'\npoints = [[{WALL}, -1.0], [{WALL}, 101.0]]\nthickness = {THICK}\nrestitution = 0.5\n"
        f"[[scatter]]\nname = 'bullet'\ncount = {BULLETS}\nlower = [0.0, 0.0]\nupper = [{step!r}, 100.0]\n"
        f"velocity = [{SPEED}, 0.0]\nradius = {RADIUS}\ncollides = 'fixed'\n"
    )


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
@pytest.mark.parametrize("ratio", [0.9, 1.1, 1.5, 3.0, 10.0])
def test_share_that_passes_is_what_is_forecast(ratio: float, engine: str) -> None:
    scene = salvo(ratio)
    (forecast,) = tunnelling_risks(scene)
    done = run(scene, engine, audit=False)
    assert done.status == "ok"
    passed = float(np.mean(done.position[-1, :, 0] > WALL))
    odds = forecast.odds(scene.solver.dt)
    assert odds == pytest.approx(max(0.0, 1.0 - 1.0 / ratio), abs=1e-12)  # rounding
    # As a share within 3 %: of 2,500 bullets three standard deviations, where the odds are even.
    assert passed == pytest.approx(odds, abs=0.03)
    assert (passed > 0.0) == (ratio > 1.0)
