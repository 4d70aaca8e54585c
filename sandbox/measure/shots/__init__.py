"""Shots asked about: how likely they are, what they hang on, and until when anybody could tell."""

from sandbox.measure.shots.horizon import horizon
from sandbox.measure.shots.odds import odds
from sandbox.measure.shots.sensitivity import sensitivity
from sandbox.measure.shots.windows import windows

__all__ = ["horizon", "odds", "sensitivity", "windows"]
