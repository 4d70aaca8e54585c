"""Independent numerical solutions for the closed forms: scipy's DOP853 at its tightest tolerance."""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

from sandbox.measure.analytic.model import BodyMotion
from sandbox.measure.analytic.solve import Solution, solution
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads

FloatArray = npt.NDArray[np.float64]


def integrated(
    law: Callable[[float, FloatArray], Sequence[float]], start: Sequence[float], time: FloatArray
) -> FloatArray:
    """Return the state at T times, (state, T). Steps are short, because dense output is of order 7 only."""
    end = float(time[-1])
    result = solve_ivp(law, (0.0, end), start, "DOP853", time, rtol=1e-13, atol=1e-13, max_step=0.05)
    assert result.success
    return np.asarray(result.y)


def scene_of(*parts: str, world: str = "duration = 10.0") -> Scene:
    return loads(f"[world]\n{world}\n" + "\n".join(parts))


def solution_of(scene: Scene) -> Solution:
    """Return a scene's solution, which it must have."""
    found = solution(scene)
    assert found is not None
    return found


def motion_of(scene: Scene, time: FloatArray, index: int = 0) -> BodyMotion:
    """Return the closed-form motion of one body."""
    motion = solution_of(scene).at(time)
    return BodyMotion(*(each[:, index] for each in motion))
