"""Energy of a run in each frame, and the energy ledger: the energy that each cause added or removed.

    total = total at the start + sum over all causes + residual

The residual is energy that no cause accounts for. The engine books the causes, the total is measured from its state, so
that a residual reveals an error. In the hand-written engines it is rounding only.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.engines.energy_ledger import Cause
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.potential import Potential
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.trajectory import Trajectory

CHUNK = 10_000_000
"""Frames × bodies processed at once: a few arrays of 80 MB."""


class Energies(NamedTuple):
    """Energies at T times, J."""

    kinetic: FloatArray
    """(T,) ½ m v² + ½ I ω²"""
    potential: FloatArray
    """(T,) −m g·x, 0 at the origin, and the energy stored in springs and attraction"""
    total: FloatArray
    """(T,)"""


def energies(
    trajectory: Trajectory, start: Scene | Setup, *, bodies: Bodies | None = None, body: int | None = None
) -> Energies:
    """Return the energy of all moving bodies, or of one.

    A body counts from its first frame until it is retired; static bodies do not count. A spring counts until it breaks
    or one of its bodies is retired. Of a spring or an attraction between two bodies, one body has half the energy
    (`scene.compile.potential.Potential`). The energy of a diverged run can be infinite or nan.

    Args:
        trajectory: the run.
        start: scene or setup of the run.
        bodies: bodies of the run, if some were added; default: those of `start`.
        body: index of the only body to count; default: all.

    Raises:
        ValueError: the bodies are not those of the run.
        IndexError: there is no body with that index.
    """
    setup = Setup.of(start)
    scene, bodies = setup.scene, setup.bodies if bodies is None else bodies
    frames, count = trajectory.position.shape[:2]
    if count != len(bodies):
        raise ValueError(f"the run has {count:,} bodies, but the scene has {len(bodies):,}; pass the bodies of the run")
    columns = slice(None)
    if body is not None:
        if not 0 <= body < count:
            raise IndexError(f"no body {body}; the run has {count:,}")
        columns = slice(body, body + 1)

    mass = np.where(bodies.fixed, 0.0, bodies.mass)[columns]
    moment = np.where(bodies.fixed, 0.0, bodies.moment)[columns]
    weight = mass * bodies.gravity_scale[columns] if bodies.scales_gravity else mass
    gravity = np.asarray(scene.world.gravity)
    stored = Potential(setup, bodies, body, trajectory.breaks(len(setup.joints)))
    needed = slice(None) if stored else columns  # a body can be joined to any other
    counted_columns = columns if stored else slice(None)
    size = count if stored or body is None else 1
    added_before = np.zeros(size, dtype=np.bool_)
    kinetic, potential = np.empty(frames), np.empty(frames)

    step = max(1, CHUNK // max(1, size))
    for begin in range(0, frames, step):
        rows = slice(begin, begin + step)
        position, velocity = trajectory.position[rows, columns], trajectory.velocity[rows, columns]
        spin = trajectory.angular_velocity[rows, columns]
        added = _added(trajectory.position[rows, needed], added_before)
        added_before = added[-1]
        present = added & trajectory.present(rows)[:, needed]
        counts = present[:, counted_columns]
        # The squares of a diverged state are infinite, which is its energy and no error.
        with np.errstate(over="ignore", invalid="ignore"):
            squared = np.einsum("tnk,tnk->tn", velocity, velocity)
            turning = _sum(np.square(spin), counts, moment)
            kinetic[rows] = 0.5 * (_sum(squared, counts, mass) + turning)
            height = position[..., 0] * gravity[0] + position[..., 1] * gravity[1]
            potential[rows] = -_sum(height, counts, weight)
            if stored:
                state = trajectory.position[rows], trajectory.angle[rows], present
                potential[rows] += stored.at(trajectory.time[rows], *state)
    with np.errstate(invalid="ignore"):
        return Energies(kinetic, potential, kinetic + potential)


def _added(position: FloatArray, added_before: BoolArray) -> BoolArray:
    """Return which bodies have been added by each frame, (T, N).

    A body is nan before it is added. A later nan is a diverged state, which has to show in the sum.

    Args:
        position: (T, N, 2) m.
        added_before: (N,) bodies that were present before these frames.
    """
    added = np.asarray(~np.isnan(position).any(axis=2))
    added[0] |= added_before
    return np.asarray(np.logical_or.accumulate(added, axis=0))


def _sum(values: FloatArray, counts: BoolArray, weights: FloatArray) -> FloatArray:
    """Return the weighted sum of the values that count, (T,).

    Unlike a matrix product, its rounding does not depend on T.
    """
    return np.asarray((np.where(counts, values, 0.0) * weights).sum(axis=1))


MIN_SCALE_FRACTION = 1e-6
"""Smallest scale as a fraction of the energy: if hardly anything moves, the energy changes by its rounding only."""


@dataclass(frozen=True, eq=False)
class Ledger:
    """Energy of a run at T times, and the cumulative energy brought by K causes."""

    time: FloatArray
    """(T,) s"""
    total: FloatArray
    """(T,) J"""
    causes: tuple[str, ...]
    """K names of `Cause`"""
    entries: FloatArray
    """(T, K) J, negative for energy removed"""
    scale: float
    """J, largest kinetic energy, or largest energy brought or removed by one cause"""

    @property
    def residual(self) -> FloatArray:
        """(T,) J, energy that no cause accounts for."""
        with np.errstate(invalid="ignore"):  # infinity minus infinity, if the run diverged
            return np.asarray(self.total - self.total[0] - self.entries.sum(axis=1))

    @property
    def closes_to(self) -> float:
        """Largest residual as a fraction of the scale; 0 if nothing ever moved."""
        worst = float(np.abs(self.residual).max())
        return worst / self.scale if self.scale > 0.0 else worst

    def of(self, cause: Cause) -> float:
        """Return the energy brought by a cause up to the end, J."""
        return float(self.entries[-1, self.causes.index(cause)]) if cause in self.causes else 0.0

    def document(self) -> "LedgerDocument":
        """Return the ledger at the end of the run, as it appears in JSON documents."""
        return LedgerDocument(
            start=float(self.total[0]),
            causes=dict(zip(self.causes, self.entries[-1].tolist(), strict=True)),
            end=float(self.total[-1]),
            residual=float(self.residual[-1]),
            scale=self.scale,
            closes_to=self.closes_to,
        )


@dataclass(frozen=True)
class LedgerDocument:
    """JSON document of a ledger; energies in J."""

    start: float
    causes: Mapping[str, float]
    """energy brought by each cause"""
    end: float
    residual: float
    scale: float
    closes_to: float


def ledger_of(trajectory: Trajectory, scene: Scene) -> Ledger:
    """Return the ledger of a run with an energy account.

    Args:
        trajectory: the run.
        scene: scene of the run.

    Raises:
        ValueError: the run has no energy account.
    """
    if not len(trajectory.energy):
        raise ValueError("the run has no energy account; run it with account=True")
    # Bodies added during the run are not in the scene; the scale is then only the turnover.
    known = len(scene.bodies) == len(trajectory.names)
    motion = float(energies(trajectory, scene).kinetic.max()) if known else 0.0
    turnover = float(np.abs(trajectory.account).max(initial=0.0))
    scale = max(motion, turnover, MIN_SCALE_FRACTION * float(np.abs(trajectory.energy).max()))
    causes = tuple(str(name) for name in trajectory.info["causes"])
    return Ledger(trajectory.time, trajectory.energy, causes, trajectory.account, scale)
