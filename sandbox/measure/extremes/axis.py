"""Axis: one thing that is driven to the extreme; pair: two at once."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Literal

from sandbox.measure.extremes.case import Case, Document
from sandbox.measure.extremes.cell import Cell
from sandbox.measure.extremes.setup import COMMON, Setup

Scale = Literal["log", "linear", "whole"]
"""How the way from one level to another is halved; `whole` numbers by their logarithm too."""


@dataclass(frozen=True)
class Axis:
    """One parameter of a case, its levels, and which forecast is about it."""

    name: str
    about: str
    unit: str
    """empty for what has none"""
    case: Case
    parameter: str
    levels: tuple[float, ...]
    """from the easiest to the hardest"""
    quick: tuple[float, ...]
    """a few of them"""
    scale: Scale = "log"
    setups: tuple[Setup, ...] = COMMON
    kind: str | None = None
    """of warnings that are about it"""
    blamed: frozenset[str] = frozenset()
    """rules whose failure such a warning foretells"""
    happened: Callable[[Cell], bool] | None = None
    """whether it came as foretold, where failing is not the question"""

    def document(self, level: float) -> Document:
        """Return its scene at a level."""
        return self.case.document({self.parameter: level})

    def came(self, cell: Cell) -> bool:
        """Tell whether that which `kind` warns of has happened in a cell."""
        if self.happened is not None:
            return self.happened(cell)
        return cell.verdict == "failed" and cell.rule in self.blamed


@dataclass(frozen=True)
class Side:
    """One of the two axes of a pair: a parameter of its case, and its levels."""

    parameter: str
    levels: tuple[float, ...]


@dataclass(frozen=True)
class Pair:
    """Two parameters of one case: every level of one with every level of the other."""

    case: Case
    first: Side
    second: Side
    setups: tuple[Setup, ...] = COMMON

    @property
    def name(self) -> str:
        """What it is called."""
        return f"{self.case.name}: {self.first.parameter} × {self.second.parameter}"

    @property
    def levels(self) -> tuple[tuple[float, float], ...]:
        """Every combination."""
        return tuple(product(self.first.levels, self.second.levels))
