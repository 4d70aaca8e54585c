"""Trial run: a short headless run of the scene itself, which confirms or refutes the diagnostics of the formulas.

Formulas bound speeds, but cannot predict the phase of the step in which a ball reaches a wall, the ball that a crowd
ejects, or how a tower settles. `run_preflight` therefore runs the first part of the scene with its settings on the
chosen engine. The work is bounded by counts, so that the result does not depend on the machine: at most `MAX_SUBSTEPS`
substeps, `MAX_BODY_SUBSTEPS` substeps times bodies, and on `exact` `MAX_EVENTS` events. That takes 0.1 to 1 s. If it
covers the whole run, diagnostics that it refutes become notes; if it covers a part, its findings are added to those of
the formulas.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from sandbox.engines.contract import Exhaustion, Refusal
from sandbox.engines.registry import ENGINES, start
from sandbox.formatting import format_fraction, format_quantity
from sandbox.measure.metrics.invariants import conserves_energy, energy_drift, energy_gain
from sandbox.measure.missed_contacts.slender_bodies import MAX_TURN, is_slender
from sandbox.measure.preflight.checks import ITERATED, warnings
from sandbox.measure.preflight.diagnostic import Detail, Details, Diagnostic, floor_3_digits
from sandbox.measure.preflight.initial_contacts import initial_contacts
from sandbox.measure.preflight.predictability import event_warning
from sandbox.measure.preflight.stacks import MIN_MASS_RATIO
from sandbox.measure.preflight.tunnelling import ANOTHER, ANOTHER_BODY, collide_with_all
from sandbox.measure.run.run_warnings import MAX_ENERGY_GAIN
from sandbox.measure.run.runner import run
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.filters import filter_table
from sandbox.scene.compile.joint_arrays import JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Post, Wall
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SettingsError
from sandbox.scene.validate.bodies import height_above
from sandbox.trajectory import Trajectory

MAX_SUBSTEPS, MAX_BODY_SUBSTEPS = 10_000, 60_000
"""Limits of a trial run; the second is substeps times bodies."""
MIN_SUBSTEPS = 20
"""A shorter trial run is not informative and is left out."""
MAX_EVENTS = 100_000
"""Limit of a trial run on `exact`: a tenth of its own limit in a simulated second."""
EVENT_WINDOW = 0.02
"""s over which events are counted: some tens of the longest bounces of a body that comes to rest."""
MAX_EXACT_STEPS = 5_000
"""Frames of a trial run on `exact`."""
MAX_NAMED = 5
"""Largest number of bodies named in diagnostics of one kind."""

MAX_JOINT_ERROR = 0.1
"""A joint with a larger error, as a fraction of its length, has come apart."""
MAX_ENERGY_LOSS = 0.1
"""Largest fraction of the kinetic energy that a scene which conserves energy may lose."""
MAX_STACK_DISPLACEMENT = 0.5
"""A stack has fallen if one of its bodies has moved by a larger fraction of its width."""

NAMING_KINDS = frozenset({"tunnelling", "depth"})
"""Kinds for which a trial run names each body at risk with its own speed, and the formulas only bounds."""

MAX_SPEED_UP = 2.0
"""Factor by which impacts may make bodies faster in the rest of a scene than in its first part."""

REMEDIED = frozenset({"chain", "mass_ratio", "stack"})
"""Kinds of diagnostics whose remedy is tried."""
REFUTABLE = frozenset({"tunnelling", "depth", "chain", "mass_ratio", "stack", "spring", "iterations", "orbit"})
"""Kinds of diagnostics that a trial run of the whole scene confirms or refutes on its engine."""


@dataclass(frozen=True)
class TrialRun:
    """Trial run of a scene or of its first part."""

    scene: Scene
    """the scene with the duration of the trial run"""
    settings: Settings
    run: Trajectory
    whole: bool
    """whether it covers the whole duration of the scene"""

    @property
    def engine(self) -> str:
        """Name of the engine."""
        return str(self.run.info["engine"])

    @property
    def description(self) -> str:
        """Description of the trial run."""
        return f"a trial run on {self.engine}" + ("" if self.whole else f" of the first {self.until:.3g} s")

    @property
    def until(self) -> float:
        """Duration of the trial run, s."""
        return self.scene.world.duration

    def may_pass(self, predicted: Diagnostic) -> bool:
        """Return whether a body may tunnel in the rest of the scene, as far as its first part shows.

        Formulas overestimate the effect of impacts by far: such a speed counts only if bodies reached it to within a
        factor of `MAX_SPEED_UP`.
        """
        if not predicted.details.get("struck"):
            return True
        velocity = self.run.velocity
        fastest = float(np.nanmax(np.hypot(velocity[..., 0], velocity[..., 1])))
        reach = float(predicted.details["safe_dt"]) / self.settings.substeps * float(predicted.details["speed"])
        return MAX_SPEED_UP * fastest * self.settings.h > reach

    def is_blind_to(self, predicted: Diagnostic) -> bool:
        """Return whether the audit could not follow all bodies that may be what tunnels.

        It does not follow bodies whose centre of mass lies outside of them, nor the ends of slender bodies between
        frames in which they turn too far.
        """
        bodies, run = self.scene.bodies, self.run
        if predicted.kind != "tunnelling" or predicted.details["thing"] != ANOTHER_BODY:
            return False
        colliding = collide_with_all(bodies)
        if (colliding & ~bodies.fixed & (bodies.core <= 0.0)).any():
            return True
        slender = colliding & is_slender(bodies)
        turn = np.abs(np.diff(run.angle[:, slender], axis=0))
        is_sparse = run.info["settings"]["record_every"] > 1
        return bool(slender.any() and (is_sparse or (turn > MAX_TURN).any()))

    def findings(self) -> Iterator[Diagnostic]:
        """Yield a diagnostic for each problem that occurred."""
        if self.run.status == "diverged" or not np.isfinite(self.run.position[-1]).all():
            reason = self.run.reason or "the state is not finite"
            yield Diagnostic("diverged", f"{self.description} diverged: {reason}", {"engine": self.engine})
            return
        yield from self._missed_contacts()
        yield from self._penetrations()
        yield from self._broken_joints()
        yield from self._fallen_stacks()
        yield from self._energy_gains()
        yield from self._energy_losses()

    def _missed_contacts(self) -> Iterator[Diagnostic]:
        """Yield the contacts that the audit found missed, with the closing speed of each body."""
        run, bodies = self.run, self.scene.bodies
        reported: set[tuple[int, int]] = set()
        named: dict[int, int] = {}
        for time, (a, b) in zip(run.missed_time.tolist(), run.missed_pair.tolist(), strict=True):
            if (a, b) in reported:
                continue
            reported.add((a, b))
            named[b if b < 0 else 0] = named.get(b if b < 0 else 0, 0) + 1
            if named[b if b < 0 else 0] > MAX_NAMED:
                continue
            frame = max(0, int(np.searchsorted(run.time, time, side="right")) - 1)
            velocity = run.velocity[frame, a] - (run.velocity[frame, b] if b >= 0 else 0.0)
            speed = float(np.hypot(*velocity))
            reach = float(bodies.thin[a]) + (float(bodies.thin[b]) if b >= 0 else self._half_thickness(-1 - b))
            thing = bodies.names[b] if b >= 0 else self.scene.fixed_names[-1 - b]
            safe = reach / speed * self.settings.substeps if speed > 0.0 else math.inf
            details: Details = {"ball": bodies.names[a], "thing": thing, "speed": speed, "time": time, "odds": 1.0}
            pace = f"at {speed:.4g} m/s or {speed * self.settings.h:.3g} m per substep"
            if safe < self.settings.dt:
                details["safe_dt"] = safe
                what = f"tunnels through {thing!r}, or is detected too late,"
                pace += f"; dt <= {floor_3_digits(safe)} s is safe at that speed"
            else:  # too slow to tunnel: the two overlap for less than a substep, or enter from the side
                what = f"grazes {thing!r} within a substep, undetected,"
                pace += "; with a shorter dt fewer such contacts are missed, and by less"
            message = f"{bodies.names[a]!r} {what} at {time:.3g} s of {self.description}, {pace}"
            yield Diagnostic("tunnelling", message, details)

    def _half_thickness(self, number: int) -> float:
        """Return half the thickness of a static object, m."""
        thing = self.scene.fixed[number]
        return thing.thickness / 2.0 if isinstance(thing, Wall) else thing.radius if isinstance(thing, Post) else 0.0

    def _penetrations(self) -> Iterator[Diagnostic]:
        """Yield the deepest ball in a plane if its centre was behind the surface."""
        run, bodies = self.run, self.scene.bodies
        able = np.asarray([e.collides != "none" for e in bodies.elements], np.bool_)[bodies.element] & ~bodies.immovable
        filters = filter_table(self.scene, bodies)
        for index, (thing, name) in enumerate(zip(self.scene.planes, self.scene.fixed_names, strict=False)):
            discs = np.flatnonzero(able & (bodies.core > 0.0) & filters.meets_fixed(index))
            if not len(discs):
                continue
            flat = run.position[:, discs].reshape(-1, 2)
            depth = -height_above(thing, flat).reshape(len(run.time), len(discs))
            depth = np.where(depth[0] > 0.0, 0.0, depth)  # initial overlaps are another diagnostic
            frame, k = np.unravel_index(int(depth.argmax()), depth.shape)
            if depth[frame, k] <= 0.0:
                continue
            body = bodies.names[discs[k]]
            speed = float(np.hypot(*run.velocity[max(0, int(frame) - 1), discs[k]]))
            message = (
                f"the centre of {body!r} is {depth[frame, k]:.3g} m behind the surface of {name!r} at "
                f"{run.time[frame]:.3g} s of {self.description}, before the contact is detected"
            )
            details: Details = {"ball": body, "thing": name, "depth": float(depth[frame, k]), "speed": speed}
            details["time"] = float(run.time[frame])
            yield Diagnostic("depth", message, details)

    def _broken_joints(self) -> Iterator[Diagnostic]:
        error, worst = self.run.info["joint_error"], self.run.info["worst_joint"]
        if error is not None and error > MAX_JOINT_ERROR:
            size = format_quantity(worst["error"], worst["unit"])
            relative = "" if worst["unit"] == "rad" else f", {error:.2g} of its length"
            message = f"the error of the joint {worst['name']!r} reaches {size}{relative}, in {self.description}"
            if self.engine == "box2d":
                message += "; its joints are soft: more solver.substeps may not be enough under a heavy load"
            yield Diagnostic("chain", message, {"share": min(float(error), 1e300)})

    def _fallen_stacks(self) -> Iterator[Diagnostic]:
        """Yield the body of a stack that moved most, if the stack has fallen."""
        run, bodies = self.run, self.scene.bodies
        if not any(self.scene.world.gravity) or bodies.round.all() or (bodies.velocity[~bodies.fixed] != 0.0).any():
            return
        if len(self.scene.joint_arrays) or self.scene.thrusts or self.scene.drives or self.scene.attractions:
            return
        if bodies.kinematic.any():
            return
        close = initial_contacts(self.scene)
        stacked = np.unique(np.concatenate((close.first, close.second)))
        stacked = stacked[~bodies.fixed[stacked]]
        moved = np.hypot(*np.moveaxis(run.position[:, stacked] - run.position[0, stacked], 2, 0)).max(axis=0)
        fraction = moved / (2.0 * bodies.thin[stacked])
        if not len(fraction) or fraction.max() <= MAX_STACK_DISPLACEMENT:
            return
        k = int(fraction.argmax())
        both = ~bodies.fixed[close.first] & ~bodies.fixed[close.second]
        mass_a, mass_b = bodies.mass[close.first[both]], bodies.mass[close.second[both]]
        ratio = float((np.maximum(mass_a, mass_b) / np.minimum(mass_a, mass_b)).max(initial=1.0))
        remedy = "more solver.substeps" if self.engine not in ITERATED else "more solver.iterations or a smaller dt"
        message = (
            f"the stacked body {bodies.names[stacked[k]]!r} moves by {fraction[k]:.3g} of its width in "
            f"{self.description}; {remedy} may stabilise the stack"
        )
        kind = "mass_ratio" if ratio >= MIN_MASS_RATIO else "stack"
        yield Diagnostic(kind, message, {"body": bodies.names[stacked[k]], "moved": float(fraction[k])})

    def _energy_gains(self) -> Iterator[Diagnostic]:
        gain = energy_gain(self.run, self.scene)
        if gain > MAX_ENERGY_GAIN:
            springs = len(self.scene.joint_arrays.of(JointKind.SPRING, JointKind.ROTARY_SPRING)) > 0
            message = f"energy rises by a fraction {gain:.3g} of the exchanged energy in {self.description}"
            message += self._by_impacts()
            yield Diagnostic("spring" if springs else "energy", message, {"gained": min(gain, 1e300)})

    def _energy_losses(self) -> Iterator[Diagnostic]:
        """Yield a diagnostic if much energy is lost in a scene that conserves it."""
        if not conserves_energy(self.scene):
            return
        loss = energy_drift(self.run, self.scene, None, False).fraction
        if loss is not None and loss < -MAX_ENERGY_LOSS:
            message = (
                f"energy falls by {format_fraction(-loss)} of the largest kinetic energy in {self.description}, "
                "although the scene conserves it: motion that should go on slows down"
            )
            yield Diagnostic("energy_loss", message, {"lost": -loss})

    def _by_impacts(self) -> str:
        """Return the possible cause of an energy gain: Newton's restitution with friction, off the centre of mass."""
        matrix = contact_matrix(self.scene)
        surfaces = matrix.surfaces
        rough = bool((matrix.touching & (surfaces.restitution > 0.0) & (surfaces.friction > 0.0)).any())
        if not (matrix.solids and rough) or self.run.info["settings"].get("impact") != "newton":
            return ""
        return (
            "; restitution with friction can create energy for shapes other than balls: on reference, "
            "solver.impact = 'dissipative' prevents that"
        )


