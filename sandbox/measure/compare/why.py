"""Why: which single choice an engine's error hangs on, found by changing one at a time."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import ValidationError

from sandbox.engines.registry import ENGINES
from sandbox.measure.compare.errors import errors
from sandbox.measure.compare.patience import TookTooLongError, patient_run
from sandbox.scene.model import Scene
from sandbox.scene.settings import Detection, Integrator, Joints, Settings
from sandbox.trajectory import Trajectory

MATTERS = 0.9
"""A knob that leaves more of the error than this does not explain it."""
PATIENCE = 30.0
"""s that one rerun may take."""
ALIKE = 1.01
"""Knobs whose remaining errors differ by no more than this factor do equally well."""
ROUNDING = 1e-9
"""A knob that leaves no more of the error than this has removed it."""


@dataclass(frozen=True)
class Knob:
    """One choice changed, all others as they were."""

    knob: str
    """the setting"""
    value: float | str
    """what it was changed to"""
    status: str
    """`ok`, `diverged`, `failed`, `refused`, `stopped` where it took too long, `same` where it was that already"""
    reason: str | None
    max_position_error: float | None
    """m, up to the same time"""
    ratio: float | None
    """of that to the error before: below 1 is better"""

    def document(self) -> dict[str, Any]:
        """Return it as a JSON object."""
        return dict(vars(self))


def knobs(settings: Settings, joints: bool = False) -> Iterator[tuple[str, Any, dict[str, Any]]]:
    """Yield each knob, what it is set to, and the settings that this changes.

    Args:
        settings: as the engine filled them in.
        joints: the scene has some, so that it matters how they are held.
    """
    # Every frame that was kept still is.
    yield "dt", settings.dt / 2.0, {"dt": settings.dt / 2.0, "record_every": settings.record_every * 2}
    yield "slop", 0.0, {"slop": 0.0}
    yield "iterations", settings.iterations * 4, {"iterations": settings.iterations * 4}
    choices = [("integrator", get_args(Integrator)), ("detection", get_args(Detection))]
    if joints:
        choices.append(("joints", get_args(Joints)))
    for name, words in choices:
        for word in words:
            if word != getattr(settings, name):
                yield name, word, {name: word}


def turned(
    scene: Scene, engine: str, asked: Settings, truth: Trajectory, until: float, before: float
) -> tuple[Knob, ...]:
    """Rerun an engine with one knob changed at a time.

    Args:
        scene: what to run.
        engine: its name.
        asked: the settings it was run with, choices left open still open.
        truth: against what.
        until: errors count up to here, s.
        before: the largest position error with nothing changed, m.

    Raises:
        TooLargeError: the frames of a run would not fit into memory.
    """
    found = []
    filled = ENGINES[engine].resolve(scene, asked)
    for knob, value, changes in knobs(filled, len(scene.links) > 0):
        if all(getattr(filled, key) == new for key, new in changes.items()):
            found.append(Knob(knob, value, "same", "it is so already", before, 1.0))
            continue
        try:
            settings = asked.replace(**changes)
        except ValidationError as error:
            found.append(Knob(knob, value, "refused", error.errors()[0]["msg"], None, None))
            continue
        missing = ENGINES[engine].missing(scene, settings)
        if missing:
            found.append(Knob(knob, value, "refused", "; ".join(missing), None, None))
            continue
        try:
            again = patient_run(scene, engine, settings, PATIENCE)
        except TookTooLongError as error:
            found.append(Knob(knob, value, "stopped", str(error), None, None))
            continue
        after = errors(again, truth, ~scene.bodies.fixed).until(until).max_position
        if after is None or not math.isfinite(after):
            found.append(Knob(knob, value, again.status, again.reason, None, None))
        else:
            found.append(Knob(knob, value, again.status, again.reason, after, after / before))
    return tuple(found)


def verdict(engine: str, tried: tuple[Knob, ...], before: float) -> str:
    """Say which knob moves the error most."""
    usable = [knob for knob in tried if knob.status == "ok" and knob.ratio is not None]
    least = min(map(_ratio, usable), default=math.inf)
    # The first of those that do as well: what they differ by then is rounding.
    best = next((knob for knob in usable if _ratio(knob) <= max(ALIKE * least, ROUNDING)), None)
    if best is None:
        return f"{engine}: none of the knobs could be tried"
    if _ratio(best) > MATTERS:
        return f"{engine}: no single knob lowers the error of {before:.3g} m by more than {1 - MATTERS:.0%}"
    value = f"{best.value:.4g}" if isinstance(best.value, float) else str(best.value)
    left = "to 0" if best.max_position_error == 0.0 else f"to {best.max_position_error:.3g} m (×{best.ratio:.2g})"
    return f"{engine}: {best.knob} = {value} moves the difference most, from {before:.3g} m {left}"


def _ratio(knob: Knob) -> float:
    return math.inf if knob.ratio is None else knob.ratio
