"""Forecasts: the table of all forecasts, and the warnings that they give of a scene."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sandbox.measure.forecast.chains import chain_warnings
from sandbox.measure.forecast.entries import entry_warnings
from sandbox.measure.forecast.events import event_warnings
from sandbox.measure.forecast.joint_starts import joint_start_warnings
from sandbox.measure.forecast.kicks import kick_warnings
from sandbox.measure.forecast.laid import Laid, laid
from sandbox.measure.forecast.orbits import orbit_warnings
from sandbox.measure.forecast.overlaps import overlap_warnings
from sandbox.measure.forecast.passages import ANOTHER, ANOTHER_BODY, Passage, farther, passages
from sandbox.measure.forecast.speeds import Speeds
from sandbox.measure.forecast.springs import damper_warnings, spring_warnings
from sandbox.measure.forecast.stacks import stack_warnings
from sandbox.measure.forecast.stretch import stretch_warnings
from sandbox.measure.forecast.warning import ROUNDING, Figures, Warning, at_most
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix, reach
from sandbox.scene.description.fixed import Plane, mask_of
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene

ENOUGH_ITERATIONS = 3
"""With fewer, bouncing groups can gain energy on pymunk. Measured on break shots of 6 to 36 balls, e = 0.95 and 1, 240
to 3840 Hz: up to five times after one iteration, in 5 of 54 by a tenth after two, in none after three. The reference
gained none at one."""

COARSE = 1e-3
"""Share of a radius that the rounding of positions may take."""

LOST = 0.1
"""The share of a substep's way that rounding may take: positions are sums of such ways, each rounded alike. Measured
with a ball of 1 m at 1 m/s, steps of 0.01 s (`sandbox extremes --axes offset`): see there."""

FAILED = "failed_forecast"
"""Kind of the warning that stands for a forecast that raised an exception."""

EVENT_DRIVEN = frozenset({"exact"})
"""Engines that take no steps, and refuse what overlaps."""


@dataclass(frozen=True)
class Situation:
    """A scene and the settings it is to run with, and what several forecasts derive from them."""

    scene: Scene
    settings: Settings

    @cached_property
    def meet(self) -> ContactMatrix:
        """Which bodies can touch what."""
        return contact_matrix(self.scene)

    @cached_property
    def close(self) -> Laid:
        """Pairs of bodies that lie on or in each other at the start."""
        return laid(self.scene)


@dataclass(frozen=True)
class Forecast:
    """One forecast: a function of a situation, and the engines that it applies to."""

    find: Callable[[Situation], Iterable[Warning]]
    engines: frozenset[str] | None = None
    """None: every engine that takes steps"""

    def concerns(self, engine: str) -> bool:
        """Return whether it applies to an engine."""
        return engine not in EVENT_DRIVEN if self.engines is None else engine in self.engines


def warnings(scene: Scene, settings: Settings | None = None, engine: str | None = None) -> list[Warning]:
    """Return what the formulas foretell of a scene, without running it; only what concerns one engine, if given.

    A forecast that fails unexpectedly becomes a warning of kind `failed_forecast`; the others still answer.
    """
    situation = Situation(scene, scene.solver if settings is None else settings)
    found: list[Warning] = []
    for name, forecast in FORECASTS.items():
        if engine is not None and not forecast.concerns(engine):
            continue
        try:
            found += forecast.find(situation)
        except Exception as error:  # noqa: BLE001, one forecast's fault must not cost the answers of the others
            message = f"the forecast {name!r} failed with {type(error).__name__}: {error}; please report this scene"
            found.append(Warning(FAILED, message, {"forecast": name}))
    return found


def _duration(scene: Scene, settings: Settings) -> Iterator[Warning]:
    if settings.dt > scene.world.duration * (1.0 + ROUNDING):
        message = (
            f"dt, {settings.dt:g} s, is longer than the run, {scene.world.duration:g} s: it ends within its first "
            "step, in which no contact is found"
        )
        yield Warning("duration", message, {"dt": settings.dt, "duration": scene.world.duration})


def _tunnelling(scene: Scene, settings: Settings, meet: ContactMatrix) -> Iterator[Warning]:
    times = farther(settings)
    at_risk = [passage for passage in passages(scene, meet) if passage.odds(settings.h / times) > ROUNDING]
    own = {passage.thing for passage in at_risk if not passage.struck}
    at_risk = [passage for passage in at_risk if not passage.struck or passage.thing not in own]
    for passage, things in alike(at_risk):
        odds = passage.odds(settings.h / times)
        safe = passage.safe_h * settings.substeps * times
        way = passage.speed * settings.h
        thing = passage.thing if passage.thing in (ANOTHER, ANOTHER_BODY) else repr(passage.thing)
        if things:
            thing += f" and {things:,} other{'s' if things > 1 else ''} like it"
        ball = repr(passage.ball)
        if passage.others:
            ball += f" and {passage.others:,} other{'s' if passage.others > 1 else ''} about as fast"
        if passage.struck:
            ball += ", struck by others,"
        message = (
            f"{ball} can approach {thing} at up to {passage.speed:.4g} m/s, {way:.3g} m per substep, and tunnel "
            f"through it undetected: odds up to {100 * odds:.3g} %; dt <= {at_most(safe)} s is safe"
        )
        figures: Figures = {
            "ball": passage.ball,
            "thing": passage.thing,
            "others": things,
            "speed": passage.speed,
            "odds": odds,
            "safe_dt": safe,
        }
        if passage.struck:
            figures["struck"] = True
        yield Warning("tunnelling", message, figures)


def _depth(scene: Scene, settings: Settings, meet: ContactMatrix) -> Iterator[Warning]:
    """Yield what gets behind the surface of a plane by more than its half width before the contact is found.

    A contact is found at the end of a substep, up to v·h deep; a plane pushes a body out from there. `bisect`, `swept`
    and `shrink` go back to the moment of impact.
    """
    if settings.detection not in (None, "discrete"):
        return
    bodies, speeds = scene.bodies, Speeds(scene, meet)
    layers = reach(scene, bodies)
    movers = meet.touches & ~bodies.fixed & (bodies.thin > 0.0)
    found: dict[tuple[str, float], tuple[str, float, int]] = {}
    for plane, name in zip(scene.fixed, scene.fixed_names, strict=False):
        able = np.flatnonzero(movers & (layers & mask_of(plane.layers, scene.layers) != 0))
        if not isinstance(plane, Plane) or not len(able):
            continue
        speed = speeds.toward(plane)[able]
        k = int(np.argmax(speed / bodies.thin[able]))
        key = bodies.names[able[k]], float(speed[k])
        first, half, count = found.get(key, (name, float(bodies.thin[able[k]]), -1))
        found[key] = first, half, count + 1
    for (body, top), (name, half, others) in found.items():
        way = top * settings.h
        if way <= half * (1.0 + ROUNDING):
            continue
        safe = settings.dt * half / way
        more = f" and {others:,} other{'s' if others > 1 else ''} like it" if others else ""
        message = (
            f"{body!r} can hit {name!r}{more} at up to {top:.4g} m/s and penetrate by {way:.3g} m before the contact "
            f"is detected; dt <= {at_most(safe)} s keeps that below its half width, {half:.3g} m"
        )
        figures: Figures = {"ball": body, "thing": name, "speed": top, "depth": way, "safe_dt": safe}
        yield Warning("depth", message, figures)


def alike(found: Iterable[Passage]) -> list[tuple[Passage, int]]:
    """Return the first of the passages that differ only in what is passed, and how many others there are like it."""
    groups: dict[tuple[str, float, float], tuple[Passage, int]] = {}
    for passage in found:
        key = passage.ball, passage.speed, passage.safe_h
        first, count = groups.get(key, (passage, -1))
        groups[key] = first, count + 1
    return list(groups.values())


def _iterations(settings: Settings, meet: ContactMatrix) -> Iterator[Warning]:
    if meet.mutual and settings.iterations < ENOUGH_ITERATIONS and meet.restitution > 0:
        what = "balls" if meet.ball_ball else "bodies"
        noun = "iteration" if settings.iterations == 1 else "iterations"
        message = (
            f"{settings.iterations} {noun} with bouncing {what}: groups can gain energy; "
            f"use iterations >= {ENOUGH_ITERATIONS}"
        )
        yield Warning("iterations", message, {"iterations": settings.iterations})


def _rounding(scene: Scene, settings: Settings, meet: ContactMatrix) -> Iterator[Warning]:
    bodies = scene.bodies
    colliders = meet.touches & ~bodies.fixed
    if colliders.any():
        spacing = np.spacing(np.abs(bodies.position[colliders]).max(axis=1)) / bodies.thin[colliders]
        worst = float(spacing.max())
        if worst > COARSE:
            name = bodies.names[int(np.flatnonzero(colliders)[np.argmax(spacing)])]
            message = (
                f"{name!r} is so far from the origin that its position is rounded to {worst:.2g} of its radius; "
                "move the scene closer to it"
            )
            yield Warning("rounding", message, {"ball": name, "share": worst})
            return
        way = np.hypot(*bodies.velocity[colliders].T) * settings.h
        size = np.spacing(np.abs(bodies.position[colliders]).max(axis=1))
        lost = np.divide(0.5 * size, way, out=np.zeros_like(way), where=way > 0.0)
        worst = float(lost.max())
        if worst > LOST:
            name = bodies.names[int(np.flatnonzero(colliders)[np.argmax(lost)])]
            message = (
                f"{name!r} is so far from the origin that rounding changes its displacement of "
                f"{way[np.argmax(lost)]:.3g} m per substep by up to {100 * worst:.2g} %; move the scene closer to it"
            )
            yield Warning("rounding", message, {"ball": name, "share": worst})


FORECASTS: dict[str, Forecast] = {
    "duration": Forecast(lambda s: _duration(s.scene, s.settings)),
    "tunnelling": Forecast(lambda s: _tunnelling(s.scene, s.settings, s.meet)),
    "depth": Forecast(lambda s: _depth(s.scene, s.settings, s.meet)),
    "entry": Forecast(lambda s: entry_warnings(s.scene, s.settings, s.meet)),
    "overlap": Forecast(lambda s: overlap_warnings(s.scene, s.meet, s.close)),
    "iterations": Forecast(lambda s: _iterations(s.settings, s.meet), frozenset({"pymunk"})),
    "rounding": Forecast(lambda s: _rounding(s.scene, s.settings, s.meet)),
    "kicks": Forecast(lambda s: kick_warnings(s.scene, s.settings, s.meet)),
    "joints": Forecast(lambda s: joint_start_warnings(s.scene)),
    "springs": Forecast(lambda s: spring_warnings(s.scene, s.settings)),
    "dampers": Forecast(lambda s: damper_warnings(s.scene, s.settings), frozenset({"reference"})),
    "orbits": Forecast(lambda s: orbit_warnings(s.scene, s.settings, s.meet)),
    "chains": Forecast(lambda s: chain_warnings(s.scene, s.settings)),
    "stretch": Forecast(lambda s: stretch_warnings(s.scene, s.settings)),
    "stacks": Forecast(lambda s: stack_warnings(s.scene, s.settings, s.close)),
    "events": Forecast(lambda s: event_warnings(s.scene, s.meet), EVENT_DRIVEN),
}
"""All forecasts, in the order in which their warnings are listed. A new one is a function in a module of its own and a
line here."""
