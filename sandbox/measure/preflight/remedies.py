"""Remedies: settings that avoid a problem, each tried from the starts in which the problem occurs.

Formulas name settings, but are fitted to single stacks and chains, and bound speeds from above. Each is therefore run
on the engine of the trial, from the starts that show the problem first. If none of them holds, or formulas name none,
substeps are doubled. Counted work bounds this.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from sandbox.measure.preflight.diagnostic import Diagnostic, TriedRemedy, floor_3_digits
from sandbox.measure.preflight.trial_ensemble import NAMING_KINDS, TrialEnsemble, cost_of, is_among
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
        for name, value in self._candidates(found):
            try:
                settings = self.ensemble.settings.replace(**{name: value})
            except SettingsError:  # more than a setting may have
                continue
            count = self._starts_with(found, settings)
            if not count.trials:  # the effort is used up
                break
            tried.append(TriedRemedy(name, value, count))
            if tried[-1].holds:
                break
        return replace(found, tried=tuple(tried)) if tried else found

    def _candidates(self, found: Diagnostic) -> Iterator[tuple[str, float]]:
        """Yield names and values of settings: those of the formulas, and ever shorter substeps."""
        settings, details = self.ensemble.settings, found.details
        for name in ("iterations", "substeps"):
            if name in details and int(details[name]) > getattr(settings, name):
                yield name, int(details[name])
        safe_dt = float(details.get("safe_dt", 0.0)) / (1.0 + MARGIN * self.ensemble.starts.spread)
        if 0.0 < safe_dt < settings.dt:
            yield "dt", float(floor_3_digits(safe_dt))
        by_step = found.kind in NAMING_KINDS and self.ensemble.engine in ONE_DETECTION_PER_STEP
        for doubling in range(1, MAX_DOUBLINGS + 1):
            if by_step:
                yield "dt", float(floor_3_digits(settings.dt / 2**doubling))
            else:
                yield "substeps", settings.substeps * 2**doubling

    def _starts_with(self, found: Diagnostic, settings: Settings) -> Proportion:
        """Return in how many starts a problem occurs with settings, up to the first; of 0 if no run is affordable."""
        ensemble = self.ensemble
        shown = ensemble.starts_with(found)
        order = [*shown, *(k for k in range(len(ensemble.findings)) if k not in shown)]
        factor = settings.iterations / ensemble.settings.iterations * ensemble.settings.h / settings.h
        cost, tried, hits = ensemble.run_cost * max(1.0, factor) + ensemble.preparation, 0, 0
        for number in order:
            if cost > self.left or hits:
                break
            start = ensemble.starts.start(number)
            trial = run_trial(ensemble.scene, start, settings, ensemble.engine, ensemble.duration)
            if trial is None:
                break
            self.left -= cost_of(trial) + ensemble.preparation
            tried += 1
            hits += is_among(found, tuple(trial.findings()), ensemble.scene)
        return Proportion(hits, tried)
