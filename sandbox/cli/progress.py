"""Progress of a command on standard error: a status line, or bars. Only on a terminal, and not with `--quiet`."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from sandbox.progress import ProgressCallback

if TYPE_CHECKING:
    from rich.progress import Progress as RichProgress
    from rich.progress import TaskID


@contextmanager
def status_line(silent: bool) -> Iterator[ProgressCallback | None]:
    """Show a line with the current activity, which vanishes at the end; yield the function that sets it.

    Args:
        silent: show nothing, and yield None.
    """
    if silent or not sys.stderr.isatty():
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
    if silent or not sys.stderr.isatty():
        yield ProgressBars()
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    time = TimeRemainingColumn() if has_estimate else TimeElapsedColumn()
    columns = TextColumn("{task.description}", markup=False), BarColumn(), time
    with Progress(*columns, console=Console(stderr=True), transient=True) as bars:
        yield ProgressBars(bars)
