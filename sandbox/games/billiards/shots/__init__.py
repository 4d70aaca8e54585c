"""Analysis of billiard shots: success odds, aim windows, sensitivity and predictability horizon."""

from sandbox.games.billiards.shots.aim_windows import windows
from sandbox.games.billiards.shots.monte_carlo import odds
from sandbox.games.billiards.shots.predictability import horizon
from sandbox.games.billiards.shots.sensitivity import sensitivity

__all__ = ["horizon", "odds", "sensitivity", "windows"]
