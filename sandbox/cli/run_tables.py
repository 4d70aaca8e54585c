"""Tables of `run` and `match`: runs, energy ledgers, score histograms."""

import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import click
import numpy as np

from sandbox.arrays import FloatArray
from sandbox.batch.run_row import FinalBodyState, RunRow
from sandbox.cli.tables import add_columns, heads_of, new_table, print_legend, print_line, print_table
from sandbox.engines.energy_ledger import Cause
from sandbox.formatting import format_number, format_quantity
from sandbox.jsonable import finite, in_json
from sandbox.measure.metrics.energy import LedgerDocument

if TYPE_CHECKING:
    from rich.text import Text

STEP = ("dt", "substeps")
"""Settings that share a column."""

MAX_TIMED = 20
"""Runs in a table that shows first contacts and final positions; in a longer table these columns are omitted."""

MAX_BODIES = 5
"""Bodies of a single run whose final states are printed"""
ROUNDING = 1e-12
"""Values below this fraction of the largest, or of 1 m, m/s or rad, are rounding errors and printed as 0: sums of 1e4
terms of double precision are exact to about that."""
MAX_ROUNDING = 1e-6
"""J, m, m/s or rad: a larger value is printed also beside one that has diverged"""

LEGEND = {
    "scene": "the scene as given",
    "engine": "the physics engine",
    "dt": "time step of a frame, s",
    "dt × substeps": "time step of a frame, s, and the number of solver steps in it",
    "seed": "seed of the random numbers of the scene",
    "status": "ok; diverged: a state is not finite; refused: the engine cannot model the scene; failed: it stopped; "
    "*: a warning about the run is printed below the table",
    "× real time": "simulated time / computing time (without compilation); above 1 is faster than real time",
    "energy, J": "kinetic + potential energy at the start → at the end, J",
    "joint error": "largest error of any joint in any recorded frame, relative to its length, and in m or rad",
    "broken": "joints that broke",
    "first contact, s": "time at which the first contact begins, s",
    "contacts": "contacts; one that lasts counts once",
    "missed": "contacts that the engine missed because a body passed through another within a step (tunnelling)",
    "final position, m": "position of the body at the end, m",
    "final velocity, m/s": "velocity of the body at the end, m/s",
    "score": "final score of the game",
    "game": "how the game ended",
    "falls": "balls in pockets, and the pocket of each",
}
"""Columns of the table and their meaning, for `--verbose`."""

QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
"""probabilities of the quantiles"""
MAX_BINS = 10
"""number of bins over the range of the scores; rounding the outer edges to multiples of the width adds up to two"""


@dataclass(frozen=True)
class Histogram:
    """Histogram of scores."""

    edges: Sequence[float]
    """bounds of the bins, one more than bins; a bin includes its lower edge"""
    counts: Sequence[int]
    """number of games in each bin"""


@dataclass(frozen=True)
class ScoreStatistics:
    """Statistics of a sample of scores."""

    count: int
    mean: float
    deviation: float
    """sample standard deviation; 0 for a single game"""
    quantiles: Mapping[str, float]
    """by probability, one of `QUANTILES`"""
    histogram: Histogram

    @classmethod
    def of(cls, scores: Sequence[float]) -> "ScoreStatistics":
        """Return the statistics of scores.

        Raises:
            ValueError: there are no scores.
        """
        if not scores:
            raise ValueError("no games, so no score statistics")
        values = np.asarray(scores, dtype=np.float64)
        counts, edges = np.histogram(values, _edges(values))
        quantiles = zip(QUANTILES, np.quantile(values, QUANTILES).tolist(), strict=True)
        return cls(
            count=len(values),
            mean=float(values.mean()),
            deviation=float(values.std(ddof=1)) if len(values) > 1 else 0.0,
            quantiles={f"{fraction:g}": value for fraction, value in quantiles},
            histogram=Histogram(edges.tolist(), counts.tolist()),
        )


@dataclass(frozen=True, kw_only=True)
class ScoresDocument:
    """Distribution of the scores of games that differ only in their seed."""

    scene: str
    engine: str
    player: str | None
    set: Mapping[str, object]
    """values that the command set, without the seed"""
    distribution: ScoreStatistics = field(metadata=in_json(inline=True))


