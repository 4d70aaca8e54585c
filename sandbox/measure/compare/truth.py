"""Truth: the best that is known of a scene, whoever is judged by it."""

from dataclasses import dataclass
from typing import Literal

from sandbox.engines.registry import ENGINES
from sandbox.measure.closed_form import solution
from sandbox.measure.compare.closed import as_run
from sandbox.measure.compare.horizon import NUDGE, agree_until, perturb
from sandbox.measure.compare.patience import TookTooLongError, patient_run
from sandbox.measure.compare.refined import refined
from sandbox.measure.forecast.events import event_warnings
from sandbox.measure.run import run
from sandbox.scene.meetings import meetings
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Trajectory

PATIENCE = 120.0
"""s that `exact` may take; longer, and the refined truth is used."""
DOUBTFUL = 10.0
"""s that it may take where the forecast is that it will give up: what has not come to rest by then may get there."""

TruthKind = Literal["closed_form", "exact", "refined"]


@dataclass(frozen=True, eq=False)
class Truth:
    """What a scene does, as well as it can be known."""

    kind: TruthKind
    about: str
    """where it is from, in a few words"""
    trajectory: Trajectory
    trusted_until: float
    """s; the last frame at which neither a finer step nor a nudge changes any position by more than the tolerance"""


def bare(settings: Settings) -> Settings:
    """Return settings with only the frames' times kept; every choice is left to the engine."""
    return Settings(dt=settings.dt, record_every=settings.record_every)


def truth_of(scene: Scene, settings: Settings, tolerance: float) -> Truth | None:
    """Return the first truth there is: closed form, `exact`, or a fixed step refined until it agrees with itself.

    It depends on the scene, on the times of its frames and on the tolerance, never on the engine that is judged.
    None where no engine can run the scene.

    Args:
        scene: of what.
        settings: give dt and which frames are kept.
        tolerance: of positions, m.

    Raises:
        TooLargeError: the frames would not fit into memory.
    """
    form = solution(scene)
    if form is not None:
        return Truth("closed_form", form.about, as_run(form, settings), scene.world.duration)

    note = ""
    exact = ENGINES.get("exact")
    if exact is not None and not exact.missing(scene, bare(settings)):
        doubtful = next(event_warnings(scene, meetings(scene)), None) is not None
        try:
            found = patient_run(scene, "exact", bare(settings), DOUBTFUL if doubtful else PATIENCE)
        except TookTooLongError as error:
            note = f"; exact was {error}"
        else:
            if found.status == "ok":
                until = _horizon(scene, "exact", bare(settings), found, tolerance)
                return Truth("exact", f"event-driven, models the whole scene{_limit(scene, until)}", found, until)
            note = f"; exact {found.status}: {found.reason}"

    finest = refined(scene, settings, tolerance)
    if finest is None:
        return None
    horizon = _horizon(scene, finest.engine, finest.settings, finest.trajectory, tolerance)
    until = min(finest.agrees_until, horizon)
    cause = f"; {finest.about}" if until == finest.agrees_until else _limit(scene, until)
    times = "once" if finest.halvings == 1 else f"{finest.halvings} times"
    about = f"{finest.engine}, dt halved {times}{cause}{note}"
    return Truth("refined", about, finest.trajectory, until)


def _horizon(scene: Scene, engine: str, settings: Settings, found: Trajectory, tolerance: float) -> float:
    """Return until when a nudge changes nothing beyond the tolerance, s."""
    other = perturb(scene)
    if other is None:
        return scene.world.duration
    again = run(other, engine, audit=False, **settings.model_dump())
    return agree_until(found, again, scene, tolerance)


def _limit(scene: Scene, until: float) -> str:
    return f"; moving a body by {NUDGE:g} m changes what comes later" if until < scene.world.duration else ""
