"""Standalone pymunk programs: the Python source of a program that computes the states of the pymunk engine."""

from sandbox.pymunk_export.obstacles import Obstacle, ProgramError, obstacles, with_divided_walls
from sandbox.pymunk_export.source import program_text

__all__ = ["Obstacle", "ProgramError", "obstacles", "program_text", "with_divided_walls"]
