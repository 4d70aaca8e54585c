"""Forecast for a game: the diagnostics of `sandbox check` in order of severity, with remedies for a loop of frames."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from sandbox.measure.preflight import Diagnostic, notes, run_preflight, warnings
from sandbox.measure.preflight.diagnostic import ROUNDING
from sandbox.measure.preflight.tunnelling import intervals
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SettingsError

ELEMENT_KEYS = ("ball", "body", "joint", "thing", "first")
"""Details that name the element of a diagnostic, in the order of preference."""
GAME_NOTES = frozenset({"flight", "pixels", "seams"})
"""Kinds of notes that matter for the settings of a game."""
DETECTION_KINDS = frozenset({"tunnelling", "depth", "entry"})
"""Kinds of diagnostics that depend on how often contacts are detected."""
UNKNOWN_ODDS = 0.5
"""Rank of a diagnostic without odds among those that have them: formulas predict it, but no run has shown it."""


@dataclass(frozen=True)
class Risk:
    """Problem that a setting can have, with its odds, element and remedy."""

    kind: str
    """identifier of the problem, such as `tunnelling`"""
    element: str | None
    """name of the body, joint or static object; None if the whole scene is concerned"""
    odds: float | None
    """odds, 0 to 1: the fraction of the trial runs that show it, or an upper bound; None if the formula gives none"""
    is_observed: bool
    """whether a trial run has shown it"""
    message: str
    """description with a remedy"""
    safe_substeps: int | None
    """substeps of a frame from which on it cannot happen; None if substeps are no remedy, or too many would be
    needed"""

    @property
    def rank(self) -> float:
        """Severity for sorting: observed problems first, then by their odds."""
        odds = UNKNOWN_ODDS if self.odds is None else self.odds
        return 1.0 + odds if self.is_observed else odds


def forecast(scene: Scene, settings: Settings, engine: str, fps: float) -> list[Risk]:
    """Return the problems of a setting by formulas and by trial runs, the most severe first.

    Args:
        scene: the scene.
        settings: the setting.
        engine: name of the engine.
        fps: frames per second, for the substeps that avoid a problem.
    """
    return _ordered(run_preflight(scene, settings, engine).warnings, settings, engine, fps)


def formula_forecast(scene: Scene, settings: Settings, engine: str, fps: float) -> list[Risk]:
    """Return the problems of a setting by formulas only, the most severe first; the arguments are those of `forecast`.

    The measured run of the setting need not show them: a body can tunnel at a slightly different speed.
    """
    return _ordered(warnings(scene, settings, engine), settings, engine, fps)


def game_notes(scene: Scene, engine: str, zoom: float) -> list[str]:
    """Return the notes about a scene that matter for the settings of a game.

    Args:
        scene: the scene, with the present setting as its `[solver]`.
        engine: name of the engine.
        zoom: px/m; at 1 the unit of length is known to be the pixel, and no note asks whether it is.
    """
    kinds = GAME_NOTES - {"pixels"} if zoom == 1.0 else GAME_NOTES
    return [each.message for each in notes(scene, engine) if each.kind in kinds]


def _ordered(found: Iterable[Diagnostic], settings: Settings, engine: str, fps: float) -> list[Risk]:
    return sorted((_risk(each, settings, engine, fps) for each in found), key=lambda risk: -risk.rank)


def _risk(found: Diagnostic, settings: Settings, engine: str, fps: float) -> Risk:
    details = found.details
    # Some engines detect contacts once a step, so that substeps do not prevent tunnelling.
    has_effect = found.kind not in DETECTION_KINDS or intervals(settings.replace(substeps=2), engine) == 2
    element = next((str(details[key]) for key in ELEMENT_KEYS if key in details), None)
    return Risk(
        kind=found.kind,
        element=element,
        odds=found.odds,
        is_observed=found.is_observed,
        message=found.message,
        safe_substeps=_safe_substeps(details.get("safe_dt"), settings, fps) if has_effect else None,
    )


def _safe_substeps(safe_dt: float | int | str | None, settings: Settings, fps: float) -> int | None:
    """Return the substeps of a frame whose length is at most that of a safe dt with the present substeps."""
    if safe_dt is None or not 0.0 < float(safe_dt) < math.inf:
        return None
    needed = math.ceil(settings.substeps / (fps * float(safe_dt)) * (1.0 - ROUNDING))
    try:
        return settings.replace(substeps=max(needed, 1)).substeps
    except SettingsError:  # more than a setting may have
        return None
