"""Trial run: a short headless run of a scene from one of its starts, and the problems that occur in it."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from sandbox.action import Spawn, in_order
from sandbox.arrays import BoolArray, IntArray
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import ENGINES
from sandbox.formatting import format_fraction, format_quantity
from sandbox.measure.metrics.invariants import conserves_energy, energy_drift, energy_gain
from sandbox.measure.missed_contacts.slender_bodies import MAX_TURN, is_slender
from sandbox.measure.preflight.checks import ITERATED
from sandbox.measure.preflight.diagnostic import Details, Diagnostic, floor_3_digits
from sandbox.measure.preflight.initial_contacts import initial_contacts
from sandbox.measure.preflight.stacks import MIN_MASS_RATIO
from sandbox.measure.run.run_warnings import MAX_ENERGY_GAIN
from sandbox.measure.run.runner import run
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.derived import derived_once
from sandbox.scene.compile.filters import filter_table
from sandbox.scene.compile.joint_arrays import JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import Post, Wall
from sandbox.scene.description.world import Settings
from sandbox.scene.validate.bodies import height_above
from sandbox.trajectory import Trajectory

MAX_SUBSTEPS, MAX_BODY_SUBSTEPS = 10_000, 60_000
"""Limits of a trial run; the second is substeps times bodies."""
MIN_SUBSTEPS = 20
"""A shorter trial run is not informative and is left out."""

MAX_JOINT_ERROR = 0.1
"""A joint with a larger error, as a fraction of its length, has come apart."""
MAX_ENERGY_LOSS = 0.1
"""Largest fraction of the kinetic energy that a scene which conserves energy may lose."""
MAX_STACK_DISPLACEMENT = 0.5
"""A stack has fallen if one of its bodies has moved by a larger fraction of its width."""


class StackedBodies(NamedTuple):
    """Bodies that rest on each other at the start of a scene."""

    bodies: IntArray
    mass_ratio: float
    """largest ratio of the masses of two that touch"""


@derived_once
def _stack_of(setup: Setup) -> StackedBodies | None:
    """Return the bodies of a scene that should stay where they are; None if there are none, or something drives it."""
    scene, bodies = setup.scene, setup.scene.bodies
    if not any(scene.world.gravity) or bodies.round.all() or (bodies.velocity[~bodies.fixed] != 0.0).any():
        return None
    if bodies.scales_gravity or bodies.kinematic.any() or len(scene.joint_arrays):
        return None
    if scene.thrusts or scene.tyres or scene.drives or scene.attractions or scene.liquids:
        return None
    close = initial_contacts(scene)
    stacked = np.unique(np.concatenate((close.first, close.second)))
    stacked = stacked[~bodies.fixed[stacked]]
    if not len(stacked):
        return None
    both = ~bodies.fixed[close.first] & ~bodies.fixed[close.second]
    mass_a, mass_b = bodies.mass[close.first[both]], bodies.mass[close.second[both]]
    return StackedBodies(stacked, float((np.maximum(mass_a, mass_b) / np.minimum(mass_a, mass_b)).max(initial=1.0)))


class Unseen(NamedTuple):
    """Bodies of the scene whose passages the audit does not see, (N,) each."""

    through_bodies: BoolArray
    through_static: BoolArray


@dataclass(frozen=True)
class TrialRun:
    """Trial run from one start."""

    origin: Scene
    """the scene with the start in its file"""
    scene: Scene
    """the scene as it was run: another start, for the duration of the trial run"""
    settings: Settings
    """settings as the engine resolved them"""
    run: Trajectory

    @property
    def engine(self) -> str:
        """Name of the engine."""
        return str(self.run.info["engine"])

    @cached_property
    def bodies(self) -> Bodies:
        """Bodies of the run: those of the scene, and those that its events added."""
        bodies, names = self.scene.bodies, self.run.names.tolist()
        spawned = (event.single for event in in_order(self.scene.events) if isinstance(event, Spawn))
        for single, name in zip(spawned, names[len(bodies) :], strict=False):  # the run may have ended before the last
            bodies = bodies.joined_by(single, name)
        return bodies

    @cached_property
    def top_speeds(self) -> tuple[float, float]:
        """Largest speed of any body in the first and in the second half of the run, m/s."""
        speed = np.hypot(self.run.velocity[..., 0], self.run.velocity[..., 1])
        half = (len(speed) + 1) // 2
        return float(np.nanmax(speed[:half], initial=0.0)), float(np.nanmax(speed[half:], initial=0.0))

    @cached_property
    def unseen(self) -> Unseen:
        """Bodies whose passages the audit does not see.

        It does not follow bodies whose centre of mass lies outside of them. Of slender bodies, it follows the ends
        through other bodies, but not between frames in which they turn too far; and not through static objects, which
        matters if rotation moves the ends farther in a step than half the width.
        """
        bodies, run = self.scene.bodies, self.run.of_first(len(self.scene.bodies))
        without = (bodies.core <= 0.0) & ~bodies.fixed
        turn = np.abs(np.diff(run.angle, axis=0)).max(axis=0, initial=0.0)
        is_sparse = run.info["settings"]["record_every"] > 1
        slender = is_slender(bodies)
        sweeping = turn * bodies.radius / self.settings.substeps > bodies.thin
        return Unseen(without | (slender & (is_sparse | (turn > MAX_TURN))), without | (slender & sweeping))

    def findings(self) -> Iterator[Diagnostic]:
        """Yield a diagnostic for each problem that occurred, for each body that misses a contact or sinks too deep."""
        if self.run.status == "diverged" or not np.isfinite(self.run.position[-1]).all():
            reason = self.run.reason or "the state is not finite"
            yield Diagnostic("diverged", f"the run diverges: {reason}", {"engine": self.engine})
            return
        yield from self._missed_contacts()
        yield from self._penetrations()
        yield from self._broken_joints()
        yield from self._fallen_stacks()
        yield from self._energy_gains()
        yield from self._energy_losses()

    def _missed_contacts(self) -> Iterator[Diagnostic]:
        """Yield the contacts that the audit found missed, with the closing speed of each body."""
        run, bodies = self.run, self.bodies
        reported: set[tuple[int, int]] = set()
        for time, (a, b) in zip(run.missed_time.tolist(), run.missed_pair.tolist(), strict=True):
            if (a, b) in reported:
                continue
            reported.add((a, b))
            frame = max(0, int(np.searchsorted(run.time, time, side="right")) - 1)
            velocity = run.velocity[frame, a] - (run.velocity[frame, b] if b >= 0 else 0.0)
            speed = float(np.hypot(*velocity))
            reach = float(bodies.thin[a]) + (float(bodies.thin[b]) if b >= 0 else self._half_thickness(-1 - b))
            thing = bodies.names[b] if b >= 0 else self.scene.fixed_names[-1 - b]
            safe = reach / speed * self.settings.substeps if speed > 0.0 else math.inf
            details: Details = {"ball": bodies.names[a], "thing": thing, "speed": speed, "time": time}
            pace = f"at {speed:.4g} m/s or {speed * self.settings.h:.3g} m per substep"
            if safe < self.settings.dt:
                details["safe_dt"] = safe
                what = f"tunnels through {thing!r}, or is detected too late,"
                remedy = f"dt <= {floor_3_digits(safe)} s is safe at that speed"
            else:  # too slow to tunnel: the two overlap for less than a substep, or enter from the side
                what = f"grazes {thing!r} within a substep, undetected,"
                remedy = "with a shorter dt fewer such contacts are missed, and by less"
            message = f"{bodies.names[a]!r} {what} at {time:.3g} s, {pace}"
            yield Diagnostic("tunnelling", message, details, remedy)

    def _half_thickness(self, number: int) -> float:
        """Return half the thickness of a static object, m."""
        thing = self.scene.fixed[number]
        return thing.thickness / 2.0 if isinstance(thing, Wall) else thing.radius if isinstance(thing, Post) else 0.0

    def _penetrations(self) -> Iterator[Diagnostic]:
        """Yield each ball whose centre was behind the surface of a plane, at its deepest."""
        run, bodies = self.run, self.bodies
        able = np.asarray([e.collides != "none" for e in bodies.elements], np.bool_)[bodies.element] & ~bodies.immovable
        filters = filter_table(self.scene, bodies)
        for index, (thing, name) in enumerate(zip(self.scene.planes, self.scene.fixed_names, strict=False)):
            discs = np.flatnonzero(able & (bodies.core > 0.0) & filters.meets_fixed(index))
            if not len(discs):
                continue
            flat = run.position[:, discs].reshape(-1, 2)
            depth = -height_above(thing, flat).reshape(len(run.time), len(discs))
            # Initial overlaps are another diagnostic, and bodies that are added later have no position before.
            depth = np.where((depth[0] > 0.0) | np.isnan(depth), 0.0, depth)
            for k in np.flatnonzero(depth.max(axis=0) > 0.0).tolist():
                frame = int(depth[:, k].argmax())
                body, deepest = bodies.names[discs[k]], float(depth[frame, k])
                speed = float(np.hypot(*run.velocity[max(0, frame - 1), discs[k]]))
                message = (
                    f"the centre of {body!r} is {deepest:.3g} m behind the surface of {name!r} at "
                    f"{run.time[frame]:.3g} s, before the contact is detected"
                )
                details: Details = {"ball": body, "thing": name, "depth": deepest, "speed": speed}
                yield Diagnostic("depth", message, {**details, "time": float(run.time[frame])})

    def _broken_joints(self) -> Iterator[Diagnostic]:
        error, worst = self.run.info["joint_error"], self.run.info["worst_joint"]
        if error is not None and error > MAX_JOINT_ERROR:
            size = format_quantity(worst["error"], worst["unit"])
            relative = "" if worst["unit"] == "rad" else f", {error:.2g} of its length"
            message = f"the error of the joint {worst['name']!r} reaches {size}{relative}"
            if self.engine == "box2d":
                message += "; its joints are soft: more solver.substeps may not be enough under a heavy load"
            yield Diagnostic("chain", message, {"joint": worst["name"], "share": min(float(error), 1e300)})

    def _fallen_stacks(self) -> Iterator[Diagnostic]:
        """Yield the body of a stack that moved most, if the stack has fallen."""
        run, bodies, stack = self.run, self.scene.bodies, _stack_of(self.origin)
        if stack is None:
            return
        shift = run.position[:, stack.bodies] - run.position[0, stack.bodies]
        fraction = np.hypot(*np.moveaxis(shift, 2, 0)).max(axis=0) / (2.0 * bodies.thin[stack.bodies])
        if fraction.max() <= MAX_STACK_DISPLACEMENT:
            return
        k = int(fraction.argmax())
        name = bodies.names[stack.bodies[k]]
        message = f"the stacked body {name!r} moves by {fraction[k]:.3g} of its width"
        details: Details = {"body": name, "moved": float(fraction[k])}
        remedy = "more solver.substeps" if self.engine not in ITERATED else "more solver.iterations or a smaller dt"
        kind = "mass_ratio" if stack.mass_ratio >= MIN_MASS_RATIO else "stack"
        yield Diagnostic(kind, message, details, f"{remedy} may stabilise the stack")

    def _energy_gains(self) -> Iterator[Diagnostic]:
        gain = energy_gain(self.run, self.scene)
        if gain > MAX_ENERGY_GAIN:
            springs = len(self.scene.joint_arrays.of(JointKind.SPRING, JointKind.ROTARY_SPRING)) > 0
            message = f"energy rises by a fraction {gain:.3g} of the exchanged energy"
            kind, details = "spring" if springs else "energy", {"gained": min(gain, 1e300)}
            yield Diagnostic(kind, message, {**details}, self._remedy_of_impacts())

    def _energy_losses(self) -> Iterator[Diagnostic]:
        """Yield a diagnostic if much energy is lost in a scene that conserves it."""
        if not conserves_energy(self.scene):
            return
        loss = energy_drift(self.run, self.scene, None, False).fraction
        if loss is not None and loss < -MAX_ENERGY_LOSS:
            message = (
                f"energy falls by {format_fraction(-loss)} of the largest kinetic energy, although the scene conserves "
                "it: motion that should go on slows down"
            )
            yield Diagnostic("energy_loss", message, {"lost": -loss})

    def _remedy_of_impacts(self) -> str:
        """Return the possible cause of an energy gain: Newton's restitution with friction, off the centre of mass."""
        matrix = contact_matrix(self.scene)
        surfaces = matrix.surfaces
        rough = bool((matrix.touching & (surfaces.restitution > 0.0) & (surfaces.friction > 0.0)).any())
        if not (matrix.solids and rough) or self.run.info["settings"].get("impact") != "newton":
            return ""
        return (
            "restitution with friction can create energy for shapes other than balls: on reference, "
            "solver.impact = 'dissipative' prevents that"
        )


