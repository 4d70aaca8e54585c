"""Energy: what a run's bodies have at each recorded time."""

from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.potential import Potential
from sandbox.scene.compile.setup import Setup
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

CHUNK = 10_000_000
"""Frames × bodies worked on at once: a few arrays of 80 MB."""


class Energies(NamedTuple):
    """Energies at each of T times, J."""

    kinetic: FloatArray
    """(T,) ½ m v² + ½ I ω²"""
    potential: FloatArray
    """(T,) −m g·x, 0 at the origin, and what springs and attraction store"""
    total: FloatArray
    """(T,)"""


def energies(
    trajectory: Trajectory, start: Scene | Setup, *, bodies: Bodies | None = None, body: int | None = None
) -> Energies:
    """Return the energy of all bodies that move, or of one.

    A body counts from its first frame until it is retired; a fixed one counts nothing. Gravity, springs and
    attraction are the scene's; a spring counts until it breaks, as long as both its bodies do, and of one body half of
    what it shares with another (`scene.compile.potential.Potential`). Where a run diverged, energy may be infinite or
    nan.

    Args:
        trajectory: the run.
        start: scene or setup of the run.
        bodies: bodies of the run, where some were spawned; default: those of `start`.
        body: the number of the only body to count.

    Raises:
        ValueError: the bodies are not those of the run.
        IndexError: there is no body of that number.
    """
    setup = Setup.of(start)
    scene, bodies = setup.scene, setup.bodies if bodies is None else bodies
    frames, count = trajectory.position.shape[:2]
    if count != len(bodies):
        raise ValueError(f"the run has {count:,} bodies, described are {len(bodies):,}; pass the run's own")
    columns = slice(None)
    if body is not None:
        if not 0 <= body < count:
            raise IndexError(f"no body {body}; the run has {count:,}")
        columns = slice(body, body + 1)

    mass = np.where(bodies.fixed, 0.0, bodies.mass)[columns]
    moment = np.where(bodies.fixed, 0.0, bodies.moment)[columns]
    gravity = np.asarray(scene.world.gravity)
    stored = Potential(setup, bodies, body, trajectory.breaks(len(setup.links)))
    looked = slice(None) if stored else columns  # who is there, of whom one may be joined to
    own = columns if stored else slice(None)
    gone = np.where(np.isnan(trajectory.retired_time), np.inf, trajectory.retired_time)[looked]
    seen = np.zeros(len(gone), dtype=np.bool_)
    kinetic, potential = np.empty(frames), np.empty(frames)

    step = max(1, CHUNK // max(1, len(gone)))
    for begin in range(0, frames, step):
        rows = slice(begin, begin + step)
        position, velocity = trajectory.position[rows, columns], trajectory.velocity[rows, columns]
        spin = trajectory.angular_velocity[rows, columns]
        there = _there(trajectory.position[rows, looked], seen)
        seen = there[-1]
        present = there & (trajectory.time[rows, None] < gone)
        counts = present[:, own]
        # A diverged state squares to infinity: that is its energy, not a fault.
        with np.errstate(over="ignore", invalid="ignore"):
            squared = np.einsum("tnk,tnk->tn", velocity, velocity)
            turning = _sum(np.square(spin), counts, moment)
            kinetic[rows] = 0.5 * (_sum(squared, counts, mass) + turning)
            potential[rows] = -_sum(position @ gravity, counts, mass)
            if stored:
                state = trajectory.position[rows], trajectory.angle[rows], present
                potential[rows] += stored.at(trajectory.time[rows], *state)
    with np.errstate(invalid="ignore"):
        return Energies(kinetic, potential, kinetic + potential)


def _there(position: FloatArray, seen: BoolArray) -> BoolArray:
    """Tell who has appeared by each frame. A nan after that is a diverged state, and must show in the sum."""
    there = np.asarray(~np.isnan(position).any(axis=2))
    there[0] |= seen
    return np.asarray(np.logical_or.accumulate(there, axis=0))


def _sum(values: FloatArray, counts: BoolArray, weights: FloatArray) -> FloatArray:
    return np.asarray(np.where(counts, values, 0.0) @ weights)
