"""Why: which choice an engine's error depends on, found by changing one at a time, then two."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any, get_args

from pydantic import ValidationError

from sandbox.engines.registry import ENGINES
from sandbox.measure.bounded_run import TookTooLongError, bounded_run
from sandbox.measure.compare.errors import errors
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

MATTERS = 0.9
"""A change that leaves more of the error than this does not explain it."""
SUFFICES = 0.01
"""Where one change leaves no more of the error than this, no two are tried together."""
PAIRED = 4
"""Choices that alone leave least, and are tried two at a time whatever they are."""
LIMIT = 30.0
"""Counted cost, s, that one rerun may have."""
ALIKE = 1.01
"""Changes whose remaining errors differ by no more than this factor do equally well."""
ROUNDING = 1e-9
"""A change that leaves no more of the error than this has removed it."""
FACTOR = 4
"""By which a count is raised: iterations, substeps, persistence."""
NOT_TRIED: Mapping[str, str] = {"record_every": "it selects the recorded frames and does not change the run"}
"""Settings that are not changed, and why."""


@dataclass(frozen=True)
class Knob:
    """Result of a rerun with one or two settings changed."""

    knob: str
    """name of the setting"""
    value: float | str
    """new value; for two settings, a text with both"""
    status: str
    """`ok`, `diverged`, `failed`, `refused`, `stopped` if it took too long, `same` if the setting had that value
    already"""
    reason: str | None
    max_position_error: float | None
    """m, up to the same time"""
    ratio: float | None
    """new error / old error; below 1 is better"""
    changes: Mapping[str, Any] = field(default_factory=dict)
    """all settings that differ"""

    def document(self) -> dict[str, Any]:
        """Return the result as a JSON object."""
        return {**vars(self), "changes": dict(self.changes)}

    @property
    def label(self) -> str:
        """Setting and new value, such as `dt = 0.005`."""
        return self.knob if " = " in self.knob else f"{self.knob} = {_text(self.value)}"


def knobs(settings: Settings) -> Iterator[tuple[str, Any, dict[str, Any]]]:
    """Yield each setting that an engine has, what it is set to, and the settings that this changes.

    All fields of `Settings` but those of `NOT_TRIED`: of a word every other, of a switch the other, of a count four
    times as many, of a figure 0 where that is allowed, else half. A setting that is None the engine does not have.

    Args:
        settings: as the engine filled them in.
    """
    for name, info in Settings.model_fields.items():
        value = getattr(settings, name)
        if name in NOT_TRIED or value is None:
            continue
        if name == "dt":  # every frame that was kept still is
            yield name, value / 2.0, {"dt": value / 2.0, "record_every": settings.record_every * 2}
        elif isinstance(value, bool):
            yield name, not value, {name: not value}
        elif isinstance(value, str):
            yield from ((name, word, {name: word}) for word in _words(info.annotation) if word != value)
        else:
            wanted = (
                FACTOR * value if isinstance(value, int) else 0.0 if _is_allowed(settings, name, 0.0) else value / 2.0
            )
            yield name, wanted, {name: wanted}


def _words(annotation: Any) -> tuple[str, ...]:
    """Return the words of a Literal, or of a Literal or None."""
    parts = get_args(annotation)
    return tuple(word for part in parts for word in ((part,) if isinstance(part, str) else _words(part)))


def _is_allowed(settings: Settings, name: str, value: float) -> bool:
    try:
        settings.replace(**{name: value})
    except ValidationError:
        return False
    return True


def turned(
    scene: Scene, engine: str, asked: Settings, truth: Trajectory, until: float, before: float
) -> tuple[Knob, ...]:
    """Rerun an engine with one choice changed at a time, and where none of these suffices, with two.

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
    filled = ENGINES[engine].resolve(scene, asked)

    def tried(knob: str, value: Any, changes: dict[str, Any]) -> Knob:
        if all(getattr(filled, key) == new for key, new in changes.items()):
            return Knob(knob, value, "same", "already set", before, 1.0, changes)
        try:
            settings = asked.replace(**changes)
        except ValidationError as error:
            return Knob(knob, value, "refused", error.errors()[0]["msg"], None, None, changes)
        missing = ENGINES[engine].missing(scene, settings)
        if missing:
            return Knob(knob, value, "refused", "; ".join(missing), None, None, changes)
        try:
            again, _ = bounded_run(scene, engine, settings, LIMIT, audit=False)
        except TookTooLongError as error:
            return Knob(knob, value, "stopped", str(error), None, None, changes)
        after = errors(again, truth, ~scene.bodies.fixed).until(until).max_position
        known = after is not None and math.isfinite(after)
        return Knob(
            knob, value, again.status, again.reason, after if known else None,
            after / before if known and after is not None else None, changes,
        )  # fmt: skip

    alone = [tried(*knob) for knob in knobs(filled)]
    if min(map(_ratio, alone), default=math.inf) <= SUFFICES:
        return tuple(alone)
    return (*alone, *(tried(f"{a.label} and {b.label}", "", {**a.changes, **b.changes}) for a, b in _pairs(alone)))


def _pairs(tried: Iterable[Knob]) -> Iterator[tuple[Knob, Knob]]:
    """Yield the changes that are worth a try together: every two methods, and the best of all.

    Two methods may do together what neither does alone, such as flight without an error and the time of an impact. Of
    values of one choice that leave as much, the first stands for all. Those without any effect are left out, and the
    step is made smaller in one way.
    """
    able = [knob for knob in tried if knob.status == "ok" and knob.ratio is not None and knob.ratio != 1.0]
    kinds: dict[str, list[Knob]] = {}
    for knob in able:
        same = kinds.setdefault(knob.knob, [])
        if not any(_ratio(each) <= ALIKE * _ratio(knob) and _ratio(knob) <= ALIKE * _ratio(each) for each in same):
            same.append(knob)
    methods = [knob for same in kinds.values() for knob in same if isinstance(knob.value, str | bool)]
    best = sorted((min(same, key=_ratio) for same in kinds.values()), key=_ratio)[:PAIRED]
    chosen = [*methods, *(knob for knob in best if knob not in methods)]
    for a, b in combinations(chosen, 2):
        both = {a.knob, b.knob}
        together = all(knob in methods for knob in (a, b)) or all(knob in best for knob in (a, b))
        if together and len(both) == 2 and both != {"dt", "substeps"}:
            yield a, b


def verdict(engine: str, tried: tuple[Knob, ...], before: float) -> str:
    """Say which change lowers the error most."""
    usable = [knob for knob in tried if knob.status == "ok" and knob.ratio is not None]
    least = min(map(_ratio, usable), default=math.inf)
    # The first of those that do as well: what they differ by then is rounding.
    best = next((knob for knob in usable if _ratio(knob) <= max(ALIKE * least, ROUNDING)), None)
    if best is None:
        return f"{engine}: no other setting could be tried"
    if _ratio(best) > MATTERS:
        return f"{engine}: no other setting lowers the error of {before:.3g} m by more than {1 - MATTERS:.0%}"
    left = "0 m" if best.max_position_error == 0.0 else f"{best.max_position_error:.3g} m"
    return (
        f"{engine}: the most effective change is {best.label}: it reduces the error from {before:.3g} m to "
        f"{left} (×{best.ratio:.2g})"
    )


def _ratio(knob: Knob) -> float:
    return math.inf if knob.ratio is None else knob.ratio


def _text(value: float | str) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
