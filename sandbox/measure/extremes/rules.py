"""Rules: what a run must not do, each a function that tells what was wrong, or None.

All finite and bounded, no energy gained beyond the case's own band, momentum to rounding, no centre through a wall, no
overlap beyond slop + v·h, at rest in the end, standing where it stood, joints within a hundredth, and an answer that
is of use.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.compare.drift import momentum_drift
from sandbox.measure.energy import energies
from sandbox.measure.extremes.case import Case
from sandbox.measure.extremes.overlaps import deepest, looked_at
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

SPREAD = 10.0
"""How many times farther than its start and its fall would carry it a body may get: chains have come to be 1e9 m long
without a nan."""
MOMENTUM = 1e-12
"""As a share: some thousand roundings."""
JOINTS = 0.01
"""The share of its length by which a joint may be off."""
RESTING = 0.02
"""The share of √(g·width) below which a body is at rest."""
STANDING = 0.5
"""The share of its width by which what should stand may have moved."""
SLOPS = 2.0
GRAZE = 1e-9
"""m, as engines count it as touching."""


@dataclass(frozen=True)
class Evidence:
    """A run of a case, and what is needed to judge it."""

    case: Case
    scene: Scene
    settings: Settings
    """as the engine resolved them"""
    run: Trajectory

    @cached_property
    def few(self) -> Trajectory:
        """The run, with as many of its frames as can be looked at closely."""
        frames = looked_at(self.run, self.scene)
        return self.run if len(frames) == len(self.run.time) else self.run.at(frames)

    @cached_property
    def stake(self) -> float:
        """J, against which a gain of energy is held."""
        return self.case.stake(self.scene)

    @cached_property
    def moved(self) -> FloatArray:
        """The farthest that each body got from where it started, (N,) m."""
        away = self.run.position - self.run.position[0]
        return np.asarray(np.hypot(away[..., 0], away[..., 1]).max(axis=0))

    @cached_property
    def width(self) -> FloatArray:
        """Of each body where it is narrowest, (N,) m."""
        return 2.0 * self.scene.bodies.thin

    @cached_property
    def gained(self) -> float:
        """The most by which energy exceeded that of the start, as a share of the stake."""
        total = energies(self.run, self.scene).total
        gain = float(total.max() - total[0])
        return gain / self.stake if self.stake > 0.0 else (math.inf if gain > 0.0 else 0.0)


def bounded(seen: Evidence) -> str | None:
    """All is finite, and nobody gets farther than could be."""
    run, bodies = seen.run, seen.scene.bodies
    state = (run.position, run.velocity, run.angle, run.angular_velocity)
    if not all(bool(np.isfinite(each).all()) for each in state):
        return "the state is not finite"
    world, time = seen.scene.world, seen.scene.world.duration
    start = bodies.position
    extent = float(np.hypot(*(start.max(axis=0) - start.min(axis=0)))) + 2.0 * float(bodies.radius.max())
    fastest = float(np.hypot(*bodies.velocity.T).max())
    reach = SPREAD * (extent + fastest * time + 0.5 * math.hypot(*world.gravity) * time**2)
    worst = int(seen.moved.argmax())
    if seen.moved[worst] > reach:
        return (
            f"{bodies.names[worst]!r} moved {seen.moved[worst]:.3g} m; the limit is {reach:.3g} m, "
            f"{SPREAD:g} times the possible distance"
        )
    return None


def energy(seen: Evidence) -> str | None:
    """No more energy than at the start, but for the case's own band."""
    gain = seen.case.gain
    band = gain(seen.scene, seen.settings, str(seen.run.info["engine"])) if callable(gain) else gain
    if seen.gained > band:
        return f"energy rose by {seen.gained:.3g} of the {seen.stake:.3g} J available; the limit is {band:.3g}"
    return None


def momentum(seen: Evidence) -> str | None:
    """Momentum as it was, but for what gravity and fixed things gave."""
    drift = momentum_drift(seen.run, seen.scene)
    if drift is not None and drift > MOMENTUM:
        return f"momentum changed by {drift:.3g}; the limit for rounding is {MOMENTUM:g}"
    return None


def through(seen: Evidence) -> str | None:
    """No centre behind what it cannot pass."""
    return seen.case.through(seen.scene, seen.run) if seen.case.through is not None else None


def overlap(seen: Evidence) -> str | None:
    """No overlap beyond slop + v·h, with the speeds there have been so far, and a step's fall.

    The slop counts twice: what exceeds it is put right little by little, and what rests lies a little deeper.
    """
    run, scene, h = seen.few, seen.scene, seen.settings.h
    fastest = np.maximum.accumulate(np.hypot(run.velocity[..., 0], run.velocity[..., 1]).max(axis=1))
    closing = (2.0 if contact_matrix(scene).mutual else 1.0) * (fastest + math.hypot(*scene.world.gravity) * h)
    deep, allowed = deepest(run, scene), SLOPS * (seen.settings.slop or 0.0) + closing * h + GRAZE
    worst = int((deep - allowed).argmax())
    if deep[worst] > allowed[worst]:
        most = f"the limit {SLOPS:g} slop + v·h is {allowed[worst]:.3g} m"
        return f"an overlap of {deep[worst]:.3g} m at {run.time[worst]:.3g} s; {most}"
    return None


def parted(seen: Evidence) -> str | None:
    """In the end no overlap but the slop is left."""
    last = seen.run.at([-1])
    left, slop = float(deepest(last, seen.scene)[0]), seen.settings.slop or 0.0
    if left > SLOPS * slop + GRAZE:
        return f"an overlap of {left:.3g} m remains; slop is {slop:.3g} m"
    return None


def settles(seen: Evidence) -> str | None:
    """In the end all is at rest."""
    bodies, pull = seen.scene.bodies, math.hypot(*seen.scene.world.gravity)
    speed = np.where(bodies.fixed, 0.0, np.hypot(*seen.run.velocity[-1].T) / np.sqrt(pull * seen.width))
    worst = int(speed.argmax())
    if speed[worst] > RESTING:
        its = float(np.hypot(*seen.run.velocity[-1, worst]))
        return f"{bodies.names[worst]!r} still moves at {its:.3g} m/s after {seen.run.time[-1]:g} s"
    return None


def stands(seen: Evidence) -> str | None:
    """Everybody stays where it stood."""
    share = np.where(seen.scene.bodies.fixed, 0.0, seen.moved / seen.width)
    worst = int(share.argmax())
    if share[worst] > STANDING:
        return f"{seen.scene.bodies.names[worst]!r} moved by {share[worst]:.3g} of its width"
    return None


def joints(seen: Evidence) -> str | None:
    """Joints hold to within a hundredth."""
    off = seen.run.info["joint_error"]
    if off is not None and off > JOINTS:
        return f"the error of a joint is {off:.3g} of its length"
    return None


Rule = Callable[[Evidence], str | None]

RULES: dict[str, Rule] = {
    "bounded": bounded,
    "through": through,
    "joints": joints,
    "energy": energy,
    "momentum": momentum,
    "stands": stands,
    "overlap": overlap,
    "parted": parted,
    "settles": settles,
}
"""In the order in which they are looked at: the first that is broken is told."""
