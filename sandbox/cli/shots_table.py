"""Tables of `shots`: odds and sensitivity by ball, aim windows, predictability horizon."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import click

from sandbox.cli.tables import add_columns, new_table, print_legend, print_line, print_table
from sandbox.measure.proportion import Proportion
from sandbox.measure.shots.aim_windows import Windows
from sandbox.measure.shots.monte_carlo import Odds
from sandbox.measure.shots.predictability import Horizon, Separation
from sandbox.measure.shots.sensitivity import Slope
from sandbox.measure.shots.shot import UNITS, VARIABLES
from sandbox.measure.shots.study import ShotStudy

if TYPE_CHECKING:
    from rich.table import Table

MAX_POCKETS = 3
"""Pockets listed for each ball; `--json` has all."""

ODDS_HEADS = ("ball", "pocketed", "95 % interval", "into", "mean rest, m", "std, m", "without error")
LEGEND = {
    "pocketed": "fraction of the shots after which the ball is in a pocket",
    "95 % interval": "95 % confidence interval of that fraction (Wilson)",
    "into": f"pockets with the fraction of the shots, the {MAX_POCKETS} most frequent ones",
    "mean rest, m": "mean position at rest, over the shots after which the ball is on the table",
    "std, m": "standard deviation of that position",
    "without error": "position at rest, or pocket, of the shot that is played without error",
}
"""Columns of the table of odds and their meaning, for `--verbose`."""
SLOPE_LEGEND = {
    "d/d(…)": "derivative of the position at rest, (x, y); `not smooth`: a neighbouring shot has other collisions",
    "same contacts within": "change of the aim up to which every ball has the same collisions",
}
"""Columns of the table of sensitivities and their meaning, for `--verbose`."""

OF_POCKETS = slice(1, 4)
"""Columns about pockets, left out if the table has none."""

MAX_WINDOWS = 3
"""Intervals listed for each pot, the nearest ones; `--json` has all."""


def print_study(scene: str, found: ShotStudy, verbose: bool = False) -> None:
    """Print the shot, the odds of each ball, and the other results that were requested.

    Args:
        scene: the scene as the user named it.
        found: the study.
        verbose: explain every column below its table.
    """
    title = found.shot.table.scene.title
    print_line(f"{scene}: {title}" if title else scene)
    for line in _shot_lines(found):
        click.echo(line)
    rows = [list(ODDS_HEADS), *_odds_rows(found.odds)]
    if not found.shot.pockets:
        for row in rows:
            del row[OF_POCKETS]
    print_table(_table(rows[0], rows[1:]))
    if verbose:
        print_legend(rows[0], LEGEND)
    for line in _totals(found.odds):
        click.echo(line)
    if found.slopes is not None:
        heads = [f"d/d({variable}), m/{UNITS[variable]}" for variable in VARIABLES]
        print_table(_table(["ball", *heads, "same contacts within"], _slope_rows(found.slopes)))
        if verbose:
            print_legend(list(SLOPE_LEGEND), SLOPE_LEGEND)
    for each in found.windows:
        for line in _window(each):
            click.echo(line)
    if found.horizon is not None:
        for line in _horizon(found.horizon):
            click.echo(line)


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> "Table":
    """Return a table; the first column and columns of words are justified to the left."""
    from rich.text import Text

    table = new_table()
    for k, head in enumerate(heads):
        add_columns(table, [head], "left" if k == 0 or head in ("into", "without error") else "right")
    for row in rows:
        table.add_row(*map(Text, row))
    return table


def _shot_lines(found: ShotStudy) -> Iterator[str]:
    attempt, odds = found.shot, found.odds
    stroke = attempt.stroke
    offset = f", tip at ({stroke.side:+g}, {stroke.height:+g}) R" if stroke.side or stroke.height else ""
    yield f"{attempt.name}: {attempt.ball!r} struck at {stroke.speed:g} m/s at an aim of {stroke.aim:.6g} rad{offset}"
    errors = odds.spread
    sides = f", tip ± ({errors.side:g}, {errors.height:g}) R" if errors.side or errors.height else ""
    miscue_text = f"; {odds.miscues:,} miscues" if odds.miscues else ""
    unfinished_text = f"; {odds.unfinished:,} did not come to rest" if odds.unfinished else ""
    errors_text = f"aim ± {1e3 * errors.aim:g} mrad, speed ± {100.0 * errors.speed:g} %{sides}"
    yield f"{odds.count:,} shots, {errors_text} (standard deviations), seed {odds.seed}{miscue_text}{unfinished_text}"


def _odds_rows(odds: Odds) -> list[list[str]]:
    nominal = odds.nominal
    rows = []
    for index, ball in enumerate(nominal.names):
        fell, rest = odds.chance(ball), odds.rest(ball)
        by_pocket = {pocket: odds.chance(ball, pocket) for pocket in odds.shot.pockets}
        most_frequent = sorted((each for each in by_pocket.items() if each[1].hits), key=lambda each: -each[1].hits)
        without_error = nominal.pocketed.get(ball) or _position_text(nominal.position[index].tolist())
        rows.append(
            [
                ball,
                _percent(fell.probability),
                _bounds(fell),
                _pockets_text(most_frequent),
                "–" if rest is None else _position_text(rest.mean),
                "–" if rest is None else _position_text(rest.spread),
                without_error,
            ]
        )
    return rows


def _pockets_text(most_frequent: Sequence[tuple[str, Proportion]]) -> str:
    named = [f"{pocket} {_percent(chance.probability)}" for pocket, chance in most_frequent[:MAX_POCKETS]]
    return ", ".join([*named, *(["…"] if len(most_frequent) > MAX_POCKETS else [])]) or "–"


def _totals(odds: Odds) -> Iterator[str]:
    if not odds.shot.pockets:
        return
    pot, scratch = odds.any_pot, odds.scratch
    yield f"another ball is pocketed and {odds.shot.ball!r} is not: {_percent(pot.probability)}, {_bounds(pot)}"
    yield f"{odds.shot.ball!r} is pocketed: {_percent(scratch.probability)}, {_bounds(scratch)}"


def _slope_rows(slopes: Sequence[Slope]) -> list[list[str]]:
    rows: dict[str, list[str]] = {}
    for slope in slopes:
        rows.setdefault(slope.ball, [slope.ball]).append(_slope(slope))
    for slope in slopes:
        if slope.variable == "aim":
            rows[slope.ball].append("–" if slope.holds is None else f"± {slope.holds:.1g} rad")
    return list(rows.values())


def _slope(slope: Slope) -> str:
    if slope.value is None:
        return "pocketed" if (slope.reason or "").startswith("falls") else "not smooth"
    x, y = slope.value
    return f"({x:.3g}, {y:.3g})"


def _window(found: Windows) -> Iterator[str]:
    pot = f"{found.ball!r} into {found.pocket!r}"
    nearest = found.nearest
    if nearest is None:
        yield f"{pot}: for no aim within {found.reach:g} rad of {found.aim:.6g}"
        return
    nearest_windows = sorted(found.found, key=lambda each: each.off(found.aim))[:MAX_WINDOWS]
    for each in sorted(nearest_windows, key=lambda each: each.low):
        ends = f"[{each.low:.9f}, {each.high:.9f}] rad, ± {1e3 * each.half:.4g} mrad about {each.centre:.9f}"
        yield f"{pot}: for an aim in {ends}"
    if len(found.found) > len(nearest_windows):
        others = len(found.found) - len(nearest_windows)
        yield f"{pot}: {others} more intervals within {found.reach:g} rad, farther from the aim"
    distance = 1e3 * (found.aim - nearest.centre)
    side = "left" if distance > 0.0 else "right"
    inside = "within" if found.aim in nearest else "outside"
    yield f"{pot}: the aim of the shot is {inside} it, {abs(distance):.4g} mrad to the {side} of its centre"


def _horizon(found: Horizon) -> Iterator[str]:
    unit = "rad in aim" if found.by == "aim" else "m in position"
    tolerance = f"{1e3 * found.tolerance:g} mm"
    yield f"perturbed by {found.separation.nudge:g} {unit}: {_separation_text(found.separation, tolerance)}"
    yield f"perturbed by {found.separation.nudge:g} {unit}: {_separation_text(found.by_a_radius, 'a radius')}"
    if found.player is not None:
        yield f"perturbed by the player's error: {_separation_text(found.player, 'a radius')}"
    steps = [f"{each.nudge:.0e}: {each.time:.3g} s" for each in found.ladder if each.time is not None]
    never_separated = [each.nudge for each in found.ladder if each.time is None]
    steps += [f"{max(never_separated):.0e}: the whole shot"] if never_separated else []
    yield f"predictable to {tolerance}, by the accuracy of the aim in rad: {', '.join(steps)}"
    digits = found.digits_per_second
    if digits is not None:
        yield f"each further second needs {digits:.2g} more digits of the aim"


def _separation_text(each: Separation, distance: str) -> str:
    if each.time is None:
        return f"no ball ever differs by {distance}; the largest difference is {1e3 * each.farthest:.2g} mm"
    growth = ""
    if each.growth_per_hit is not None and each.growth_per_second is not None:
        decade = math.log(10.0) / each.growth_per_second
        times = f"a factor of 10 per {decade:.2g} s" if decade > 0.0 else "no growth"
        growth = f", after {each.hits} collisions in a row, × {each.growth_per_hit:.3g} each, {times}"
    return f"{each.ball!r} differs by {distance} from t = {each.time:.4g} s on{growth}"


def _percent(fraction: float) -> str:
    return f"{100.0 * fraction:.1f} %"


def _bounds(chance: Proportion) -> str:
    low, high = chance.interval
    return f"{100.0 * low:.1f}–{100.0 * high:.1f} %"


def _position_text(xy: Sequence[float]) -> str:
    return f"({xy[0]:.3f}, {xy[1]:.3f})"
