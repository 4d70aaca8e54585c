"""The table that `sandbox run` prints: a row a run, and columns for what differs between them."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

STEP = ("dt", "substeps")
"""Settings that share a column."""

Row = dict[str, Any]
"""A run as `--json` tells of it."""

WIDE = 240
"""Columns where the output is no terminal: rows are for reading by line then, and must not be folded."""

MAX_TIMED = 20
"""Runs of a table that shows first contacts and final positions although nothing else asks for them."""

SHORTEST_NAME = 8
"""Columns within which a scene's name is folded where there is little room."""


LEGEND = {
    "scene": "the scene as given",
    "engine": "the physics engine",
    "dt": "time step of a frame, s",
    "dt × substeps": "time step of a frame, s, and the number of solver steps in it",
    "seed": "seed of the random numbers of the scene",
    "status": "ok; diverged: a state is not finite; refused: the engine cannot model the scene; failed: it stopped",
    "× real time": "simulated time / computing time (without compilation); above 1 is faster than real time",
    "energy, J": "kinetic + potential energy at the start → at the end, J",
    "joint error": "largest error of any joint in any recorded frame, relative to its length",
    "broken": "joints that broke",
    "first contact, s": "time at which the first contact begins, s",
    "contacts": "contacts; one that lasts counts once",
    "missed": "contacts that the engine missed because a body passed through another within a step (tunnelling)",
    "final position, m": "position of the body at the end, m",
    "score": "final score of the game",
    "game": "how the game ended",
    "falls": "balls in pockets, and the pocket of each",
}
"""Columns of the table and their meaning, for `--verbose`."""


def print_legend(heads: Sequence[str], meanings: Mapping[str, str]) -> None:
    """Print the meaning of each column that has one, a line each."""
    import click

    known = [head for head in heads if head in meanings]
    width = max(map(len, known), default=0)
    for head in known:
        click.echo(f"  {head:<{width}}  {meanings[head]}")


def print_runs(rows: Sequence[Row], verbose: bool = False) -> None:
    """Print a line for each run.

    Args:
        rows: the runs.
        verbose: explain every column below the table.
    """
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    swept = [key for key in rows[0]["set"] if key != "world.seed" and not key.startswith("solver.")]
    swept = [key for key in swept if len({str(row["set"][key]) for row in rows}) > 1]
    differing = [key for key in rows[0]["settings"] if key not in STEP and _differs(rows, key)]
    substeps = any(row["settings"]["substeps"] > 1 for row in rows)
    seeds = len({row["seed"] for row in rows}) > 1
    scenes = len({row["scene"] for row in rows}) > 1

    # One scene stands above its runs, where a long path takes no room from the figures.
    table = Table(box=None, pad_edge=False, header_style="bold")
    if scenes:
        table.add_column("scene", overflow="fold", min_width=SHORTEST_NAME)
    table.add_column("engine", no_wrap=True)
    for head in ("dt × substeps" if substeps else "dt", *swept, *differing, *(["seed"] if seeds else [])):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("status", no_wrap=True)
    joined = any(row["joint_error"] is not None for row in rows)
    torn = any(row["broken_joints"] for row in rows)
    joints = *(("joint error",) if joined else ()), *(("broken",) if torn else ())
    games = any("score" in row for row in rows)  # whose results are their scores
    few = 1 < len(rows) <= MAX_TIMED and not games and not scenes  # those of several scenes are not compared
    timed = _first_contacts_differ(rows) or (few and all(_is_timed(row) for row in rows))
    placed = few and len({_final_position(row) for row in rows} - {""}) > 1
    ends = *(("first contact, s",) if timed else ()), *(("final position, m",) if placed else ())
    for head in ("× real time", "energy, J", *joints, *ends, "contacts", "missed"):
        table.add_column(head, justify="right", no_wrap=True)
    if games:
        table.add_column("score", justify="right", no_wrap=True)
        table.add_column("game", no_wrap=True)
    fallen = any(row["pocketed"] for row in rows)
    if fallen:
        table.add_column("falls", no_wrap=True)

    for row in rows:
        status = Text(row["status"], style="green" if row["status"] == "ok" else "bold red")
        if row["repeated"]:
            status.append(" stored", style="dim")
        table.add_row(
            *([Text(row["scene"])] if scenes else []),
            row["engine"],
            f"{row['settings']['dt']:.4g}" + (f" × {row['settings']['substeps']}" if substeps else ""),
            *(_setting(row["set"][key]) for key in swept),
            *(_setting(row["settings"][key]) for key in differing),
            *([str(row["seed"])] if seeds else []),
            status,
            _figure(row["realtime_factor"], 3),
            "–" if row["energy_start"] is None else f"{_figure(row['energy_start'])} → {_figure(row['energy_end'])}",
            *([_share(row["joint_error"])] if joined else []),
            *([f"{row['broken_joints']:,}"] if torn else []),
            *([_figure(row["first_contact"], 6)] if timed else []),
            *([_final_position(row) or "–"] if placed else []),
            *(("–", "–") if row["status"] == "refused" else (f"{row['contacts']:,}", _missed(row["missed_contacts"]))),
            *((_figure(row.get("score")), Text(_over(row))) if games else ()),
            *([Text(", ".join(f"{ball}: {pocket}" for ball, pocket in row["pocketed"].items()))] if fallen else []),
        )
    console = Console(width=None if sys.stdout.isatty() else WIDE)
    # Too narrow a terminal wraps lines by itself, which loses nothing; a table made to fit it would. Only names fold.
    spare = max(Text(row["scene"]).cell_len for row in rows) - SHORTEST_NAME if scenes else 0
    console.width = max(console.width, Console(width=10_000).measure(table).maximum - max(spare, 0))
    if not scenes:
        console.print(Text(rows[0]["scene"]), soft_wrap=True)
    console.print(table)
    if len(rows) == 1 and _is_timed(rows[0]) and not games:
        place = _final_position(rows[0])
        final = f"; final position {place} m" if place else ""
        console.print(Text(f"first contact at {_figure(rows[0]['first_contact'], 6)} s{final}"), soft_wrap=True)
    if verbose:
        settings = {key: f"setting `solver.{key}`" for key in differing} | {key: f"value of {key!r}" for key in swept}
        print_legend([str(column.header) for column in table.columns], LEGEND | settings)
    elif sys.stdout.isatty():  # for people; a program that reads the table has every row as a line of its own
        console.print(Text("; ".join(_legend(joined, timed)), style="dim"))


