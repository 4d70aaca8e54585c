"""Options of commands that measure from perturbed starts, or recommend settings that hold there, and a line on both."""

from collections.abc import Callable
from typing import Any, TypeVar

import click

from sandbox.cli.options import FractionRange
from sandbox.formatting import format_plural
from sandbox.measure.starts import DEFAULT_SPREAD, DEFAULT_STARTS, MAX_SPREAD, MAX_STARTS, Starts
from sandbox.measure.tradeoff.result import Tradeoff

Decorated = TypeVar("Decorated", bound=Callable[..., Any])


def starts_option(use: str, default: int = DEFAULT_STARTS) -> Callable[[Decorated], Decorated]:
    """Return the option `--starts`; `use` says in its help what is done from N perturbed starts."""
    text = f"{use}; fewer where they take too much work; 1: only the start of the scene; default: {default}"
    return click.option("--starts", type=click.IntRange(1, MAX_STARTS), default=default, metavar="N", help=text)


recommendation_starts_option = starts_option(
    "recommend a setting that is within the tolerance in 95 % of N perturbed starts, and confirm it with N more"
)

spread_option = click.option(
    "--spread",
    type=FractionRange(min=0.0, max=MAX_SPREAD),
    default=DEFAULT_SPREAD,
    metavar="X%",
    help="largest change of a start: of positions as a part of the smallest half width, and of velocities; "
    f"default: {100 * DEFAULT_SPREAD:g}%",
)
margin_option = click.option(
    "--margin",
    type=FractionRange(min=0.0, max=1.0, max_open=True),
    default=0.0,
    metavar="X%",
    help="part of the tolerance that a recommended setting leaves unused: with 20% its error is at most 0.8 times the "
    "tolerance; default: 0%",
)


def starts_text(found: Tradeoff) -> str:
    """Return from which starts settings are measured, and how fresh starts differ from that of the scene."""
    others = len(found.searched_starts) - 1
    searched = "starts: that of the scene"
    if others:
        searched += f" and {format_plural(others, 'other')} where settings failed; errors are the worst of these"
    if found.starts < 2:
        return searched
    return f"{searched}; fresh starts have {Starts(found.scene, found.spread)}"
