"""Analysis of billiard shots: success odds, aim windows, sensitivity and predictability horizon."""

from sandbox.measure.shots.horizon import horizon
from sandbox.measure.shots.odds import odds
from sandbox.measure.shots.sensitivity import sensitivity
from sandbox.measure.shots.windows import windows

__all__ = ["horizon", "odds", "sensitivity", "windows"]
