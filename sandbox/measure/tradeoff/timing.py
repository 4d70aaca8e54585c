"""Cost of configurations, timed on this machine in milliseconds per simulated second, without recording.

Runs are timed in turns, so that the times of one turn are paired: a machine that slows down does so for all of them.
The ratio of two costs is the median of the ratios of the turns, with an interval from a bootstrap of the turns.

Source of the interval: the expanded percentile interval of T. C. Hesterberg, What teachers should know about the
bootstrap, The American Statistician 69 (2015) 371-386; a plain percentile interval is too narrow for a few turns.
"""

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, Self

import numpy as np

from sandbox.engines.common.compile_clock import clock_without_compilation
from sandbox.engines.contract import Divergence, Exhaustion
from sandbox.engines.registry import start
from sandbox.measure.paired_samples import student_quantile
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.schedule import schedule
from sandbox.signals import reraise_interrupt

WARM_UP_STEPS = 5
"""Steps made before a configuration is timed: the first steps load code and allocate memory."""


class Timing(NamedTuple):
    """Cost from separate repeats."""

    least: float
    """ms per simulated second"""
    median: float
    """ms per simulated second"""
    repeats: int
    turns: tuple[float, ...] = ()
    """s, time of each repeat; the k-th repeats of runs that were timed in turns belong together"""

    @classmethod
    def of(cls, seconds: Sequence[float], duration: float) -> "Timing":
        """Return the cost of runs from the time that each took, s, and the simulated duration, s."""
        scale = 1e3 / duration
        return cls(min(seconds) * scale, statistics.median(seconds) * scale, len(seconds), tuple(seconds))


MIN_TURNS = 5
"""Of fewer turns there is no interval: the least and the largest of 4 ratios enclose the true one in 87 % only."""
RESAMPLES = 4000
"""Bootstrap samples of an interval; its ends then vary by a few per cent of its width."""


@dataclass(frozen=True)
class CostRatio:
    """Cost of a setting relative to that of another one, timed in turns."""

    ratio: float
    """median over the turns"""
    interval: tuple[float, float] | None
    """95 % confidence interval; None with fewer than `MIN_TURNS` turns"""

    @classmethod
    def of(cls, turns: Sequence[float], base: Sequence[float]) -> Self | None:
        """Return the ratio of two costs; None if one was not timed, or they were not timed in the same turns.

        Args:
            turns: time of each repeat, in any unit.
            base: the same of the other setting, in the same unit.
        """
        if not turns or len(turns) != len(base) or not min(base) > 0.0:
            return None
        ratios = np.asarray(turns) / np.asarray(base)
        ratio, count = float(np.median(ratios)), len(ratios)
        if count < MIN_TURNS:
            return cls(ratio, None)
        chosen = np.random.default_rng(0).integers(count, size=(RESAMPLES, count))
        tail = _expanded_tail(count)
        low, high = np.quantile(np.median(ratios[chosen], axis=1), (tail, 1.0 - tail)).tolist()
        return cls(ratio, (low, high))

    def __str__(self) -> str:
        """Return the ratio with its interval: `2.4 (2.2 to 2.7)`."""
        if self.interval is None:
            return f"{self.ratio:.2g}"
        return f"{self.ratio:.2g} ({self.interval[0]:.2g} to {self.interval[1]:.2g})"


def _expanded_tail(count: int) -> float:
    """Return the probability beyond each end of an expanded percentile interval of 95 % from a number of values.

    It is that of a normal variable beyond √(n/(n−1)) times the quantile of Student's distribution with n − 1 degrees of
    freedom.
    """
    freedom = count - 1
    return 0.5 * math.erfc(math.sqrt(count / freedom) * student_quantile(freedom) / math.sqrt(2.0))


class TimedRun(NamedTuple):
    """A run to be timed."""

    scene: Scene
    engine: str
    settings: Settings


def time_in_turns(runs: Sequence[TimedRun], repeats: int) -> list[Timing | None]:
    """Time several runs in turns, so that a change of the machine's speed affects all of them.

    Args:
        runs: the runs.
        repeats: number of runs of each, after a warm-up.

    Returns:
        The cost of each run; None if it does not reach its end.
    """
    for run in runs:
        warm_up(*run)
    taken = take_turns([partial(run_seconds, *run) for run in runs], repeats)
    return [Timing.of(each, run.scene.world.duration) if each else None for run, each in zip(runs, taken, strict=True)]


def take_turns(timers: Sequence[Callable[[], float | None]], repeats: int) -> list[list[float]]:
    """Call several timers in turns and return the times of each, s; an empty list for a timer that failed.

    A timer that failed is not called again.

    Args:
        timers: each returns a time, s, or None if it failed.
        repeats: number of turns.
    """
    times: list[list[float]] = [[] for _ in timers]
    failed = [False] * len(timers)
    for _ in range(repeats):
        for k, timer in enumerate(timers):
            if failed[k]:
                continue
            seconds = timer()
            if seconds is None:
                failed[k] = True
                times[k].clear()
            else:
                times[k].append(seconds)
    return times


@reraise_interrupt()
def run_seconds(scene: Scene, engine: str, settings: Settings) -> float | None:
    """Step a scene to its end as a game does, reading every frame, and return the time that this took, s.

    Start-up and compilation do not count. None if the run does not reach its end.

    Raises:
        Refusal: the engine does not support the scene or a setting.
    """
    stretches = schedule(scene.world.duration, settings.dt)
    part = stretches[-1].part
    simulation = start(scene, engine, settings)
    try:
        began = clock_without_compilation()
        for stretch in stretches:
            for _ in range(stretch.steps):
                simulation.step()
                simulation.frame()
        if part > 0.0:
            simulation.finish(part)
            simulation.frame()
        return clock_without_compilation() - began
    except (Divergence, Exhaustion):
        return None
    finally:
        simulation.close()


def warm_up(scene: Scene, engine: str, settings: Settings) -> None:
    """Make the first steps of a run, so that loading and compilation are not timed.

    Raises:
        Refusal: the engine does not support the scene or a setting.
    """
    simulation = start(scene, engine, settings)
    try:
        stretches = schedule(scene.world.duration, settings.dt)
        for _ in range(min(WARM_UP_STEPS, stretches[0].steps)):
            simulation.step()
            simulation.frame()
        if not stretches[0].steps:
            simulation.finish(stretches[-1].part)
            simulation.frame()
    except (Divergence, Exhaustion):
        return
    finally:
        simulation.close()
