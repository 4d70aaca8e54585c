"""Preflight: problems of a fixed-step run of a scene, predicted before it is run, and notes about the scene."""

from sandbox.measure.preflight.assessment import PreflightResult, TrialCoverage, run_preflight
from sandbox.measure.preflight.checks import FAILED, warnings
from sandbox.measure.preflight.diagnostic import Diagnostic, floor_3_digits
from sandbox.measure.preflight.likely_mistakes import likely_mistakes
from sandbox.measure.preflight.notes import notes
from sandbox.measure.preflight.speed_bound import SpeedBounds, top_speeds, unknown_speeds
from sandbox.measure.preflight.tunnelling import TunnellingRisk, largest_safe_dt, tunnelling_risks

__all__ = [
    "FAILED",
    "Diagnostic",
    "PreflightResult",
    "SpeedBounds",
    "TrialCoverage",
    "TunnellingRisk",
    "floor_3_digits",
    "largest_safe_dt",
    "likely_mistakes",
    "notes",
    "run_preflight",
    "top_speeds",
    "tunnelling_risks",
    "unknown_speeds",
    "warnings",
]
