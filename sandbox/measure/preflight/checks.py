"""Table of all preflight checks, and the diagnostics of a scene."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sandbox.engines.registry import ENGINES
from sandbox.measure.preflight.diagnostic import ROUNDING, Details, Diagnostic, floor_3_digits
from sandbox.measure.preflight.initial_contacts import InitialContacts, initial_contacts, overlap_warnings
from sandbox.measure.preflight.joint_chains import chain_warnings, joint_start_warnings, stretch_warnings
from sandbox.measure.preflight.predictability import event_warnings
from sandbox.measure.preflight.speed_bound import SpeedBounds
from sandbox.measure.preflight.stacks import stack_warnings
from sandbox.measure.preflight.stiffness import (
    damper_warnings,
    lift_warnings,
    liquid_warnings,
    orbit_warnings,
    spring_warnings,
)
from sandbox.measure.preflight.tunnelling import (
    ANOTHER,
    ANOTHER_BODY,
    TunnellingRisk,
    detection_factor,
    entry_warnings,
    intervals,
    is_continuous,
    sensor_warnings,
    tunnelling_risks,
)
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.filters import filter_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings


def kick_warnings(scene: Scene, settings: Settings, matrix: ContactMatrix) -> Iterator[Diagnostic]:
    """Yield a diagnostic if one substep of gravity makes a resting body fast enough to trigger a kick.

    Contacts are detected at the end of a substep: a body in contact has then gained g·h.
    """
    fall = math.hypot(*scene.world.gravity) * scene.bodies.largest_gravity_scale * settings.h
    touched = matrix.touching.any(axis=1)
    for name, number in zip(scene.fixed_names, matrix.surfaces.of_fixed.tolist(), strict=False):  # pockets come last
        kick = matrix.surfaces.surfaces[number].kick
        if kick is not None and bool(np.asarray(touched)[number]) and fall >= kick.threshold:
            safe = settings.dt * kick.threshold / fall
            message = (
                f"{name!r} kicks bodies that approach at {kick.threshold:g} m/s, which one substep of gravity gives to "
                f"a body that rests there; use dt < {floor_3_digits(safe)} s or a higher threshold"
            )
            yield Diagnostic("kick_threshold", message, {"thing": name, "threshold": kick.threshold, "fall": fall})


MIN_ITERATIONS = 3
"""With fewer iterations, groups of bouncing bodies can gain energy on pymunk. Measured on break shots of 6 to 36 balls,
e = 0.95 and 1, 240 to 3840 Hz: up to a factor of five with one iteration, in 5 of 54 cases a tenth with two, never with
three. The reference engine gained none with one.
"""

MAX_ROUNDING = 1e-3
"""Largest rounding of positions as a fraction of a radius."""

MAX_LOST_FRACTION = 0.1
"""Largest rounding of the displacement in a substep as a fraction: positions are sums of displacements, which are all
rounded alike. Measured with a ball of 1 m at 1 m/s, steps of 0.01 s (`sandbox extremes --axes offset`).
"""

FAILED = "failed_forecast"
"""Kind of the diagnostic of a check that raised an exception."""

DOUBLE_EPSILON = 2.0**-52
"""Relative spacing of 64-bit numbers."""

EVENT_DRIVEN = frozenset({"exact"})
"""Engines without a time step, which refuse overlaps."""

ITERATED = frozenset({"pymunk", "reference"})
"""Engines that iterate contacts and joints, for which the laws of stacks and chains were measured. The contacts and
joints of box2d are soft, and its substeps take the place of iterations."""


@dataclass(frozen=True)
class PreflightContext:
    """Scene and settings, and quantities that several checks derive from them."""

    scene: Scene
    settings: Settings
    engine: str | None = None
    """name of the engine; None for all"""

    @property
    def is_single_precision(self) -> bool:
        """Whether the engine computes in 32-bit numbers."""
        return self.engine in ENGINES and ENGINES[self.engine].epsilon > DOUBLE_EPSILON

    @property
    def is_continuous(self) -> bool:
        """Whether the engine stops bodies at static objects, however fast they are."""
        return is_continuous(self.settings, self.engine)

    @cached_property
    def matrix(self) -> ContactMatrix:
        """Contact matrix of the scene."""
        return contact_matrix(self.scene)

    @cached_property
    def close(self) -> InitialContacts:
        """Pairs of bodies in contact or overlap at the start."""
        return initial_contacts(self.scene)


@dataclass(frozen=True)
class Check:
    """One check: a function of the context, and the engines that it applies to."""

    find: Callable[[PreflightContext], Iterable[Diagnostic]]
    engines: frozenset[str] | None = None
    """None for every engine with a time step"""

    def concerns(self, engine: str) -> bool:
        """Return whether it applies to an engine."""
        return engine not in EVENT_DRIVEN if self.engines is None else engine in self.engines


def warnings(scene: Scene, settings: Settings | None = None, engine: str | None = None) -> list[Diagnostic]:
    """Return the diagnostics of a scene by formulas, without running it.

    A check that raises an exception becomes a diagnostic of kind `failed_forecast`; the other checks are not affected.

    Args:
        scene: the scene.
        settings: settings of the run; default: those of the scene.
        engine: name of the engine; default: the checks of all engines.
    """
    context = PreflightContext(scene, scene.solver if settings is None else settings, engine)
    found: list[Diagnostic] = []
    for name, check in CHECKS.items():
        if engine is not None and not check.concerns(engine):
            continue
        try:
            found += check.find(context)
        except Exception as error:  # noqa: BLE001, an error in one check must not stop the others
            message = f"the forecast {name!r} failed with {type(error).__name__}: {error}; please report this scene"
            found.append(Diagnostic(FAILED, message, {"forecast": name}))
    return found


def _duration(scene: Scene, settings: Settings) -> Iterator[Diagnostic]:
    if settings.dt > scene.world.duration * (1.0 + ROUNDING):
        message = (
            f"dt, {settings.dt:g} s, is longer than the run, {scene.world.duration:g} s: it ends within its first "
            "step, in which no contact is found"
        )
        yield Diagnostic("duration", message, {"dt": settings.dt, "duration": scene.world.duration})


def _tunnelling(context: PreflightContext) -> Iterator[Diagnostic]:
    scene, settings, times = context.scene, context.settings, detection_factor(context.settings)
    risks = tunnelling_risks(scene, context.matrix)
    if context.is_continuous:
        risks = [passage for passage in risks if passage.thing in (ANOTHER, ANOTHER_BODY)]
    count = intervals(settings, context.engine)
    h, interval = settings.dt / count, "substep" if count == settings.substeps else "step"
    at_risk = [passage for passage in risks if passage.odds(h / times) > ROUNDING]
    unstruck = {passage.thing for passage in at_risk if not passage.struck}
    at_risk = [passage for passage in at_risk if not passage.struck or passage.thing not in unstruck]
    for passage, things in group_alike(at_risk):
        odds = passage.odds(h / times)
        safe = passage.safe_h * count * times
        displacement = passage.speed * h
        thing = passage.thing if passage.thing in (ANOTHER, ANOTHER_BODY) else repr(passage.thing)
        if things:
            thing += f" and {things:,} other{'s' if things > 1 else ''} like it"
        ball = repr(passage.ball)
        if passage.others:
            ball += f" and {passage.others:,} other{'s' if passage.others > 1 else ''} about as fast"
        if passage.struck:
            ball += ", struck by others,"
        message = (
            f"{ball} can approach {thing} at up to {passage.speed:.4g} m/s, {displacement:.3g} m per {interval}, and "
            f"tunnel through it undetected: odds up to {100 * odds:.3g} %{' each' if passage.others else ''}"
        )
        details: Details = {
            "ball": passage.ball,
            "thing": passage.thing,
            "others": things,
            "other_bodies": passage.others,
            "speed": passage.speed,
            "odds": odds,
            "safe_dt": safe,
        }
        if passage.struck:
            details["struck"] = True
        yield Diagnostic("tunnelling", message, details, f"dt <= {floor_3_digits(safe)} s is safe")


def _depth(context: PreflightContext) -> Iterator[Diagnostic]:
    """Yield bodies that can penetrate a plane by more than their half width before the contact is detected.

    A contact is detected at the end of a substep, up to v·h deep. `bisect`, `swept` and `shrink` return to the time of
    impact; continuous collision stops the body there.
    """
    scene, settings, matrix = context.scene, context.settings, context.matrix
    if settings.detection not in (None, "discrete") or context.is_continuous:
        return
    bodies, speeds = scene.bodies, SpeedBounds(scene, matrix)
    filters = filter_table(scene, bodies)
    movers = matrix.touches & ~bodies.immovable & (bodies.thin > 0.0)
    found: dict[tuple[str, float, int], tuple[str, float, int]] = {}
    for index, (plane, name) in enumerate(zip(scene.planes, scene.fixed_names, strict=False)):
        able = np.flatnonzero(movers & filters.meets_fixed(index))
        if not len(able):
            continue
        speed = speeds.toward(plane)[able]
        k = int(np.argmax(speed / bodies.thin[able]))
        key = bodies.names[able[k]], float(speed[k]), len(able) - 1
        first, half, count = found.get(key, (name, float(bodies.thin[able[k]]), -1))
        found[key] = first, half, count + 1
    for (body, top, slower), (name, half, others) in found.items():
        depth = top * settings.h
        if depth <= half * (1.0 + ROUNDING):
            continue
        safe = settings.dt * half / depth
        more = f" and {others:,} other{'s' if others > 1 else ''} like it" if others else ""
        message = (
            f"{body!r} can hit {name!r}{more} at up to {top:.4g} m/s and penetrate by {depth:.3g} m before the contact "
            "is detected"
        )
        remedy = f"dt <= {floor_3_digits(safe)} s keeps that below its half width, {half:.3g} m"
        details: Details = {"ball": body, "thing": name, "others": others, "other_bodies": slower}
        details |= {"speed": top, "depth": depth, "safe_dt": safe}
        yield Diagnostic("depth", message, details, remedy)


def group_alike(found: Iterable[TunnellingRisk]) -> list[tuple[TunnellingRisk, int]]:
    """Return the first of the risks that differ only in the obstacle, and the number of others."""
    groups: dict[tuple[str, float, float], tuple[TunnellingRisk, int]] = {}
    for passage in found:
        key = passage.ball, passage.speed, passage.safe_h
        first, count = groups.get(key, (passage, -1))
        groups[key] = first, count + 1
    return list(groups.values())


def _iterations(settings: Settings, matrix: ContactMatrix) -> Iterator[Diagnostic]:
    if matrix.mutual and settings.iterations < MIN_ITERATIONS and matrix.restitution > 0:
        kind = "balls" if matrix.ball_ball else "bodies"
        noun = "iteration" if settings.iterations == 1 else "iterations"
        message = f"{settings.iterations} {noun} with bouncing {kind}: groups can gain energy"
        details: Details = {"has": settings.iterations, "iterations": MIN_ITERATIONS}
        yield Diagnostic("iterations", message, details, f"use iterations >= {MIN_ITERATIONS}")


def _rounding(context: PreflightContext) -> Iterator[Diagnostic]:
    settings, bodies = context.settings, context.scene.bodies
    colliders = context.matrix.touches & ~bodies.fixed
    if colliders.any():
        farthest = np.abs(bodies.position[colliders]).max(axis=1)
        size = np.spacing(farthest.astype(np.float32) if context.is_single_precision else farthest).astype(np.float64)
        spacing = size / bodies.thin[colliders]
        worst = float(spacing.max())
        if worst > MAX_ROUNDING:
            name = bodies.names[int(np.flatnonzero(colliders)[np.argmax(spacing)])]
            message = (
                f"{name!r} is so far from the origin that its position is rounded to {worst:.2g} of its radius; "
                "move the scene closer to it"
            )
            yield Diagnostic("rounding", message, {"ball": name, "share": worst})
            return
        displacement = np.hypot(*bodies.velocity[colliders].T) * settings.h
        lost = np.divide(0.5 * size, displacement, out=np.zeros_like(displacement), where=displacement > 0.0)
        worst = float(lost.max())
        if worst > MAX_LOST_FRACTION:
            name = bodies.names[int(np.flatnonzero(colliders)[np.argmax(lost)])]
            message = (
                f"{name!r} is so far from the origin that rounding changes its displacement of "
                f"{displacement[np.argmax(lost)]:.3g} m per substep by up to {100 * worst:.2g} %; move the scene "
                "closer to it"
            )
            yield Diagnostic("rounding", message, {"ball": name, "share": worst})


CHECKS: dict[str, Check] = {
    "duration": Check(lambda s: _duration(s.scene, s.settings)),
    "tunnelling": Check(_tunnelling),
    "depth": Check(_depth),
    "entry": Check(
        lambda s: (
            *entry_warnings(s.scene, s.settings, s.matrix),
            *sensor_warnings(s.scene, s.settings, s.matrix),
        )
    ),
    "overlap": Check(lambda s: overlap_warnings(s.scene, s.matrix, s.close)),
    "iterations": Check(lambda s: _iterations(s.settings, s.matrix), frozenset({"pymunk"})),
    "rounding": Check(_rounding),
    "kicks": Check(lambda s: kick_warnings(s.scene, s.settings, s.matrix)),
    "joints": Check(lambda s: joint_start_warnings(s.scene)),
    "springs": Check(lambda s: spring_warnings(s.scene, s.settings)),
    "dampers": Check(lambda s: damper_warnings(s.scene, s.settings), frozenset({"reference"})),
    "lift": Check(lambda s: lift_warnings(s.scene, s.settings), frozenset({"reference"})),
    "liquids": Check(lambda s: liquid_warnings(s.scene, s.settings), frozenset({"reference"})),
    "orbits": Check(lambda s: orbit_warnings(s.scene, s.settings, s.matrix)),
    "chains": Check(lambda s: chain_warnings(s.scene, s.settings), ITERATED),
    "stretch": Check(lambda s: stretch_warnings(s.scene, s.settings), ITERATED),
    "stacks": Check(lambda s: stack_warnings(s.scene, s.settings, s.close), ITERATED),
    "events": Check(lambda s: event_warnings(s.scene, s.matrix), EVENT_DRIVEN),
}
"""All checks, in the order in which their diagnostics are listed. A new check is a function and a line here."""