def _legend(joined: bool, timed: bool) -> Iterator[str]:
    """Yield what the columns mean."""
    yield "× real time: simulated time / computing time"
    yield "energy: start → end"
    if joined:
        yield "joint error: largest, relative to the length of the joint"
    if timed:
        yield "first contact: start of the first collision"
    yield "missed: contacts that the engine missed"
    yield "-v explains every column"


def _is_timed(row: Row) -> bool:
    """Tell whether a run has a first contact."""
    return row["first_contact"] is not None


def _final_position(row: Row) -> str:
    """Return where the body of a run is at the end, m; "" where it has none, or several."""
    final = row.get("final") or {}
    if len(final) != 1:
        return ""
    (body,) = final.values()
    return f"({', '.join('–' if x is None else f'{x:.4g}' for x in body['position'])})"


def _first_contacts_differ(rows: Sequence[Row]) -> bool:
    """Tell whether runs of one scene and seed, which differ in engine or setting, first meet something at other times.

    Where energies and counts are equal, this shows what the setting changes.
    """
    times: dict[tuple[str, int], set[float | None]] = {}
    for row in rows:
        if row["status"] != "refused":
            times.setdefault((row["scene"], row["seed"]), set()).add(row["first_contact"])
    return any(len(each) > 1 for each in times.values())


def _over(row: Row) -> str:
    """Return how a game ended; none was played where the engine refused, or the scene has none."""
    return "–" if row.get("score") is None else row.get("over") or "goes on"


def _differs(rows: Sequence[Row], key: str) -> bool:
    """Tell whether a setting differs between runs of one scene; between scenes an engine's own choices do anyway."""
    values: dict[str, set[str]] = {}
    for row in rows:
        values.setdefault(row["scene"], set()).add(str(row["settings"][key]))
    return any(len(each) > 1 for each in values.values())


def _missed(count: int | None) -> str:
    return "?" if count is None else f"{count:,}"


def _share(value: float | None) -> str:
    return "–" if value is None else f"{100.0 * value:.2g} %"


def _setting(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _figure(value: float | None, digits: int = 4) -> str:
    if value is None:
        return "–"
    return f"{value:,.0f}" if 10 ** (digits - 1) <= abs(value) < 1e6 else f"{value:.{digits}g}"