@dataclass(frozen=True, kw_only=True)
class RunsDocument:
    """JSON document of `run`."""

    runs: Sequence[RunRow]
    """completed runs, in the order of the table"""
    scores: Sequence[ScoresDocument] | None = field(metadata=in_json(optional=True))
    """distributions of scores over the seeds; None if there are none"""
    remarks: Mapping[str, Sequence[str]] | None = field(metadata=in_json(optional=True))
    """by the name of a recording: what it lacks of its game, and how far its replay departs; None if there are none"""
    interrupted: bool
    """whether an interrupt ended the runs early"""


def print_runs(rows: Sequence[RunRow], verbose: bool = False) -> None:
    """Print a table with a line for each run.

    Args:
        rows: the runs.
        verbose: print all columns, and explain each below the table.
    """
    show = _Columns.of(rows, verbose)
    table = new_table()
    add_columns(table, (*(["scene"] if show.scenes else []), "engine"))
    numbers = ("dt × substeps" if show.substeps else "dt", *show.swept, *show.differing)
    add_columns(table, (*numbers, *(["seed"] if show.seeds else [])), "right")
    add_columns(table, ["status"])
    joints = *(("joint error",) if show.joint_errors else ()), *(("broken",) if show.broken_joints else ())
    ends = [*(["first contact, s"] if show.first_contacts else []), *(["final position, m"] if show.positions else [])]
    ends += ["final velocity, m/s"] if show.velocities else []
    add_columns(table, ("× real time", "energy, J", *joints, *ends, "contacts", "missed"), "right")
    if show.games:
        add_columns(table, ["score"], "right")
        add_columns(table, ["game"])
    if show.pocketed:
        add_columns(table, ["falls"])
    add_columns(table, show.observed, "right")
    for row in rows:
        table.add_row(*_cells(row, show))

    if not show.scenes:
        print_line(rows[0].scene)  # in the table, a long path would take the space of the numbers
    print_table(table, keys=show.scenes + 1 + len(numbers) + show.seeds)
    if len(rows) == 1 and not show.games:
        if rows[0].first_contact is not None:
            print_line(f"first contact at {_number(rows[0].first_contact, 6)} s")
        _print_final(rows[0])
    if verbose:
        meanings = {key: f"setting `solver.{key}`" for key in show.differing}
        meanings |= {key: f"value of {key!r}" for key in show.swept}
        meanings |= {key: f"value of {key!r} by the function of --observe" for key in show.observed}
        print_legend(heads_of(table), LEGEND | meanings)
    elif sys.stdout.isatty():  # without a terminal, every line of the output is a row of the table
        print_line("; ".join(_legend(show)), "dim")


class _Columns(NamedTuple):
    """Optional columns of a table of runs."""

    scenes: bool
    swept: list[str]
    """keys of the scene with different values"""
    differing: list[str]
    """settings of the solver that differ between runs of one scene on one engine"""
    substeps: bool
    seeds: bool
    joint_errors: bool
    broken_joints: bool
    first_contacts: bool
    positions: bool
    velocities: bool
    games: bool
    pocketed: bool
    observed: list[str]
    """names of the values of `--observe`"""

    @classmethod
    def of(cls, rows: Sequence[RunRow], verbose: bool) -> "_Columns":
        """Return the columns that are not empty or constant; final velocities are for `verbose` tables."""
        swept = [key for key in rows[0].set if key != "world.seed" and not key.startswith("solver.")]
        scenes = len({row.scene for row in rows}) > 1
        games = any(row.game is not None for row in rows)
        # Scores are the results of games, and runs of several scenes are not compared with each other.
        is_small = 1 < len(rows) <= MAX_TIMED and not games and not scenes
        is_timed = is_small and all(row.first_contact is not None for row in rows)
        ends = [body for row in rows if (body := _only_body(row)) is not None]
        return cls(
            scenes=scenes,
            swept=[key for key in swept if len({str(row.set[key]) for row in rows}) > 1],
            differing=[key for key in rows[0].settings if key not in STEP and _differs(rows, key)],
            substeps=any(row.settings["substeps"] > 1 for row in rows),
            seeds=len({row.seed for row in rows}) > 1,
            joint_errors=any(row.joint_error is not None for row in rows),
            broken_joints=any(row.broken_joints for row in rows),
            first_contacts=is_timed or _first_contacts_differ(rows),
            positions=is_small and len({_vector(body.position) for body in ends}) > 1,
            velocities=verbose and is_small and len({_vector(body.velocity) for body in ends}) > 1,
            games=games,
            pocketed=any(row.pocketed for row in rows),
            observed=list(dict.fromkeys(name for row in rows for name in row.observed or ())),
        )


