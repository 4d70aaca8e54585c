"""Verdicts: how an engine did, in a word and a badge."""

import math
from typing import Literal

from sandbox.measure.compare import Comparison, Row
from sandbox.report.colours import COLOURS, number_of
from sandbox.report.page.markup import Markup, joined, named, tag
from sandbox.report.page.wording import number

NEGLIGIBLE = 1e-6
"""The share of the tolerance that passes for right."""

Shade = Literal["good", "fair", "bad", "none"]


def look_of(engine: str) -> str:
    """Return the class that bears an engine's colour."""
    return f"e{number_of(engine)}"


def looks_of(comparison: Comparison) -> dict[str, str]:
    """Return the class that bears the colour of each row, by the row's `name`: its engine's, or of a sweep its own."""
    rows = comparison.rows
    return {
        row.name: f"e{k % len(COLOURS)}" if any(each.set for each in rows) else look_of(row.engine)
        for k, row in enumerate(rows)
    }


def engine_name(engine: str, look: str | None = None) -> Markup:
    """Return an engine's name, or a row's, beside its colour.

    Args:
        engine: the name.
        look: the class that bears the colour; by default the engine's.
    """
    shown = look_of(engine) if look is None else look
    return tag("span", tag("span", class_=f"swatch {shown}", aria_hidden="true"), named(engine), class_="look")


def badge(word: str, shade: Shade, about: str | None = None) -> Markup:
    """Return a word on a patch of colour."""
    return tag("span", word, class_=f"badge {shade}", title=about)


def verdict_of(row: Row, tolerance: float) -> tuple[str, Shade]:
    """Return in a few words how an engine did against the truth."""
    error = row.score.max_position
    missed, phantom = row.count("missed"), row.count("phantom")
    if row.status == "refused":
        return "unsupported", "none"
    if row.status != "ok":
        return row.status, "bad"
    if error is None:
        return "not judged", "none"
    first = min((event.when for event in row.events or () if event.kind == "missed"), default=math.inf)
    if missed and (row.first_divergence is None or first <= row.first_divergence):
        return f"{missed:,} missed", "bad"
    if row.first_divergence is not None:
        return f"diverges at {number(row.first_divergence)} s", "bad" if error > 10.0 * tolerance else "fair"
    if phantom:
        return f"{phantom:,} phantom", "fair"
    return ("matches", "good") if error <= NEGLIGIBLE * tolerance else ("within tolerance", "good")


def badge_of(row: Row, tolerance: float) -> Markup:
    """Return the badge of an engine's verdict."""
    return badge(*verdict_of(row, tolerance), about=row.reason)


KEY: tuple[tuple[str, Shade, str], ...] = (
    ("matches", "good", "error at most a millionth of the tolerance"),
    ("within tolerance", "good", "error within the tolerance while the truth is trusted"),
    (
        "diverges at",
        "fair",
        "error exceeds the tolerance from that time on; red where it exceeds ten times the tolerance",
    ),
    ("missed", "bad", "number of contacts that the engine missed, the first before any body diverged"),
    ("unsupported", "none", "the engine does not support the scene"),
)
"""What the words mean."""


def key() -> Markup:
    """Return what the badges mean."""
    return tag("dl", *(joined(tag("dt", badge(word, shade)), tag("dd", about)) for word, shade, about in KEY))
