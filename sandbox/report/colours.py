"""Colours: one an engine, the same on every plot and page."""

from sandbox.engines.registry import ENGINES

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7", "#56B4E9")
"""Of Okabe and Ito (2008): told apart under every common colour blindness. Their yellow is too pale on white."""


def number_of(engine: str) -> int:
    """Return which of `COLOURS` is an engine's: its place in the registry; of one that is not there, the last."""
    names = list(ENGINES)
    return names.index(engine) % len(COLOURS) if engine in names else len(COLOURS) - 1


def colour_of(engine: str) -> str:
    """Return an engine's colour."""
    return COLOURS[number_of(engine)]
