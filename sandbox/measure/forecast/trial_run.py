"""Trial run: a short headless run of the scene itself, which confirms or refutes what the formulas warn of.

Formulas bound speeds, but cannot know in which phase of a step a ball meets a wall, which ball a crowd throws out, or
how a tower settles. `forecast` therefore runs the first part of the scene, with its own settings, on the engine that is
asked about, and looks at what happened. The work is bounded by counts, so that the answer never depends on the machine:
at most `MOST_SUBSTEPS` substeps, `MOST_BODY_SUBSTEPS` substeps times bodies, and on `exact` `MOST_EVENTS` events. That
takes 0.1 to 1 s. Where it covers the whole run, warnings that it refutes become notes; where it covers a part, what it
saw is added to what the formulas say.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from sandbox.engines.contract import Exhaustion, Refusal
from sandbox.engines.registry import ENGINES, start
from sandbox.measure.energy import energies
from sandbox.measure.forecast.events import event_warning
from sandbox.measure.forecast.forecasts import warnings
from sandbox.measure.forecast.laid import laid
from sandbox.measure.forecast.passages import ANOTHER, ANOTHER_BODY
from sandbox.measure.forecast.stacks import UNEQUAL
from sandbox.measure.forecast.warning import Figure, Figures, Warning, at_most
from sandbox.measure.run import run
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.joint_arrays import LinkKind
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.scene.validate.bodies import height_above
from sandbox.trajectory import Trajectory

MOST_SUBSTEPS, MOST_BODY_SUBSTEPS = 10_000, 60_000
"""Of a trial run; the second is substeps times bodies."""
FEWEST_SUBSTEPS = 20
"""A shorter trial run tells nothing, and is left out."""
MOST_EVENTS = 100_000
"""Of a trial run on `exact`: a tenth of what that allows in a simulated second."""
WINDOW = 0.02
"""s over which events are counted: some tens of the longest hops of what comes to rest."""
MOST_EXACT_STEPS = 5_000
"""Frames of a trial run on `exact`."""
MOST_NAMED = 5
"""Bodies named in warnings of one kind."""

TORN = 0.1
"""The share of its length by which a joint may be off before it counts as torn."""
FALLEN = 0.5
"""The share of its width by which a body of a stack may have moved before the stack counts as fallen."""
GAINED = 0.1
"""The share of the energy at stake by which energy may exceed that of the start before it counts as created: what
position correction and explicit Euler in free fall add is less at usual steps."""

NAMES_BODIES = frozenset({"tunnelling", "depth"})
"""Kinds of which a trial run names each body at risk, with its own speed, and the formulas only bounds."""

FASTER = 2.0
"""How many times faster than in the first part of a scene impacts may make bodies in the rest."""

REFUTABLE = frozenset({"tunnelling", "depth", "chain", "mass_ratio", "stack", "spring", "iterations", "orbit"})
"""Kinds of warnings that a trial run to the end of the scene confirms or refutes on its engine."""


@dataclass(frozen=True)
class Trial:
    """A trial run, or the first part of one."""

    scene: Scene
    """with the trial's own duration"""
    settings: Settings
    run: Trajectory
    whole: bool
    """It covers the scene's whole duration."""

    @property
    def engine(self) -> str:
        """Where it ran."""
        return str(self.run.info["engine"])

    @property
    def said(self) -> str:
        """How much of the scene it covers, in words."""
        return f"a trial run on {self.engine}" + ("" if self.whole else f" of the first {self.until:.3g} s")

    @property
    def until(self) -> float:
        """Its duration, s."""
        return self.scene.world.duration

    def may_pass(self, foretold: Warning) -> bool:
        """Return whether a body may tunnel later, as far as a part of the scene tells.

        Formulas bound what impacts by others can do far above what they do: such a speed counts only where bodies were
        seen to get as fast, to within a factor of `FASTER`.
        """
        if not foretold.figures.get("struck"):
            return True
        velocity = self.run.velocity
        fastest = float(np.nanmax(np.hypot(velocity[..., 0], velocity[..., 1])))
        reach = float(foretold.figures["safe_dt"]) / self.settings.substeps * float(foretold.figures["speed"])
        return FASTER * fastest * self.settings.h > reach

    def findings(self) -> Iterator[Warning]:
        """Yield a warning for all that went wrong."""
        if self.run.status == "diverged" or not np.isfinite(self.run.position[-1]).all():
            reason = self.run.reason or "the state is not finite"
            yield Warning("diverged", f"{self.said} diverged: {reason}", {"engine": self.engine})
            return
        yield from self._missed()
        yield from self._deep()
        yield from self._torn()
        yield from self._fallen()
        yield from self._gained()

    def _missed(self) -> Iterator[Warning]:
        """Yield the contacts that the audit found missed, each body at its own closing speed."""
        run, bodies = self.run, self.scene.bodies
        seen: set[tuple[int, int]] = set()
        named: dict[int, int] = {}
        for time, (a, b) in zip(run.missed_time.tolist(), run.missed_pair.tolist(), strict=True):
            if (a, b) in seen:
                continue
            seen.add((a, b))
            named[b if b < 0 else 0] = named.get(b if b < 0 else 0, 0) + 1
            if named[b if b < 0 else 0] > MOST_NAMED:
                continue
            frame = max(0, int(np.searchsorted(run.time, time, side="right")) - 1)
            velocity = run.velocity[frame, a] - (run.velocity[frame, b] if b >= 0 else 0.0)
            speed = float(np.hypot(*velocity))
            reach = float(bodies.thin[a]) + (float(bodies.thin[b]) if b >= 0 else self._half(-1 - b))
            thing = bodies.names[b] if b >= 0 else self.scene.fixed_names[-1 - b]
            safe = reach / speed * self.settings.substeps if speed > 0.0 else math.inf
            right = f"; dt <= {at_most(safe)} s is safe at that speed" if math.isfinite(safe) else ""
            message = (
                f"{bodies.names[a]!r} tunnels through {thing!r}, or is detected too late, at {time:.3g} s of "
                f"{self.said}, at {speed:.4g} m/s or {speed * self.settings.h:.3g} m per substep{right}"
            )
            figures: Figures = {"ball": bodies.names[a], "thing": thing, "speed": speed, "time": time, "odds": 1.0}
            if math.isfinite(safe):
                figures["safe_dt"] = safe
            yield Warning("tunnelling", message, figures)

    def _half(self, number: int) -> float:
        """Return half the thickness of a fixed thing, m."""
        thing = self.scene.fixed[number]
        return thing.thickness / 2.0 if isinstance(thing, Wall) else thing.radius if isinstance(thing, Post) else 0.0

    def _deep(self) -> Iterator[Warning]:
        """Yield the deepest ball in a plane, where its centre came to lie behind the surface."""
        run, bodies = self.run, self.scene.bodies
        able = np.asarray([e.collides != "none" for e in bodies.elements], np.bool_)[bodies.element] & ~bodies.fixed
        discs = np.flatnonzero(able & (bodies.core > 0.0))
        for thing, name in zip(self.scene.fixed, self.scene.fixed_names, strict=False):
            if not isinstance(thing, Plane) or not len(discs):
                continue
            flat = run.position[:, discs].reshape(-1, 2)
            depth = -height_above(thing, flat).reshape(len(run.time), len(discs))
            depth = np.where(depth[0] > 0.0, 0.0, depth)  # what starts there is another matter
            frame, k = np.unravel_index(int(depth.argmax()), depth.shape)
            if depth[frame, k] <= 0.0:
                continue
            body = bodies.names[discs[k]]
            speed = float(np.hypot(*run.velocity[max(0, int(frame) - 1), discs[k]]))
            message = (
                f"the centre of {body!r} is {depth[frame, k]:.3g} m behind the surface of {name!r} at "
                f"{run.time[frame]:.3g} s of {self.said}, before the contact is detected"
            )
            figures: Figures = {"ball": body, "thing": name, "depth": float(depth[frame, k]), "speed": speed}
            figures["time"] = float(run.time[frame])
            yield Warning("depth", message, figures)

    def _torn(self) -> Iterator[Warning]:
        error = self.run.info["joint_error"]
        if error is not None and error > TORN:
            message = f"the joint error reaches {error:.2g} of a joint's length in {self.said}"
            yield Warning("chain", message, {"share": min(float(error), 1e300)})

    def _fallen(self) -> Iterator[Warning]:
        """Yield the body of a stack that moved most, if it moved from where it stood."""
        run, bodies = self.run, self.scene.bodies
        if not any(self.scene.world.gravity) or bodies.round.all() or (bodies.velocity[~bodies.fixed] != 0.0).any():
            return
        if len(self.scene.links) or self.scene.thrusts or self.scene.drives or self.scene.attractions:
            return
        close = laid(self.scene)
        stacked = np.unique(np.concatenate((close.first, close.second)))
        stacked = stacked[~bodies.fixed[stacked]]
        moved = np.hypot(*np.moveaxis(run.position[:, stacked] - run.position[0, stacked], 2, 0)).max(axis=0)
        share = moved / (2.0 * bodies.thin[stacked])
        if not len(share) or share.max() <= FALLEN:
            return
        k = int(share.argmax())
        both = ~bodies.fixed[close.first] & ~bodies.fixed[close.second]
        mass_a, mass_b = bodies.mass[close.first[both]], bodies.mass[close.second[both]]
        ratio = float((np.maximum(mass_a, mass_b) / np.minimum(mass_a, mass_b)).max(initial=1.0))
        message = (
            f"the stacked body {bodies.names[stacked[k]]!r} moves by {share[k]:.3g} of its width in {self.said}; "
            "more solver.iterations or a smaller dt may stabilise the stack"
        )
        kind = "mass_ratio" if ratio >= UNEQUAL else "stack"
        yield Warning(kind, message, {"body": bodies.names[stacked[k]], "moved": float(share[k])})

    def _gained(self) -> Iterator[Warning]:
        gain = gained(self.run, self.scene)
        if gain > GAINED:
            springs = len(self.scene.links.of(LinkKind.SPRING, LinkKind.ROTARY_SPRING)) > 0
            message = (
                f"energy rises by a fraction {gain:.3g} of the exchanged energy in {self.said}{self._by_impacts()}"
            )
            yield Warning("spring" if springs else "energy", message, {"gained": min(gain, 1e300)})

    def _by_impacts(self) -> str:
        """Say that impacts may be the cause: Newton's restitution with friction, off the centre of mass."""
        meet = contact_matrix(self.scene)
        surfaces = meet.surfaces
        rough = bool((meet.touching & (surfaces.restitution > 0.0) & (surfaces.friction > 0.0)).any())
        if not (meet.solids and rough) or self.run.info["settings"].get("impact") != "newton":
            return ""
        return (
            "; restitution with friction can create energy for shapes other than balls: on reference, "
            "solver.impact = 'dissipative' prevents that"
        )


