"""Verdicts: how an engine did, in a word and a badge."""

import math
from typing import Literal

from sandbox.measure.compare import Row
from sandbox.report.colours import number_of
from sandbox.report.page.markup import Markup, joined, named, tag
from sandbox.report.page.wording import number

NEGLIGIBLE = 1e-6
"""The share of the tolerance that passes for right."""

Shade = Literal["good", "fair", "bad", "none"]


def look_of(engine: str) -> str:
    """Return the class that bears an engine's colour."""
    return f"e{number_of(engine)}"


def engine_name(engine: str) -> Markup:
    """Return an engine's name beside its colour."""
    return tag(
        "span", tag("span", class_=f"swatch {look_of(engine)}", aria_hidden="true"), named(engine), class_="look"
    )


def badge(word: str, shade: Shade, about: str | None = None) -> Markup:
    """Return a word on a patch of colour."""
    return tag("span", word, class_=f"badge {shade}", title=about)


def verdict_of(row: Row, tolerance: float) -> tuple[str, Shade]:
    """Return in a few words how an engine did against the truth."""
    error = row.score.max_position
    missed, phantom = row.count("missed"), row.count("phantom")
    if row.status == "refused":
        return "refuses", "none"
    if row.status != "ok":
        return row.status, "bad"
    if error is None:
        return "not judged", "none"
    first = min((event.when for event in row.events or () if event.kind == "missed"), default=math.inf)
    if missed and (row.first_divergence is None or first <= row.first_divergence):
        return f"misses {missed:,}", "bad"
    if row.first_divergence is not None:
        return f"off from {number(row.first_divergence)} s", "bad" if error > 10.0 * tolerance else "fair"
    if phantom:
        return f"{phantom:,} phantom", "fair"
    return ("right", "good") if error <= NEGLIGIBLE * tolerance else ("within", "good")


def badge_of(row: Row, tolerance: float) -> Markup:
    """Return the badge of an engine's verdict."""
    return badge(*verdict_of(row, tolerance), about=row.reason)


KEY: tuple[tuple[str, Shade, str], ...] = (
    ("right", "good", "off by no more than a millionth of the tolerance"),
    ("within", "good", "within the tolerance for as long as the truth is trusted"),
    ("off from", "fair", "further off than the tolerance from that time on; red beyond ten times"),
    ("misses", "bad", "so many contacts of the truth never happened, the first before all else went wrong"),
    ("refuses", "none", "cannot model the scene, and says so"),
)
"""What the words mean."""


def key() -> Markup:
    """Return what the badges mean."""
    return tag("dl", *(joined(tag("dt", badge(word, shade)), tag("dd", about)) for word, shade, about in KEY))
