"""Ledger: where the energy of a run went, by cause, frame by frame.

    total = total at the start + sum over all causes + residual

The residual is what no cause accounts for. Causes are booked by the engine while it works, the total is measured from
outside, so that a residual tells of a fault: of rounding alone where the engine was written by hand.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.energy_ledger import Cause
from sandbox.measure.energy import energies
from sandbox.measure.finite import finite
from sandbox.measure.run import run
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

HARDLY = 1e-6
"""The least scale, as a part of the energy itself: where hardly anything moves, its rounding is all there is."""


@dataclass(frozen=True, eq=False)
class Ledger:
    """The energy of a run at each of T times, and what each of K causes has brought by then."""

    time: FloatArray
    """(T,) s"""
    total: FloatArray
    """(T,) J"""
    causes: tuple[str, ...]
    """K names, as `Cause` has them"""
    entries: FloatArray
    """(T, K) J, negative where a cause took some"""
    scale: float
    """J, what figures are compared with: the most energy that was in motion, or that one cause brought or took"""

    @property
    def residual(self) -> FloatArray:
        """(T,) J, what no cause accounts for."""
        with np.errstate(invalid="ignore"):  # infinity less infinity, of a run that diverged
            return np.asarray(self.total - self.total[0] - self.entries.sum(axis=1))

    @property
    def closes_to(self) -> float:
        """The largest residual as a part of the scale; 0 where nothing ever moved."""
        worst = float(np.abs(self.residual).max())
        return worst / self.scale if self.scale > 0.0 else worst

    def of(self, cause: Cause) -> float:
        """Return what a cause has brought by the end, J."""
        return float(self.entries[-1, self.causes.index(cause)]) if cause in self.causes else 0.0

    def document(self) -> dict[str, Any]:
        """Return what it comes to at the end, as one JSON object; figures that are not finite are null."""
        sums = {name: finite(value) for name, value in zip(self.causes, self.entries[-1].tolist(), strict=True)}
        return {
            "start": finite(float(self.total[0])),
            "causes": sums,
            "end": finite(float(self.total[-1])),
            "residual": finite(float(self.residual[-1])),
            "scale": finite(self.scale),
            "closes_to": finite(self.closes_to),
        }


def ledger(scene: Scene, engine: str = "pymunk", **settings: Any) -> Ledger:
    """Run a scene from start to end, and return where its energy went.

    Args:
        scene: what to run.
        engine: its name in the registry.
        settings: as `run` takes them.

    Raises:
        UnknownEngineError: no engine has that name.
        ValueError: the engine refuses the scene; `str()` says why.
    """
    trajectory = run(scene, engine, **{"audit": False, **settings, "account": True})
    if not len(trajectory.time):
        raise ValueError(trajectory.reason)
    return ledger_of(trajectory, scene)


def ledger_of(trajectory: Trajectory, scene: Scene) -> Ledger:
    """Return the ledger of a run that kept an account.

    Args:
        trajectory: the run.
        scene: its scene.

    Raises:
        ValueError: the run kept none.
    """
    if not len(trajectory.energy):
        raise ValueError("the run has no energy account; run it with account=True")
    # Whoever was spawned is in no scene; of a run with spawned bodies the turnover alone is the scale.
    known = len(scene.bodies) == len(trajectory.names)
    motion = float(energies(trajectory, scene).kinetic.max()) if known else 0.0
    turnover = float(np.abs(trajectory.account).max(initial=0.0))
    scale = max(motion, turnover, HARDLY * float(np.abs(trajectory.energy).max()))
    causes = tuple(str(name) for name in trajectory.info["causes"])
    return Ledger(trajectory.time, trajectory.energy, causes, trajectory.account, scale)
