"""Analysis of billiard shots: success odds, aim windows, sensitivity and predictability horizon."""

from sandbox.measure.shots.aim_windows import windows
from sandbox.measure.shots.monte_carlo import odds
from sandbox.measure.shots.predictability import horizon
from sandbox.measure.shots.sensitivity import sensitivity

__all__ = ["horizon", "odds", "sensitivity", "windows"]