def run_trial(scene: Scene, settings: Settings, engine: str, cover: float = 1.0) -> TrialRun | None:
    """Run the first part of a scene, at most the fraction `cover` of it.

    None if the engine refuses the scene or the part would be too short.
    """
    chosen = ENGINES[engine]
    if chosen.missing(scene, settings) or not len(scene.bodies):
        return None
    max_substeps = min(MAX_SUBSTEPS, MAX_BODY_SUBSTEPS // len(scene.bodies))
    needed = math.ceil(scene.world.duration / settings.dt) * settings.substeps
    if max_substeps < min(MIN_SUBSTEPS, needed):
        return None
    max_substeps = min(max_substeps, math.ceil(cover * needed)) if cover < 1.0 else max_substeps
    steps = max(1, max_substeps // settings.substeps)
    whole = needed <= max_substeps
    duration = scene.world.duration if whole else steps * settings.dt
    part = scene.with_duration(duration)
    frames = duration / settings.dt
    every = max(1, int(frames // MAX_SUBSTEPS))
    try:
        done = run(part, engine, **settings.model_copy(update={"record_every": every}).model_dump())
    except (MemoryError, Refusal):
        return None
    if done.status == "refused":
        return None
    return TrialRun(part, chosen.resolve(scene, settings), done, whole)


def run_exact_trial(scene: Scene, settings: Settings, cover: float = 1.0) -> tuple[float, float, bool] | None:
    """Run a scene on `exact` up to `MAX_EVENTS` events.

    Returns:
        Largest rate of events, 1/s, inf if the engine gave up; duration, s; and whether that was the whole scene. None
            if the engine refuses the scene.
    """
    if ENGINES["exact"].missing(scene, settings):
        return None
    simulation = start(scene, "exact", settings)
    rate, before, window = 0.0, 0, max(1, math.ceil(EVENT_WINDOW / settings.dt))
    try:
        steps = math.ceil(scene.world.duration / settings.dt)
        max_steps = min(MAX_EXACT_STEPS, math.ceil(cover * steps))
        for step in range(1, min(steps, max_steps) + 1):
            simulation.step()
            events = int(simulation.work["events"])
            if step % window == 0:
                rate, before = max(rate, (events - before) / (window * settings.dt)), events
            if events > MAX_EVENTS:
                return max(rate, (events - before) / (((step - 1) % window + 1) * settings.dt)), simulation.time, False
        return rate, simulation.time, steps <= max_steps
    except Exhaustion:
        return math.inf, simulation.time, False
    finally:
        simulation.close()


class PreflightResult(NamedTuple):
    """Result of the preflight checks."""

    warnings: list[Diagnostic]
    refuted: list[Diagnostic]
    """notes: diagnostics of the formulas that a trial run of the whole scene did not show"""
    tried: "TrialCoverage | None"
    """the trial run; None if there was none"""

    @property
    def covered(self) -> bool:
        """Whether a trial run covered the whole scene."""
        return self.tried is not None and self.tried.whole


class TrialCoverage(NamedTuple):
    """Engine and duration of a trial run."""

    engine: str
    duration: float
    """s"""
    whole: bool
    """whether it covered the whole scene"""


def run_preflight(
    scene: Scene, settings: Settings | None = None, engine: str | None = None, cover: float = 1.0
) -> PreflightResult:
    """Return the diagnostics of a scene, by formulas and by a trial run.

    Args:
        scene: the scene.
        settings: settings of the run; default: those of the scene.
        engine: name of the engine; default: the formulas of every engine, and a trial run on the first engine with a
            time step that supports the scene.
        cover: fraction of the scene that a trial run may cover at most; 0 for no trial run.
    """
    settings = scene.solver if settings is None else settings
    diagnostics = warnings(scene, settings, engine)
    if engine is None and ENGINES["exact"].missing(scene, settings):
        diagnostics = [each for each in diagnostics if each.kind != "event_rate"]
    if cover <= 0.0:
        return PreflightResult(diagnostics, [], None)
    if engine == "exact":
        return _with_events(diagnostics, scene, settings, cover)
    names = [engine] if engine is not None else [name for name in STEPPING_ENGINES if name in ENGINES]
    if engine is None and scene.surface is not None:
        names = []  # a surface is a compiled kernel on every engine, whose first use takes half a minute
    trial = next((done for name in names if (done := run_trial(scene, settings, name, cover)) is not None), None)
    if trial is None:
        return PreflightResult(diagnostics, [], None)
    concerned = warnings(scene, settings, trial.engine) if engine is None else diagnostics
    found, refuted = _merge(diagnostics, concerned, trial)
    if trial.whole:
        found = [_with_tried_remedy(each, scene, settings, trial.engine) for each in found]
    return PreflightResult(found, refuted, TrialCoverage(trial.engine, trial.until, trial.whole))


def _with_tried_remedy(found: Diagnostic, scene: Scene, settings: Settings, engine: str) -> Diagnostic:
    """Return a diagnostic with the outcome of a trial run with the first of its remedies that can be tried."""
    if found.kind not in REMEDIED:
        return found
    for key in ("iterations", "substeps", "safe_dt"):
        value = found.details.get(key)
        if not value:
            continue
        name = "dt" if key == "safe_dt" else key
        try:
            changed = settings.replace(**{name: floor_3_digits(float(value)) if key == "safe_dt" else int(value)})
        except SettingsError:  # more than a setting may have
            continue
        again = run_trial(scene, changed, engine)
        if again is None or not again.whole:
            continue
        families = {_family(each) for each in again.findings()}
        holds = _family(found) not in families and "diverged" not in families
        remedy = f"{name} = {getattr(changed, name):g}"
        outcome = "does not show it" if holds else "shows it too"
        message = f"{found.message}; {'a' if holds else 'but a'} trial run with {remedy} {outcome}"
        return replace(found, message=message, details={**found.details, "remedy": remedy, "remedy_holds": holds})
    return found


def _merge(
    diagnostics: list[Diagnostic], concerned: list[Diagnostic], trial: TrialRun
) -> tuple[list[Diagnostic], list[Diagnostic]]:
    """Return the remaining diagnostics with the findings of a trial run, and the refuted ones as notes.

    Args:
        diagnostics: diagnostics of the formulas.
        concerned: those that concern the engine of the trial run.
        trial: the trial run.
    """
    found = list(trial.findings())
    if any(each.kind == "diverged" for each in found):
        return [*diagnostics, *found], []
    families = {_family(each) for each in found}
    risks = {_risk_key(each, trial): each for each in reversed(found) if each.kind in NAMING_KINDS}
    kept: list[Diagnostic] = []
    refuted: list[Diagnostic] = []
    for each in diagnostics:
        if each.kind not in REFUTABLE or each not in concerned:
            kept.append(each)
        elif each.kind not in NAMING_KINDS:
            is_refuted = trial.whole and _family(each) not in families
            (refuted if is_refuted else kept).append(each)
        elif (key := (each.kind, each.details["ball"], each.details["thing"])) in risks:
            time = risks.pop(key).details["time"]
            kept.append(replace(each, details={**each.details, "seen_at": time}))
        elif trial.is_blind_to(each):
            kept.append(each)
        else:
            (refuted if trial.whole or not trial.may_pass(each) else kept).append(each)
    kept_families = {_family(each) for each in kept if each.kind not in NAMING_KINDS}
    new = [
        each
        for each in found
        if (_risk_key(each, trial) in risks if each.kind in NAMING_KINDS else _family(each) not in kept_families)
    ]
    return [*kept, *new], [_note(each, trial) for each in refuted]


def _risk_key(found: Diagnostic, trial: TrialRun) -> tuple[str, Detail, Detail]:
    """Return the kind of a finding, the body at risk, and the obstacle as the formulas name it."""
    thing = found.details.get("thing", "")
    if thing in trial.scene.bodies.names:
        number = trial.scene.bodies.names.index(str(thing))
        movers = trial.scene.bodies.round[~trial.scene.bodies.fixed]
        thing = thing if trial.scene.bodies.fixed[number] else ANOTHER if movers.all() else ANOTHER_BODY
    return found.kind, found.details.get("ball", ""), thing


STEPPING_ENGINES = ("pymunk", "reference")
"""Engines tried for a trial run if no engine is given, in this order."""

INDISTINGUISHABLE = {"mass_ratio": "stack", "energy": "iterations", "orbit": "iterations"}
"""Kinds that a trial run cannot distinguish: it shows that a stack falls, or that energy grows."""


def _family(found: Diagnostic) -> str:
    """Return the kind of a diagnostic, or that of all which a trial run cannot tell from it."""
    if "joint" in found.details and found.kind == "mass_ratio":
        return "chain"
    return INDISTINGUISHABLE.get(found.kind, found.kind)


def _note(refuted: Diagnostic, trial: TrialRun) -> Diagnostic:
    message = f"{trial.description} did not show this, but another phase, seed or engine may: {refuted.message}"
    return Diagnostic(refuted.kind, message, refuted.details)


def _with_events(diagnostics: list[Diagnostic], scene: Scene, settings: Settings, cover: float) -> PreflightResult:
    """Return the diagnostics with the rate of events of a trial run on `exact`."""
    tried = run_exact_trial(scene, settings, cover) if len(scene.bodies) else None
    if tried is None:
        return PreflightResult(diagnostics, [], None)
    rate, duration, whole = tried
    coverage = TrialCoverage("exact", duration, whole)
    others = [each for each in diagnostics if each.kind != "event_rate"]
    if (warning := event_warning(rate, len(scene.bodies))) is not None:
        return PreflightResult([*others, warning], [], coverage)
    return PreflightResult(others if whole else diagnostics, [], coverage)