def gained(run: Trajectory, scene: Scene) -> float:
    """Return the most by which energy exceeded that of the start, as a share of what is at stake.

    0 where work is done, and where the energy of the start is not finite.

    At stake is the kinetic energy of the start, and what gravity, springs and attraction gave or took since; at
    least what lifts each body by its own width.
    """
    links = scene.links
    if scene.thrusts or scene.drives or any(scene.world.wind) or len(links.of(LinkKind.MOTOR)):
        return 0.0
    if contact_matrix(scene).surfaces.kicks.any():
        return 0.0
    every = energies(run, scene)
    total = every.total
    if not math.isfinite(total[0]):  # bodies that attract each other start in one place: their potential is infinite
        return 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        gain = float(np.nanmax(total - total[0]))
        stake = float(every.kinetic[0]) + float(np.nanmax(np.abs(every.potential - every.potential[0])))
        moves = ~scene.bodies.fixed
        lift = math.hypot(*scene.world.gravity) * float((scene.bodies.mass * 2.0 * scene.bodies.thin)[moves].sum())
        stake = max(stake, lift)
    if not math.isfinite(gain):
        return math.inf
    return gain / stake if stake > 0.0 else 0.0


def try_out(scene: Scene, settings: Settings, engine: str, cover: float = 1.0) -> Trial | None:
    """Run the first part of a scene, at most a share `cover` of it.

    None where an engine refuses it, or the part would be too short to tell anything.
    """
    chosen = ENGINES[engine]
    if chosen.missing(scene, settings) or not len(scene.bodies):
        return None
    most = min(MOST_SUBSTEPS, MOST_BODY_SUBSTEPS // len(scene.bodies))
    needed = math.ceil(scene.world.duration / settings.dt) * settings.substeps
    if most < min(FEWEST_SUBSTEPS, needed):
        return None
    most = min(most, math.ceil(cover * needed)) if cover < 1.0 else most
    steps = max(1, most // settings.substeps)
    whole = needed <= most
    duration = scene.world.duration if whole else steps * settings.dt
    part = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": duration})})
    frames = duration / settings.dt
    every = max(1, int(frames // MOST_SUBSTEPS))
    try:
        done = run(part, engine, **settings.model_copy(update={"record_every": every}).model_dump())
    except (MemoryError, Refusal):
        return None
    if done.status == "refused":
        return None
    return Trial(part, chosen.resolve(scene, settings), done, whole)


def try_exact(scene: Scene, settings: Settings, cover: float = 1.0) -> tuple[float, float, bool] | None:
    """Run a scene on `exact` until `MOST_EVENTS` events.

    Returns:
        The largest rate of events, 1/s, inf where it gave up; how long it ran, s, and whether that was all of the
        scene. None where it refuses the scene.
    """
    if ENGINES["exact"].missing(scene, settings):
        return None
    simulation = start(scene, "exact", settings)
    rate, before, window = 0.0, 0, max(1, math.ceil(WINDOW / settings.dt))
    try:
        steps = math.ceil(scene.world.duration / settings.dt)
        most = min(MOST_EXACT_STEPS, math.ceil(cover * steps))
        for step in range(1, min(steps, most) + 1):
            simulation.step()
            events = int(simulation.work["events"])
            if step % window == 0:
                rate, before = max(rate, (events - before) / (window * settings.dt)), events
            if events > MOST_EVENTS:
                return max(rate, (events - before) / (((step - 1) % window + 1) * settings.dt)), simulation.time, False
        return rate, simulation.time, steps <= most
    except Exhaustion:
        return math.inf, simulation.time, False
    finally:
        simulation.close()


class Answer(NamedTuple):
    """What is foretold of a scene."""

    warnings: list[Warning]
    refuted: list[Warning]
    """notes: what formulas warn of and a trial run of the whole scene did not show"""
    tried: "Tried | None"
    """the trial run; None where there was none"""

    @property
    def covered(self) -> bool:
        """Whether a trial run covered the whole scene."""
        return self.tried is not None and self.tried.whole


class Tried(NamedTuple):
    """Where and how long a scene was tried out."""

    engine: str
    duration: float
    """s"""
    whole: bool
    """It was all of the scene."""


def forecast(scene: Scene, settings: Settings | None = None, engine: str | None = None, cover: float = 1.0) -> Answer:
    """Return what would go wrong in a run, by formulas and by a trial run.

    Args:
        scene: what is to run.
        settings: without, the scene's own.
        engine: where it is to run; without, every engine's formulas count, and the trial run is on the first engine
            that takes steps and does not refuse the scene.
        cover: the share of the scene that a trial run may cover at most; 0 for none.
    """
    settings = scene.solver if settings is None else settings
    told = warnings(scene, settings, engine)
    if engine is None and ENGINES["exact"].missing(scene, settings):
        told = [each for each in told if each.kind != "event_rate"]
    if cover <= 0.0:
        return Answer(told, [], None)
    if engine == "exact":
        return _with_events(told, scene, settings, cover)
    names = [engine] if engine is not None else [name for name in STEPPING if name in ENGINES]
    if engine is None and scene.surface is not None:
        names = []  # a floor is a compiled kernel on every engine, and the first use of that takes half a minute
    trial = next((done for name in names if (done := try_out(scene, settings, name, cover)) is not None), None)
    if trial is None:
        return Answer(told, [], None)
    concerned = warnings(scene, settings, trial.engine) if engine is None else told
    merged = _merged(told, concerned, trial)
    return Answer(*merged, Tried(trial.engine, trial.until, trial.whole))


def _merged(told: list[Warning], concerned: list[Warning], trial: Trial) -> tuple[list[Warning], list[Warning]]:
    """Return what remains of the formulas' warnings with what a trial run found, and what that refutes, as notes.

    Args:
        told: by the formulas.
        concerned: those of them that concern the engine of the trial run.
        trial: the trial run.
    """
    found = list(trial.findings())
    if any(each.kind == "diverged" for each in found):
        return [*told, *found], []
    families = {FAMILY.get(each.kind, each.kind) for each in found}
    seen = {_whom(each, trial): each for each in reversed(found) if each.kind in NAMES_BODIES}
    kept: list[Warning] = []
    refuted: list[Warning] = []
    for each in told:
        if each.kind not in REFUTABLE or each not in concerned:
            kept.append(each)
        elif each.kind not in NAMES_BODIES:
            is_refuted = trial.whole and FAMILY.get(each.kind, each.kind) not in families
            (refuted if is_refuted else kept).append(each)
        elif (where := (each.kind, each.figures["ball"], each.figures["thing"])) in seen:
            time = seen.pop(where).figures["time"]
            kept.append(replace(each, figures={**each.figures, "seen_at": time}))
        else:
            (refuted if trial.whole or not trial.may_pass(each) else kept).append(each)
    spoken = {FAMILY.get(each.kind, each.kind) for each in kept if each.kind not in NAMES_BODIES}
    unforeseen = [
        each
        for each in found
        if (_whom(each, trial) in seen if each.kind in NAMES_BODIES else FAMILY.get(each.kind, each.kind) not in spoken)
    ]
    return [*kept, *unforeseen], [_note(each, trial) for each in refuted]


def _whom(found: Warning, trial: Trial) -> tuple[str, Figure, Figure]:
    """Return the kind of a finding, the body at risk, and what it passes as formulas call it."""
    thing = found.figures.get("thing", "")
    if thing in trial.scene.bodies.names:
        number = trial.scene.bodies.names.index(str(thing))
        movers = trial.scene.bodies.round[~trial.scene.bodies.fixed]
        thing = thing if trial.scene.bodies.fixed[number] else ANOTHER if movers.all() else ANOTHER_BODY
    return found.kind, found.figures.get("ball", ""), thing


STEPPING = ("pymunk", "reference")
"""Engines that a trial run takes where none is asked about, in this order."""

FAMILY = {"mass_ratio": "stack", "energy": "iterations", "orbit": "iterations"}
"""Kinds between which a trial run does not tell: it sees that a stack falls, or that energy grows."""


def _note(refuted: Warning, trial: Trial) -> Warning:
    message = f"{trial.said} did not show this, but another phase, seed or engine may: {refuted.message}"
    return Warning(refuted.kind, message, refuted.figures)


def _with_events(told: list[Warning], scene: Scene, settings: Settings, cover: float) -> Answer:
    """Return the warnings with what a trial run on `exact` says of the rate of events."""
    tried = try_exact(scene, settings, cover) if len(scene.bodies) else None
    if tried is None:
        return Answer(told, [], None)
    rate, duration, whole = tried
    done = Tried("exact", duration, whole)
    others = [each for each in told if each.kind != "event_rate"]
    if (warning := event_warning(rate, len(scene.bodies))) is not None:
        return Answer([*others, warning], [], done)
    return Answer(others if whole else told, [], done)