def trial_duration(scene: Scene, settings: Settings, cover: float = 1.0) -> float | None:
    """Return the duration of a trial run, s: of the scene, or of a first part; None if the part would be too short.

    Args:
        scene: the scene.
        settings: settings of the run.
        cover: fraction of the scene that the trial run may cover at most.
    """
    if not len(scene.bodies):
        return None
    max_substeps = min(MAX_SUBSTEPS, MAX_BODY_SUBSTEPS // len(scene.bodies))
    needed = math.ceil(scene.world.duration / settings.dt) * settings.substeps
    if max_substeps < min(MIN_SUBSTEPS, needed):
        return None
    max_substeps = min(max_substeps, math.ceil(cover * needed)) if cover < 1.0 else max_substeps
    return scene.world.duration if needed <= max_substeps else max(1, max_substeps // settings.substeps) * settings.dt


def run_trial(origin: Scene, start: Scene, settings: Settings, engine: str, duration: float) -> TrialRun | None:
    """Run a scene from a start for a duration, s; None if the engine refuses it or has not enough memory.

    Args:
        origin: the scene with the start in its file.
        start: the scene with the start.
        settings: settings of the run.
        engine: name of an engine that supports the scene.
        duration: of the run, s.
    """
    part = start if duration == start.world.duration else start.with_duration(duration)
    every = max(1, int(duration / settings.dt // MAX_SUBSTEPS))
    try:
        done = run(part, engine, **settings.model_copy(update={"record_every": every}).model_dump())
    except (MemoryError, Refusal):
        return None
    return None if done.status == "refused" else TrialRun(origin, part, ENGINES[engine].resolve(part, settings), done)
