"""Attribution of an engine's error to its settings: reruns with one setting changed at a time, then with two."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any, get_args

from sandbox.engines.registry import ENGINES
from sandbox.jsonable import in_json
from sandbox.measure.compare.metrics import METRICS, EvaluationContext
from sandbox.measure.run.bounded_run import RunTimeoutError, bounded_run
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SettingsError

MAX_EXPLAINED_RATIO = 0.9
"""A change that leaves more than this fraction of the error does not explain it."""
SUFFICIENT_RATIO = 0.01
"""If one change leaves no more than this fraction of the error, no pairs are tried."""
MAX_PAIRED = 4
"""Number of settings tried in pairs: those whose changes lower the error most."""
RERUN_LIMIT = 30.0
"""Counted cost, s, that one rerun may have."""
EQUAL_RATIO = 1.01
"""Changes whose remaining errors differ by no more than this factor are equally effective."""
ROUNDING = 1e-9
"""A change that leaves no more than this fraction of the error has removed it: the rest is rounding."""
FACTOR = 4
"""Factor by which a count is raised: iterations, substeps, persistence."""
NOT_CHANGED: Mapping[str, str] = {"record_every": "it selects the recorded frames and does not change the run"}
"""Settings that are not changed, and why."""


@dataclass(frozen=True)
class SettingEffect:
    """Result of a rerun with one or two settings changed."""

    setting: str = field(metadata=in_json(key="knob"))
    """name of the setting; for two settings, a text with both"""
    value: bool | float | str
    """new value; empty for two settings"""
    status: str
    """`ok`, `diverged`, `failed`, `refused`, `stopped` if it took too long, `same` if the setting had that value
    already"""
    reason: str | None
    """reason for a status other than `ok`"""
    max_position_error: float | None
    """m, up to the same time"""
    ratio: float | None
    """new error / old error; below 1 is better"""
    changes: Mapping[str, Any] = field(default_factory=dict)
    """all settings that differ"""

    @property
    def label(self) -> str:
        """Setting and new value, such as `dt = 0.005`."""
        return self.setting if " = " in self.setting else f"{self.setting} = {_text(self.value)}"

    @property
    def _ratio(self) -> float:
        """The ratio, infinite if it is unknown."""
        return math.inf if self.ratio is None else self.ratio


def one_at_a_time(
    context: EvaluationContext, engine: str, settings: Settings, before: float
) -> tuple[SettingEffect, ...]:
    """Rerun an engine with one setting changed at a time; if none of the changes suffices, also with two changed.

    Args:
        context: scene and truth of the run.
        engine: name of the engine.
        settings: settings of the run; choices left to the engine are None.
        before: largest position error of the unchanged run, m.

    Raises:
        TooLargeError: the frames of a run would not fit into memory.
    """
    rerun = _Rerun(context, engine, settings, ENGINES[engine].resolve(context.scene, settings), before)
    single = [rerun.effect(*change) for change in setting_changes(rerun.resolved)]
    if min((each._ratio for each in single), default=math.inf) <= SUFFICIENT_RATIO:
        return tuple(single)
    pairs = (rerun.effect(f"{a.label} and {b.label}", "", {**a.changes, **b.changes}) for a, b in _pairs(single))
    return (*single, *pairs)


@dataclass(frozen=True)
class _Rerun:
    """The run to be explained."""

    context: EvaluationContext
    engine: str
    settings: Settings
    resolved: Settings
    before: float

    def effect(self, setting: str, value: Any, changes: dict[str, Any]) -> SettingEffect:
        """Return the effect of some changes."""
        effect = SettingEffect(setting, value, "same", "already set", self.before, 1.0, changes)
        if all(getattr(self.resolved, key) == new for key, new in changes.items()):
            return effect
        unknown = replace(effect, status="refused", max_position_error=None, ratio=None)
        try:
            settings = self.settings.replace(**changes)
        except SettingsError as error:
            return replace(unknown, reason=error.faults[0].message)
        missing = ENGINES[self.engine].missing(self.context.scene, settings)
        if missing:
            return replace(unknown, reason="; ".join(missing))
        try:
            run, _ = bounded_run(self.context.scene, self.engine, settings, RERUN_LIMIT, audit=False)
        except RunTimeoutError as error:
            return replace(unknown, status="stopped", reason=str(error))
        unknown = replace(unknown, status=run.status, reason=run.reason)
        after = METRICS["max_position"].measure(run, self.context)
        if after is None or not math.isfinite(after):
            return unknown
        return replace(unknown, max_position_error=after, ratio=after / self.before)


def setting_changes(settings: Settings) -> Iterator[tuple[str, Any, dict[str, Any]]]:
    """Yield the changes to be tried: the setting, its new value, and all settings that this changes.

    Each field of `Settings` but those of `NOT_CHANGED`: of a choice every other value, of a switch the other one, of a
    count four times as many, of any other number 0 if that is allowed, otherwise half. Fields that are None are
    settings that the engine does not have.

    Args:
        settings: as the engine resolved them.
    """
    for name, info in Settings.model_fields.items():
        value = getattr(settings, name)
        if name in NOT_CHANGED or value is None:
            continue
        if name == "dt":  # with the same recorded frames
            yield name, value / 2.0, {"dt": value / 2.0, "record_every": settings.record_every * 2}
        elif isinstance(value, bool):
            yield name, not value, {name: not value}
        elif isinstance(value, str):
            yield from ((name, word, {name: word}) for word in _literals(info.annotation) if word != value)
        elif isinstance(value, int):
            yield name, FACTOR * value, {name: FACTOR * value}
        else:
            changed = 0.0 if _is_allowed(settings, name, 0.0) else value / 2.0
            yield name, changed, {name: changed}


def _literals(annotation: Any) -> tuple[str, ...]:
    """Return the values of a Literal, or of a Literal or None."""
    parts = get_args(annotation)
    return tuple(word for part in parts for word in ((part,) if isinstance(part, str) else _literals(part)))


def _is_allowed(settings: Settings, name: str, value: float) -> bool:
    try:
        settings.replace(**{name: value})
    except SettingsError:
        return False
    return True


def _pairs(effects: Iterable[SettingEffect]) -> Iterator[tuple[SettingEffect, SettingEffect]]:
    """Yield the pairs of changes that are worth a rerun: every two methods, and every two of the best changes.

    Two methods can remove an error together that neither removes alone, such as an exact integrator and the time of
    impact. Of the values of one setting that are equally effective, the first stands for all. Changes without any
    effect are left out, and dt and substeps are not combined.
    """
    effective = [each for each in effects if each.status == "ok" and each.ratio is not None and each.ratio != 1.0]
    by_setting: dict[str, list[SettingEffect]] = {}
    for each in effective:
        same = by_setting.setdefault(each.setting, [])
        if not any(_is_equal(each, other) for other in same):
            same.append(each)
    methods = [each for same in by_setting.values() for each in same if isinstance(each.value, str | bool)]
    strongest = sorted((min(same, key=lambda e: e._ratio) for same in by_setting.values()), key=lambda e: e._ratio)
    best = strongest[:MAX_PAIRED]
    chosen = [*methods, *(each for each in best if each not in methods)]
    for a, b in combinations(chosen, 2):
        settings = {a.setting, b.setting}
        is_candidate = all(each in methods for each in (a, b)) or all(each in best for each in (a, b))
        if is_candidate and len(settings) == 2 and settings != {"dt", "substeps"}:
            yield a, b


def _is_equal(a: SettingEffect, b: SettingEffect) -> bool:
    return a._ratio <= EQUAL_RATIO * b._ratio and b._ratio <= EQUAL_RATIO * a._ratio


def verdict(engine: str, effects: tuple[SettingEffect, ...], before: float) -> str:
    """Return a sentence with the change that lowers the error most.

    Args:
        engine: name of the engine.
        effects: effects of the changes.
        before: error of the unchanged run, m.
    """
    usable = [each for each in effects if each.status == "ok" and each.ratio is not None]
    lowest = min((each._ratio for each in usable), default=math.inf)
    # The first of equally effective changes: they differ by rounding.
    best = next((each for each in usable if each._ratio <= max(EQUAL_RATIO * lowest, ROUNDING)), None)
    if best is None:
        return f"{engine}: no other setting could be tried"
    if best._ratio > MAX_EXPLAINED_RATIO:
        limit = 1 - MAX_EXPLAINED_RATIO
        return f"{engine}: no other setting lowers the error of {before:.3g} m by more than {limit:.0%}"
    after = "0 m" if best.max_position_error == 0.0 else f"{best.max_position_error:.3g} m"
    return (
        f"{engine}: the most effective change is {best.label}: it reduces the error from {before:.3g} m to "
        f"{after} (×{best.ratio:.2g})"
    )


def _text(value: bool | float | str) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
