"""Options of commands that measure from perturbed starts, and the line that states them."""

import click

from sandbox.cli.options import Fraction
from sandbox.measure.starts import DEFAULT_SPREAD, DEFAULT_STARTS, MAX_SPREAD, MAX_STARTS, Starts
from sandbox.scene.compile.scene import Scene

starts_option = click.option(
    "--starts",
    type=click.IntRange(1, MAX_STARTS),
    default=DEFAULT_STARTS,
    metavar="N",
    help="recommend a setting that is within the tolerance in 95 % of N perturbed starts, and confirm it with N more; "
    f"fewer where the effort allows no more; 1: only the start of the scene; default: {DEFAULT_STARTS}",
)
spread_option = click.option(
    "--spread",
    type=Fraction(min=0.0, max=MAX_SPREAD),
    default=DEFAULT_SPREAD,
    metavar="X%",
    help="largest change of a start: of positions as a part of the smallest half width, and of velocities; "
    f"default: {100 * DEFAULT_SPREAD:g}%",
)


def starts_text(scene: Scene, starts: int, spread: float) -> str:
    """Return from which starts settings are measured, and from which the recommended ones are confirmed.

    Args:
        scene: the scene.
        starts: number of starts; 1: only that of the scene.
        spread: largest change of a start, as a fraction.
    """
    if starts < 2:
        return "starts: that of the scene only"
    return f"starts: that of the scene; recommended settings also from others: {Starts(scene, spread)}"
