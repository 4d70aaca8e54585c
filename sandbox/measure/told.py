"""Told: who is told what is being done, while it is done."""

from collections.abc import Callable

Told = Callable[[str], None]
"""Called with what is being done now."""


def nobody(_: str) -> None:
    """Tell nobody."""
