"""Progress of a command on standard error: a status line, or bars. Only on a terminal, and not with `--quiet`."""

import os
import sys
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import TYPE_CHECKING, Self

import click

from sandbox.progress import ProgressCallback

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.live import Live
    from rich.progress import Progress as RichProgress
    from rich.progress import TaskID


def has_terminal() -> bool:
    """Return whether standard error is a terminal that can replace its lines.

    A command in a cell of a Jupyter notebook has a terminal, but each change of a line is added to the cell's output.
    """
    return sys.stderr.isatty() and "JPY_PARENT_PID" not in os.environ


@contextmanager
def status_line(silent: bool) -> Iterator[ProgressCallback | None]:
    """Show a line with the current activity, which vanishes at the end; yield the function that sets it.

    Args:
        silent: show nothing, and yield None.
    """
    if silent or not has_terminal():
        yield None
        return
    from rich.console import Console
    from rich.text import Text

    with Console(stderr=True).status("") as line:
        yield lambda progress: line.update(Text(progress.message))


class ProgressBar:
    """Progress bar with a description; does nothing without a terminal."""

    def __init__(self, bars: "RichProgress | None", text: str, total: float | None) -> None:
        self._bars = bars
        self._task: TaskID | None = None if bars is None else bars.add_task(text, total=total)

    def update(self, completed: float, text: str | None = None, total: float | None = None) -> None:
        """Show the completed amount, and a new description or total if given."""
        if self._bars is not None and self._task is not None:
            self._bars.update(self._task, completed=completed, description=text, total=total)


class ProgressBars:
    """Several progress bars, one below the other."""

    def __init__(self, bars: "RichProgress | None" = None) -> None:
        self._bars = bars

    @property
    def is_shown(self) -> bool:
        """Whether there is a terminal, and the command is not silent."""
        return self._bars is not None

    def add(self, text: str, total: float | None = None) -> ProgressBar:
        """Add a bar; a total of None is not known yet."""
        return ProgressBar(self._bars, text, total)

    def callback(self, text: str) -> ProgressCallback | None:
        """Add a bar; return a callback that sets the fraction done, or None if nothing is shown."""
        if self._bars is None:
            return None
        bar = self.add(text, 1.0)
        return lambda progress: bar.update(progress.fraction or 0.0)


@contextmanager
def progress_bars(silent: bool, has_estimate: bool = True) -> Iterator[ProgressBars]:
    """Show bars, which vanish at the end.

    Args:
        silent: show nothing.
        has_estimate: show an estimate of the remaining time, otherwise the elapsed time.
    """
    if silent or not has_terminal():
        yield ProgressBars()
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    time = TimeRemainingColumn() if has_estimate else TimeElapsedColumn()
    columns = TextColumn("{task.description}", markup=False), BarColumn(), time
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        yield ProgressBars(bars)


PLAIN_INTERVAL = 10.0
"""s between two lines where there is no terminal"""
RATE_WINDOW = 30.0
"""s, the latest time over which the rate is measured"""


class RunMonitor:
    """Progress of many runs: done, failed, rate, time left and the slowest run.

    On a terminal it is a live table below the output; elsewhere it is a line every `PLAIN_INTERVAL`, so that short
    commands print nothing.

    Args:
        total: number of runs, or an upper bound.
        silent: show nothing.
    """

    def __init__(self, total: int, silent: bool) -> None:
        self._total, self._silent = total, silent
        self._is_terminal = has_terminal()
        self._done = self._failed = self._stored = 0
        self._running, self._fraction = "", 0.0
        self._slowest: tuple[float, str] = (0.0, "")
        self._began = self._last_line = perf_counter()
        self._completions: deque[float] = deque()
        """times at which runs of the last `RATE_WINDOW` were completed"""
        self._live: Live | None = None

    def __enter__(self) -> Self:
        if self._is_terminal and not self._silent:
            from rich.console import Console
            from rich.live import Live

            self._live = Live(
                console=Console(stderr=True), transient=True, refresh_per_second=8, get_renderable=self._render
            )
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    def start(self, name: str) -> None:
        """Show the run that was started last."""
        self._running, self._fraction = name, 0.0

    def show_fraction(self, fraction: float) -> None:
        """Show the completed fraction of the run, where one runs at a time."""
        self._fraction = fraction

    def add(self, name: str, *, seconds: float | None, is_ok: bool, is_stored: bool) -> None:
        """Count a completed run.

        Args:
            name: the run, for messages.
            seconds: s, its computing time.
            is_ok: it has the status `ok`.
            is_stored: it was not made, but read from the store.
        """
        now = perf_counter()
        self._done += 1
        self._fraction = 0.0
        self._failed += not is_ok
        self._stored += is_stored
        if not is_stored:
            self._completions.append(now)
            self._slowest = max(self._slowest, (seconds or 0.0, name))
        if not (self._is_terminal or self._silent) and now - self._last_line >= PLAIN_INTERVAL:
            self._last_line = now
            click.echo(f"{self._done:,} of {self._total:,} runs done{self._state(now)}", err=True)

    def _rate(self, now: float) -> float:
        """Return the runs a second that were made in the last `RATE_WINDOW`."""
        while self._completions and self._completions[0] < now - RATE_WINDOW:
            self._completions.popleft()
        return len(self._completions) / max(min(now - self._began, RATE_WINDOW), 1e-3)

    def _state(self, now: float) -> str:
        rate = self._rate(now)
        parts = [f"{self._stored:,} of them stored before"] if self._stored else []
        parts += [f"{self._failed:,} not ok"] if self._failed else []
        if rate:
            parts += [f"{rate:.3g} runs/s", f"{duration_text((self._total - self._done) / rate)} left"]
        if self._slowest[1]:
            parts.append(f"slowest {self._slowest[0]:.2g} s: {self._slowest[1]}")
        return "".join(f"; {part}" for part in parts)

    def _render(self) -> "RenderableType":
        """Return the live table."""
        from rich.console import Group
        from rich.progress_bar import ProgressBar as Bar
        from rich.table import Table
        from rich.text import Text

        table = Table.grid(padding=(0, 1))
        current = f"{min(self._done + 1, self._total)}/{self._total} {self._running}"
        table.add_row(Text(current), Bar(total=max(self._total, 1), completed=self._done + self._fraction, width=40))
        state = self._state(perf_counter()).removeprefix("; ")
        return Group(table, Text(f"{self._done:,} done; {state}" if state else f"{self._done:,} done", style="dim"))


def duration_text(seconds: float) -> str:
    """Return a duration as text: `42 s`, `3 min`, `5 h`, `2 days`."""
    for unit, size in (("days", 86_400.0), ("h", 3_600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} s" if seconds >= 1.0 else f"{seconds:.1g} s"