def _cells(row: RunRow, show: _Columns) -> "Iterator[str | Text]":
    """Yield the cells of a run."""
    from rich.text import Text

    settings = row.settings
    if show.scenes:
        yield Text(row.scene)
    yield row.engine
    yield f"{settings['dt']:.4g}" + (f" × {settings['substeps']}" if show.substeps else "")
    yield from (_setting(row.set[key]) for key in show.swept)
    yield from (_setting(settings[key]) for key in show.differing)
    if show.seeds:
        yield str(row.seed)
    style = "bold red" if row.status != "ok" else "yellow" if row.warnings else "green"
    status = Text(row.status + (" *" if row.warnings else ""), style=style)
    yield status.append(" stored", style="dim") if row.repeated else status
    yield _number(row.realtime_factor, 3)
    start, end = row.energy_start, row.energy_end
    yield "–" if start is None else " → ".join(map(_number, _without_rounding((start, end))))
    if show.joint_errors:
        yield _joint_error(row)
    if show.broken_joints:
        yield f"{row.broken_joints:,}"
    if show.first_contacts:
        yield _number(row.first_contact, 6)
    if show.positions:
        yield "–" if (body := _only_body(row)) is None else _vector(body.position)
    if show.velocities:
        yield "–" if (body := _only_body(row)) is None else _vector(body.velocity)
    is_refused, missed = row.status == "refused", row.missed_contacts
    yield "–" if is_refused or row.contacts is None else f"{row.contacts:,}"
    yield "–" if is_refused else "?" if missed is None else f"{missed:,}"
    if show.games:
        yield _number(row.score)
        yield Text(_game_end(row))
    if show.pocketed:
        yield Text(", ".join(f"{ball}: {pocket}" for ball, pocket in row.pocketed.items()))
    yield from (_observed((row.observed or {}).get(name)) for name in show.observed)


def _observed(value: float | int | str | None) -> "Text":
    from rich.text import Text

    return Text("–" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value))


def _legend(show: _Columns) -> Iterator[str]:
    """Yield the meaning of the columns that need one."""
    yield "× real time: simulated time / computing time"
    yield "energy: start → end"
    if show.joint_errors:
        yield "joint error: largest, relative to the length of the joint"
    if show.first_contacts:
        yield "first contact: start of the first collision"
    yield "missed: contacts that the engine missed"
    yield "-v explains every column"


def _only_body(row: RunRow) -> FinalBodyState | None:
    """Return the state of the only body at the end; None if the run has no body or several."""
    bodies = list((row.final or {}).values())
    return bodies[0] if len(bodies) == 1 else None


def _print_final(row: RunRow) -> None:
    """Print where and how fast the bodies of a run end, if there are few."""
    from rich.text import Text

    bodies = row.final or {}
    if not 1 <= len(bodies) <= MAX_BODIES:
        return
    has_turned = any(abs(each.angle) + abs(each.angular_velocity) > ROUNDING for each in bodies.values())
    table = new_table()
    add_columns(table, ["at the end"])
    add_columns(table, ("position, m", "velocity, m/s", *(("angle, rad", "rad/s") if has_turned else ())), "right")
    for name, body in bodies.items():
        turned = _without_rounding((body.angle, body.angular_velocity), 1.0) if has_turned else ()
        table.add_row(Text(name), _vector(body.position), _vector(body.velocity), *map(_number, turned))
    print_table(table)


def _vector(components: Sequence[float]) -> str:
    """Return a position in m or a velocity in m/s as text."""
    return f"({', '.join(_number(x) for x in _without_rounding(components, 1.0))})"


def _without_rounding(values: Sequence[float | None], scale: float = 0.0) -> list[float | None]:
    """Return values with 0 for those that are rounding errors beside the largest, or beside a scale."""
    largest = max((abs(each) for each in values if each is not None and math.isfinite(each)), default=0.0)
    bound = min(ROUNDING * max(scale, largest), MAX_ROUNDING)
    return [0.0 if each is not None and abs(each) <= bound else each for each in values]


def _first_contacts_differ(rows: Sequence[RunRow]) -> bool:
    """Return whether the first contact of one scene and seed differs between engines or settings.

    If energies and counts are equal, only the first contact shows the effect of a setting.
    """
    times: dict[tuple[str, int], set[float | None]] = {}
    for row in rows:
        if row.status != "refused":
            times.setdefault((row.scene, row.seed), set()).add(row.first_contact)
    return any(len(each) > 1 for each in times.values())


def _game_end(row: RunRow) -> str:
    """Return how a game ended; a dash if none was played."""
    return "–" if row.game is None or row.game.score is None else row.game.over or "in progress"


