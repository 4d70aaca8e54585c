"""Judging: a verdict of a run."""

from sandbox.measure.extremes.cell import Outcome
from sandbox.measure.extremes.rules import RULES, Evidence

EXACT = 1e-6
"""The share up to which an answer counts as exact."""


def judge(seen: Evidence) -> Outcome:
    """Return the verdict of a run that was not refused: the first rule that is broken, or how far off it is.

    A run that ended early has broken the rule `bounded`, where it diverged, or `work`, where the engine gave up.
    """
    run, case = seen.run, seen.case
    if run.status == "diverged":
        return Outcome("failed", str(run.reason), "bounded")
    if run.status != "ok":
        return Outcome("failed", str(run.reason), "work")
    figures: dict[str, float] = {}
    for name, rule in RULES.items():
        if name == "bounded" or name in case.rules:
            wrong = rule(seen)
            if wrong is not None:
                return Outcome("failed", wrong, name, figures=figures)
        if name == "bounded":  # a state that is not finite has no figures
            figures |= {"moved": float((seen.moved / seen.width).max()), "gained": seen.gained}
            if run.info["joint_error"] is not None:
                figures["joints"] = run.info["joint_error"]
    if case.error is None:
        return Outcome("degraded", "no rule is broken; the exact solution is not known", figures=figures)
    error = case.error(seen.scene, run)
    if error > case.useless:
        reason = f"the error is {error:.3g} of {case.error_of}; the limit is {case.useless:g}"
        return Outcome("failed", reason, "truth", error, figures=figures)
    if error <= EXACT:
        return Outcome("exact", f"within {EXACT:g} of {case.error_of}", None, error, figures=figures)
    return Outcome("degraded", f"the error is {error:.3g} of {case.error_of}", None, error, figures=figures)
