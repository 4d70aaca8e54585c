"""Remedies: settings that avoid a problem, each tried from the starts in which the problem occurs.

Formulas name settings, but are fitted to single stacks and chains, and bound speeds from above. Each is therefore run
on the engine of the trial, from the starts that show the problem first. If none of them holds, or formulas name none,
substeps are doubled. Counted work bounds this.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from sandbox.measure.preflight.diagnostic import Diagnostic, TriedRemedy, floor_3_digits
from sandbox.measure.preflight.trial_ensemble import NAMING_KINDS, TrialEnsemble, cost_of, is_among, preparation_of
from sandbox.measure.preflight.trial_run import run_trial
from sandbox.measure.preflight.tunnelling import ONE_DETECTION_PER_STEP
from sandbox.measure.proportion import Proportion
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SettingsError

REMEDIES_EFFORT = 0.5
"""s, counted work of all remedies of a scene."""
MARGIN = 2.0
"""Margin of a safe dt in spreads of the starts: each of two bodies that meet may be faster by one."""
MAX_DOUBLINGS = 5
"""Largest number of times that substeps are doubled, or dt is halved."""


@dataclass
class RemedyTrials:
    """Trials of remedies for the problems that an ensemble of trial runs shows."""

    ensemble: TrialEnsemble
    left: float = REMEDIES_EFFORT
    """s, counted work that is left"""

    def with_tried(self, found: Diagnostic) -> Diagnostic:
        """Return a diagnostic of a problem that occurs, with the remedies that were tried, up to one that holds."""
        tried: list[TriedRemedy] = []
        for settings, name in self._candidates(found):
            count = self._starts_with(found, settings)
            if not count.trials:
                continue
            tried.append(TriedRemedy(name, getattr(settings, name), count))
            if tried[-1].holds:
                break
        return replace(found, tried=tuple(tried)) if tried else found

    def _candidates(self, found: Diagnostic) -> Iterator[tuple[Settings, str]]:
        """Yield settings with one change and the name of it: those of formulas, cheapest first, then shorter steps."""
        own, details = self.ensemble.settings, found.details
        predicted = [self._changed(name, int(details[name])) for name in ("substeps", "iterations") if name in details]
        safe_dt = float(details.get("safe_dt", 0.0)) / (1.0 + MARGIN * self.ensemble.starts.spread)
        predicted += [self._changed("dt", float(floor_3_digits(safe_dt)))] if 0.0 < safe_dt < own.dt else []
        yield from sorted((each for each in predicted if each), key=lambda each: self._factor(each[0]))
        by_dt = found.kind in NAMING_KINDS and self.ensemble.engine in ONE_DETECTION_PER_STEP
        for power in range(1, MAX_DOUBLINGS + 1):
            shorter = float(floor_3_digits(own.dt / 2**power))
            changed = self._changed("dt", shorter) if by_dt else self._changed("substeps", own.substeps * 2**power)
            if changed:
                yield changed

    def _changed(self, name: str, value: float) -> tuple[Settings, str] | None:
        """Return settings with one change, and its name; None if the value is no change, or not allowed."""
        own = self.ensemble.settings
        if getattr(own, name) == value or (name != "dt" and value < getattr(own, name)):
            return None
        try:
            return own.replace(**{name: value}), name
        except SettingsError:
            return None

    def _factor(self, settings: Settings) -> float:
        """Return an upper bound of the work with settings relative to that of the ensemble."""
        own = self.ensemble.settings
        return max(1.0, settings.iterations / own.iterations * own.h / settings.h)

    def _starts_with(self, found: Diagnostic, settings: Settings) -> Proportion:
        """Return in how many starts a problem occurs with settings, up to the first; of 0 if no run is affordable."""
        ensemble = self.ensemble
        shown = ensemble.starts_with(found)
        order = [*shown, *(k for k in range(len(ensemble.findings)) if k not in shown)]
        preparation = preparation_of(ensemble.scene)
        cost, tried, hits = ensemble.run_cost * self._factor(settings) + preparation, 0, 0
        for number in order:
            if cost > self.left or hits:
                break
            start = ensemble.starts.start(number)
            trial = run_trial(ensemble.scene, start, settings, ensemble.engine, ensemble.duration)
            if trial is None:
                break
            self.left -= cost_of(trial) + preparation
            tried += 1
            hits += is_among(found, tuple(trial.findings()), ensemble.scene)
        return Proportion(hits, tried)