def _differs(rows: Sequence[RunRow], setting: str) -> bool:
    """Return whether a setting differs between runs of one scene on one engine; defaults differ between them anyway."""
    values: dict[tuple[str, str], set[str]] = {}
    is_set = any(f"solver.{setting}" in row.set for row in rows)
    for row in rows:
        if row.status == "refused" and not is_set:  # an engine that refuses resolves no settings
            continue
        values.setdefault((row.scene, row.engine), set()).add(str(row.settings[setting]))
    return any(len(found) > 1 for found in values.values())


def _joint_error(row: RunRow) -> str:
    """Return the largest error of a joint, relative and as a length or an angle, such as `0.12 %, 0.42 mm`."""
    if row.joint_error is None:
        return "–"
    worst, relative = row.worst_joint, f"{100.0 * row.joint_error:.2g} %"
    if row.joint_error > 1.0:
        relative = f"{format_number(row.joint_error, 2)} lengths"
    if worst is None or worst["error"] is None:
        return relative
    size = format_quantity(float(f"{worst['error']:.2g}"), worst["unit"])
    return size if worst["unit"] == "rad" else f"{relative}, {size}"


def _setting(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _number(value: float | None, digits: int = 4) -> str:
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:,.0f}" if 10 ** (digits - 1) <= abs(value) < 1e6 else f"{value:.{digits}g}"


MAX_LEDGERS = 5
"""Runs in one table of ledgers, which then fits a terminal; further runs are in another table."""


def print_ledgers(rows: Sequence[RunRow]) -> None:
    """Print the energy ledgers of runs, those of one scene side by side."""
    from rich.text import Text

    for group in _groups([row for row in rows if _ledger(row) is not None]):
        table = new_table()
        table.add_column(Text(f"energy of {group[0].scene}, J"), overflow="fold")
        for row in group:
            table.add_column(Text(_label(row, group)), justify="right", no_wrap=True)
            table.add_column("", justify="right", style="dim", no_wrap=True)
        ledgers = [ledger for row in group if (ledger := _ledger(row)) is not None]
        table.add_row("start", *_ledger_cells(ledgers, [each.start for each in ledgers], fractions=False))
        for cause in ledgers[0].causes:
            values = [each.causes.get(cause, math.nan) for each in ledgers]
            if cause == Cause.PHANTOM or any(map(_is_significant, ledgers, values)):
                table.add_row(f"  {cause}", *_ledger_cells(ledgers, values))
        table.add_row("sum", *_ledger_cells(ledgers, [sum(each.causes.values()) for each in ledgers]))
        table.add_row("end", *_ledger_cells(ledgers, [each.end for each in ledgers], fractions=False))
        table.add_row("residual", *_ledger_cells(ledgers, [each.residual for each in ledgers], threshold=0.0))
        click.echo()
        print_table(table)
    if any(_ledger(row) is not None for row in rows):
        print_line("%: of the largest kinetic energy or the largest entry, whichever is greater", "dim")


def _ledger(row: RunRow) -> LedgerDocument | None:
    return None if row.account is None else row.account.ledger


def _groups(rows: Sequence[RunRow]) -> Iterator[list[RunRow]]:
    """Yield the runs of each scene, at most `MAX_LEDGERS` at a time."""
    for scene in dict.fromkeys(row.scene for row in rows):
        scene_rows = [row for row in rows if row.scene == scene]
        for first in range(0, len(scene_rows), MAX_LEDGERS):
            yield scene_rows[first : first + MAX_LEDGERS]


def _label(row: RunRow, group: Sequence[RunRow]) -> str:
    """Return the engine of a run, and the values in which it differs from the others of its group."""
    differing = [key for key in row.set if len({str(other.set.get(key)) for other in group}) > 1]
    values = (f"{key.rpartition('.')[2]}={row.set[key]}" for key in differing)
    return " ".join((row.engine, *values))


def _ledger_cells(
    ledgers: Sequence[LedgerDocument],
    values: Sequence[float],
    fractions: bool = True,
    threshold: float = ROUNDING,
) -> Iterator[str]:
    """Yield, for each run, a value and its fraction of the largest energy; a value that is not finite is unknown."""
    for ledger, value in zip(ledgers, values, strict=True):
        if not math.isfinite(value) or (fractions and not _is_significant(ledger, value, threshold)):
            yield from ("0" if math.isfinite(value) else "?", "")
        else:
            yield f"{value:.5g}"
            yield _percent(value / ledger.scale) if fractions and _scale(ledger) else ""


