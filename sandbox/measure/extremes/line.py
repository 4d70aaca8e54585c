"""Line: an axis, or a pair of them, on one setup: its cells, and its boundary."""

from collections.abc import Callable, Sequence

from sandbox.measure.extremes.axis import Axis, Pair
from sandbox.measure.extremes.boundary import Limit, boundary
from sandbox.measure.extremes.case import Case
from sandbox.measure.extremes.cell import Cell, Outcome, Task
from sandbox.measure.extremes.setup import Setup

Ask = Callable[[Task], Outcome]
Keep = Callable[[Cell], None]


def axis_line(
    axis: Axis,
    setup: Setup,
    levels: Sequence[float],
    overrides: tuple[str, ...],
    ask: Ask,
    keep: Keep,
    *,
    halve: bool = True,
) -> Limit:
    """Run an axis on a setup, level by level, and find its boundary.

    A level that is refused is none: boundaries are between what passed and what failed.

    Args:
        axis: which.
        setup: on what.
        levels: from the easiest to the hardest.
        overrides: `KEY=VALUE`, of every scene.
        ask: runs a task.
        keep: is given each cell as it is finished.
        halve: whether the boundary is looked for between the levels.
    """
    cells: dict[float, Cell] = {}

    def look(level: float) -> Cell:
        outcome = ask(_task(axis.case, {axis.parameter: level}, setup, overrides))
        cells[level] = Cell(axis.name, level, setup.engine, setup.name, dict(setup.changes), outcome)
        keep(cells[level])
        return cells[level]

    for level in levels:
        look(level)
    known = {level: cell.passed for level, cell in cells.items() if cell.verdict != "refused"}
    whose = axis.name, setup.engine, setup.name, dict(setup.changes)
    if not known:
        return Limit(*whose, None, None, cells[levels[0]].outcome.reason, unit=axis.unit, refused=True)
    # Where time was up, another machine gets farther: that is worth no halving.
    hung = next((cell.outcome.slow for cell in cells.values() if cell.verdict == "failed"), False)
    found = boundary(known, None if hung or not halve else lambda level: look(level).passed, axis.scale)
    reason, rule = "no level failed", None
    if found.first_failure is not None:
        worst = cells[found.first_failure].outcome
        reason, rule = worst.reason, worst.rule
    return Limit(*whose, found.limit, found.first_failure, reason, rule, found.monotone, axis.unit)


def pair_line(pair: Pair, setup: Setup, overrides: tuple[str, ...], ask: Ask, keep: Keep) -> None:
    """Run every combination of a pair's levels on a setup."""
    for both in pair.levels:
        parameters = {pair.first.parameter: both[0], pair.second.parameter: both[1]}
        outcome = ask(_task(pair.case, parameters, setup, overrides))
        keep(Cell(pair.name, both, setup.engine, setup.name, dict(setup.changes), outcome))


def _task(case: Case, parameters: dict[str, float], setup: Setup, overrides: tuple[str, ...]) -> Task:
    return Task(case.name, parameters, setup.engine, dict(setup.changes), overrides)
