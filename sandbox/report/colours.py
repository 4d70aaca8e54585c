"""Colours of the engines in plots and pages."""

from sandbox.engines.registry import ENGINES

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7", "#56B4E9")
"""Palette of Okabe and Ito (2008), distinguishable with every common colour blindness; without its pale yellow."""


def colour_index(engine: str) -> int:
    """Return the index in `COLOURS` of an engine: its index in the registry; the last colour if it is unknown."""
    names = list(ENGINES)
    return names.index(engine) % len(COLOURS) if engine in names else len(COLOURS) - 1


def css_class_of(engine: str) -> str:
    """Return the class that has the colour of an engine in pages: `e0`, `e1` and so on."""
    return f"e{colour_index(engine)}"


def colour_of(engine: str) -> str:
    """Return the colour of an engine."""
    return COLOURS[colour_index(engine)]