def _scale(ledger: LedgerDocument) -> float:
    """Return the largest energy of a ledger, J; 0 if it is unknown."""
    return finite(ledger.scale) or 0.0


def _percent(fraction: float) -> str:
    return f"{100.0 * fraction:.1f} %" if abs(fraction) >= 0.001 else f"{100.0 * fraction:.1g} %"


def _is_significant(ledger: LedgerDocument, value: float, threshold: float = ROUNDING) -> bool:
    """Return whether an entry is unknown, or larger than rounding errors."""
    return not abs(value) <= threshold * _scale(ledger)


BAR = 40
"""characters, the longest bar"""
EIGHTHS = " ▏▎▍▌▋▊▉█"
"""Block characters by their width in eighths of a character."""


def _edges(scores: FloatArray) -> list[float]:
    """Return the edges of bins that contain all scores; their width is 1, 2 or 5 times a power of ten.

    If all scores are integers, the width is at least 1.
    """
    low, high = float(scores.min()), float(scores.max())
    width = 10.0 ** math.floor(math.log10(max(high - low, 1.0) / MAX_BINS))
    width *= next(factor for factor in (1.0, 2.0, 5.0, 10.0) if high - low <= width * factor * MAX_BINS)
    if (scores == np.round(scores)).all():
        width = max(width, 1.0)
    first, last = math.floor(low / width), math.floor(high / width) + 1
    if low < width * first:  # a negative score so small that the quotient is -0
        first -= 1
    parts = round(1.0 / width)  # bins per unit: 3 / 10 is exactly 0.3, 3 × 0.1 is not
    return [k / parts if width < 1.0 else width * k for k in range(first, last + 1)]


def score_rows(rows: Sequence[RunRow]) -> list[ScoresDocument]:
    """Return the distribution of scores over games that differ only in their seed, in the order of the rows.

    Games that diverged or failed are left out; groups of fewer than two games have no entry.
    """
    found: dict[str, tuple[RunRow, Mapping[str, object], list[float]]] = {}
    for row in rows:
        if row.game is None or row.game.score is None or row.status != "ok":
            continue
        point = {key: value for key, value in row.set.items() if key != "world.seed"}
        key = json.dumps([row.scene, row.engine, row.game.player, point], default=str)
        found.setdefault(key, (row, point, []))[2].append(float(row.game.score))
    return [
        ScoresDocument(
            scene=row.scene,
            engine=row.engine,
            player=None if row.game is None else row.game.player,
            set=point,
            distribution=ScoreStatistics.of(scores),
        )
        for row, point, scores in found.values()
        if len(scores) > 1
    ]


def print_scores(rows: Sequence[ScoresDocument]) -> None:
    """Print the distributions of `score_rows`."""
    for row in rows:
        scores = row.distribution
        swept = "".join(f", {key} = {value}" for key, value in row.set.items())
        click.echo(f"\nscores of {row.scene}, {row.engine}{swept}: {scores.count} games, player {row.player}")
        click.echo(f"  mean {_score(scores.mean)} ± {_score(scores.deviation)} per game")
        names = {0.0: "min", 0.5: "median", 1.0: "max"}
        values = ((names.get(q, f"{q:.0%}"), scores.quantiles[f"{q:g}"]) for q in QUANTILES)
        click.echo(f"  {' · '.join(f'{name} {_score(value)}' for name, value in values)}")
        _print_histogram(scores.histogram.edges, scores.histogram.counts)


def _score(value: float) -> str:
    """Return a score as text; large ones are whole numbers with thousands separators."""
    return f"{value:,.0f}" if abs(value) >= 1000.0 else f"{value:.4g}"


def _print_histogram(edges: Sequence[float], counts: Sequence[int]) -> None:
    bounds = [_score(edge) for edge in edges]
    width, largest = max(map(len, bounds)), max(counts)
    for low, high, count in zip(bounds, bounds[1:], counts, strict=False):
        click.echo(f"  {low:>{width}} … {high:<{width}} {_bar(count / largest)} {count}")


def _bar(fraction: float) -> str:
    """Return a bar with a resolution of an eighth of a character; a positive fraction has at least one eighth."""
    eighths = max(round(fraction * BAR * 8), 1 if fraction > 0.0 else 0)
    bar = EIGHTHS[8] * (eighths // 8) + (EIGHTHS[eighths % 8] if eighths % 8 else "")
    return f"{bar:<{BAR}}"
