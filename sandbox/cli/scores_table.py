"""The distribution of scores that `sandbox run --seeds N` prints of a game: figures, and a histogram of bars."""

import json
from collections.abc import Sequence
from typing import Any

import click

from sandbox.cli.table import Row
from sandbox.games.scores import QUANTILES, Scores

BAR = 40
"""characters, the longest bar"""
EIGHTHS = " ▏▎▍▌▋▊▉█"
"""Blocks of Unicode that are so many eighths of a character wide."""


def score_rows(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return how the scores of games that differ only in their seed are spread, in the order of the rows.

    A game that diverged or failed has no score that counts; there is no entry where fewer than two are left.
    """
    found: dict[str, tuple[dict[str, Any], list[float]]] = {}
    for row in rows:
        if row.get("score") is None or row["status"] != "ok":
            continue
        point = {key: value for key, value in row["set"].items() if key != "world.seed"}
        group = {"scene": row["scene"], "engine": row["engine"], "player": row["player"], "set": point}
        found.setdefault(json.dumps(group, default=str), (group, []))[1].append(float(row["score"]))
    return [group | Scores.of(scores).document() for group, scores in found.values() if len(scores) > 1]


def print_scores(rows: Sequence[dict[str, Any]]) -> None:
    """Print what `score_rows` returned."""
    for row in rows:
        swept = "".join(f", {key} = {value}" for key, value in row["set"].items())
        click.echo(f"\nscores of {row['scene']}, {row['engine']}{swept}: {row['count']} games, player {row['player']}")
        click.echo(f"  mean {_score(row['mean'])} ± {_score(row['deviation'])} per game")
        names = {0.0: "least", 0.5: "median", 1.0: "most"}
        told = (f"{names.get(share, f'{share:.0%}')} {_score(row['quantiles'][f'{share:g}'])}" for share in QUANTILES)
        click.echo(f"  {' · '.join(told)}")
        _print_histogram(row["histogram"]["edges"], row["histogram"]["counts"])


def _score(value: float) -> str:
    """Write a score out, as games do: large ones whole, with thousands set apart."""
    return f"{value:,.0f}" if abs(value) >= 1000.0 else f"{value:.4g}"


def _print_histogram(edges: Sequence[float], counts: Sequence[int]) -> None:
    bounds = [_score(edge) for edge in edges]
    wide, most = max(map(len, bounds)), max(counts)
    for low, high, count in zip(bounds, bounds[1:], counts, strict=False):
        click.echo(f"  {low:>{wide}} … {high:<{wide}} {_bar(count / most)} {count}")


def _bar(share: float) -> str:
    """Return a bar, to an eighth of a character; what is more than nothing is seen."""
    eighths = max(round(share * BAR * 8), 1 if share > 0.0 else 0)
    bar = EIGHTHS[8] * (eighths // 8) + (EIGHTHS[eighths % 8] if eighths % 8 else "")
    return f"{bar:<{BAR}}"
