"""Truth: the best that is known of a scene, whoever is judged by it."""

from dataclasses import dataclass
from typing import Literal

from sandbox.engines.registry import ENGINES
from sandbox.measure.bounded_run import TookTooLongError, bounded_run
from sandbox.measure.closed_form import solution
from sandbox.measure.compare.closed import as_run
from sandbox.measure.compare.horizon import NUDGE, agree_until, perturb
from sandbox.measure.compare.refined import refined
from sandbox.measure.compare.witness import confirmed
from sandbox.measure.forecast.events import event_warnings
from sandbox.measure.run import run
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

LIMIT = 120.0
"""Counted cost, s, that `exact` may have; beyond, the refined truth is used."""
DOUBTFUL = 10.0
"""Counted cost, s, that it may have where the forecast is that it will give up: bodies may come to rest by then."""

TruthKind = Literal["closed_form", "exact", "refined"]


@dataclass(frozen=True, eq=False)
class Truth:
    """Best known solution of a scene."""

    kind: TruthKind
    about: str
    """source of the truth, in a few words"""
    trajectory: Trajectory
    trusted_until: float
    """s; last frame up to which no finer step, second method or perturbation moves a body by more than the tolerance"""
    witness: str | None = None
    """second method that confirms a refined truth"""
    difference: float = 0.0
    """m; of a refined truth, its largest distance from the previous halving of dt: smaller errors mean nothing"""

    def __repr__(self) -> str:
        """Return kind, source and end of the truth."""
        return f"<Truth {self.kind}: {self.about}; trusted until {self.trusted_until:.4g} s>"


def bare(settings: Settings) -> Settings:
    """Return settings with only the frames' times kept; every choice is left to the engine."""
    return Settings(dt=settings.dt, record_every=settings.record_every)


def truth_of(scene: Scene, settings: Settings, tolerance: float) -> Truth | None:
    """Return the best that is known of a scene, or None (`seek_truth`)."""
    found = seek_truth(scene, settings, tolerance)
    return found if isinstance(found, Truth) else None


def seek_truth(scene: Scene, settings: Settings, tolerance: float) -> Truth | str:
    """Return the first truth there is: closed form, `exact`, or a fixed step refined until it agrees with itself.

    A refined answer is the truth only as far as a second method and the conservation laws confirm it (`witness`). It
    depends on the scene, on the times of its frames and on the tolerance, never on the engine that is judged.

    Args:
        scene: of what.
        settings: give dt and which frames are kept.
        tolerance: of positions, m.

    Returns:
        The truth, or why there is none.

    Raises:
        TooLargeError: the frames would not fit into memory.
    """
    form = solution(scene)
    if form is not None:
        return Truth("closed_form", form.about, as_run(form, settings), scene.world.duration)

    note = ""
    exact = ENGINES.get("exact")
    if exact is not None and not exact.missing(scene, bare(settings)):
        doubtful = next(event_warnings(scene, contact_matrix(scene)), None) is not None
        try:
            found, _ = bounded_run(scene, "exact", bare(settings), DOUBTFUL if doubtful else LIMIT, audit=False)
        except TookTooLongError as error:
            note = f"; exact was stopped: {error}"
        else:
            if found.status == "ok":
                until = _horizon(scene, "exact", bare(settings), found, tolerance)
                return Truth("exact", f"event-driven, models the whole scene{_limit(scene, until)}", found, until)
            note = f"; exact {found.status}: {found.reason}"

    finest = refined(scene, settings, tolerance)
    if finest is None:
        able = any(not engine.missing(scene, settings) for engine in ENGINES.values())
        why = "no engine reaches a result that a smaller step confirms" if able else "no engine can run the scene"
        return f"{why}{note}"
    until = min(finest.agrees_until, finest.horizon)
    cause = f"; {finest.about}" if until == finest.agrees_until else _limit(scene, until)
    confirmation = confirmed(scene, finest, settings, tolerance, until)
    times = "once" if finest.halvings == 1 else f"{finest.halvings} times"
    method = f"{finest.engine}, dt halved {times}"
    if confirmation.until < until:
        until = confirmation.until
        cause = f"; no truth is known after {until:.4g} s: {confirmation.about}"
    if until == 0.0 and scene.world.duration > 0.0:
        return f"{confirmation.about or finest.about} (unconfirmed result: {method}){note}"
    if confirmation.by is not None:
        method = f"{method}, confirmed by {confirmation.by}"
    return Truth("refined", f"{method}{cause}{note}", finest.trajectory, until, confirmation.by, finest.difference)


def _horizon(scene: Scene, engine: str, settings: Settings, found: Trajectory, tolerance: float) -> float:
    """Return until when a perturbation changes nothing beyond the tolerance, s."""
    other = perturb(scene)
    if other is None:
        return scene.world.duration
    again = run(other, engine, audit=False, **settings.model_dump())
    return agree_until(found, again, scene, tolerance)


def _limit(scene: Scene, until: float) -> str:
    moved = f"; later motion is chaotic: it changes if every body is moved by {NUDGE:g} m"
    return moved if until < scene.world.duration else ""
