"""Standalone pymunk programs: the Python source of a program that computes the states of the pymunk engine."""

from sandbox.engines.pymunk_adapter.program.obstacles import Obstacle, ProgramError, obstacles
from sandbox.engines.pymunk_adapter.program.source import program_text

__all__ = ["Obstacle", "ProgramError", "obstacles", "program_text"]
