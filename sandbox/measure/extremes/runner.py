"""Runner of a whole plan of samples in parallel worker processes, and the score of the predictions."""

import os
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from queue import Empty, SimpleQueue
from time import perf_counter
from typing import Any, ClassVar

from sandbox.jsonable import in_json, to_json
from sandbox.measure.extremes.boundary import TOLERANCE, Boundary, OnSample, Submit, run_axis, run_pair
from sandbox.measure.extremes.experiment import Axis, AxisPair, EngineSetup, setups_of_engines
from sandbox.measure.extremes.isolation import IsolatedWorker
from sandbox.measure.extremes.outcome import PairSample, Sample
from sandbox.measure.extremes.scenarios import AXES, PAIRS
from sandbox.measure.extremes.survival import LEVEL_STARTS, StartSampling
from sandbox.measure.starts import DEFAULT_SPREAD
from sandbox.progress import Progress, ProgressCallback, ignore_progress
from sandbox.provenance import machine as this_machine
from sandbox.provenance import versions as package_versions


@dataclass(frozen=True)
class PredictionScore:
    """Confusion matrix of the diagnostics of one kind, over the samples of the axes that test it.

    Refused samples, and those that the time limit stopped, are left out: their result is unknown.
    """

    kind: str
    """kind of the diagnostics"""
    true_positives: int = 0
    false_positives: int = 0
    false_negatives: int = 0
    true_negatives: int = 0

    json_properties: ClassVar = ("precision", "recall")

    @property
    def precision(self) -> float | None:
        """Fraction of the predicted problems that occurred; None if none was predicted."""
        predicted = self.true_positives + self.false_positives
        return self.true_positives / predicted if predicted else None

    @property
    def recall(self) -> float | None:
        """Fraction of the problems that were predicted; None if none occurred."""
        occurred = self.true_positives + self.false_negatives
        return self.true_positives / occurred if occurred else None


def prediction_scores(samples: Iterable[Sample], axes: Iterable[Axis]) -> tuple[PredictionScore, ...]:
    """Return a score for each kind of diagnostic that an axis tests, in the order of the axes."""
    tested = {axis.name: axis for axis in axes if axis.kind is not None}
    counts: dict[str, dict[tuple[bool, bool], int]] = {}
    for axis in tested.values():
        counts.setdefault(str(axis.kind), {})
    for sample in samples:
        tested_axis = tested.get(sample.axis)
        if tested_axis is None or sample.verdict == "refused" or sample.outcome.slow:
            continue
        key = (tested_axis.kind in sample.outcome.predicted, tested_axis.occurred(sample))
        count = counts[str(tested_axis.kind)]
        count[key] = count.get(key, 0) + 1
    return tuple(
        PredictionScore(
            kind,
            true_positives=count.get((True, True), 0),
            false_positives=count.get((True, False), 0),
            false_negatives=count.get((False, True), 0),
            true_negatives=count.get((False, False), 0),
        )
        for kind, count in counts.items()
    )


SAMPLE_SECONDS, WORKER_MEMORY = 30.0, 2048
"""Default limits: s for a run, and MiB for a worker. The libraries alone take 600 MiB of address space."""


@dataclass(frozen=True)
class ExtremesPlan:
    """Axes, pairs and engines to run, and the limits."""

    axes: tuple[Axis, ...] = field(default=tuple(AXES.values()), metadata=in_json(omit=True))
    pairs: tuple[AxisPair, ...] = field(default=PAIRS, metadata=in_json(omit=True))
    engines: tuple[str, ...] | None = field(default=None, metadata=in_json(omit=True))
    """names of the engines; None for all"""
    overrides: tuple[str, ...] = field(default=(), metadata=in_json(key="set"))
    """`KEY=VALUE`, changes to every scene"""
    quick: bool = False
    """few levels, and no bisection between them"""
    starts: int = LEVEL_STARTS
    """number of perturbed starts of a level of an axis; fewer where runs cost much; 1: the start of the scene only"""
    spread: float = DEFAULT_SPREAD
    """largest change of a start, as in `Starts`"""
    seconds: float = field(default=SAMPLE_SECONDS, metadata=in_json(key="timeout"))
    """s, time limit of a run"""
    memory: int = WORKER_MEMORY
    """MiB, memory limit of a worker"""
    workers: int = field(default_factory=lambda: os.cpu_count() or 1)
    """number of worker processes"""

    def __post_init__(self) -> None:
        """Raise ValueError if the starts are not possible."""
        _ = self.sampling

    @property
    def sampling(self) -> StartSampling:
        """From which starts a level is run.

        Raises:
            ValueError: their number is not positive, or the spread is not from 0 to `MAX_SPREAD`.
        """
        return StartSampling(self.starts, self.spread)

    def levels(self, axis: Axis) -> tuple[float, ...]:
        """Return the levels of an axis that are run."""
        return axis.quick if self.quick else axis.levels

    def setups(self, of: Axis | AxisPair) -> tuple[EngineSetup, ...]:
        """Return the engine configurations of an axis or a pair.

        Those that set a parameter which a pair varies are left out.
        """
        setups = setups_of_engines(of.setups, self.engines)
        varied = {of.first.parameter, of.second.parameter} if isinstance(of, AxisPair) else set()
        return tuple(setup for setup in setups if not varied & set(setup.changes))


@dataclass(frozen=True)
class Extremes:
    """Results of a plan, whose fields are those of its JSON document."""

    plan: ExtremesPlan = field(metadata=in_json(inline=True))
    cells: tuple[Sample, ...]
    """samples at the levels of the axes"""
    probes: tuple[Sample, ...]
    """samples between the levels, from the bisection"""
    limits: tuple[Boundary, ...]
    """boundary of each axis on each engine configuration"""
    pairs: tuple[PairSample, ...]
    """samples of the pairs of axes"""
    seconds: float
    """s, time of the whole plan"""
    interrupted: bool = False
    """whether Ctrl-C ended the plan; the finished samples are kept"""

    json_properties: ClassVar = ("predictions", "tolerance", "versions", "machine")

    @property
    def tolerance(self) -> float | None:
        """Relative accuracy of the boundaries; None if they were not bisected."""
        return None if self.plan.quick else TOLERANCE

    @property
    def versions(self) -> Mapping[str, str]:
        """Versions of Python and of the packages used."""
        return package_versions()

    @property
    def machine(self) -> Mapping[str, Any]:
        """Description of the machine."""
        return this_machine()

    @property
    def predictions(self) -> tuple[PredictionScore, ...]:
        """Scores of the preflight checks at the levels of the axes. Probes are left out: they lie at the boundaries."""
        return prediction_scores(self.cells, self.plan.axes)

    def document(self) -> dict[str, Any]:
        """Return the results as one JSON document."""
        found: dict[str, Any] = to_json(self)
        return found


COST_REFERENCE = "pymunk"
"""Setup with which costs are compared."""

SampleJob = Callable[[Submit, OnSample], Boundary | None]
RunnerMessage = Sample | tuple[Boundary | None, str] | BaseException


def extremes(plan: ExtremesPlan, on_progress: ProgressCallback | None = None) -> Extremes:
    """Run a plan. Ctrl-C ends it early with the finished samples.

    Args:
        plan: the plan.
        on_progress: progress callback; its message has the number of samples and the job finished last, its fraction
            is that of the finished jobs.

    Raises:
        WorkerError: no worker process can be started.
    """
    began = perf_counter()
    jobs = list(_jobs(plan))
    results = _run_jobs(jobs, plan, on_progress or ignore_progress)
    samples = results.samples.values()
    cells = [each for each in samples if not isinstance(each, PairSample)]
    order = _order(plan)
    on_levels = {axis.name: set(plan.levels(axis)) for axis in plan.axes}
    at_levels = sorted((c for c in cells if c.level in on_levels[c.axis]), key=order)
    return Extremes(
        plan=plan,
        cells=tuple(at_levels),
        probes=tuple(sorted((c for c in cells if c.level not in on_levels[c.axis]), key=order)),
        limits=tuple(sorted(with_costs(results.boundaries, at_levels, plan), key=order)),
        pairs=tuple(sorted((c for c in samples if isinstance(c, PairSample)), key=order)),
        seconds=perf_counter() - began,
        interrupted=results.interrupted,
    )


def with_costs(boundaries: Iterable[Boundary], cells: Iterable[Sample], plan: ExtremesPlan) -> Iterator[Boundary]:
    """Yield boundaries with their costs relative to plain pymunk, from the cells at the easiest level of each axis."""
    axes = {axis.name: axis for axis in plan.axes}
    easiest = {(c.axis, c.setup): c.outcome.cost for c in cells if c.level == plan.levels(axes[c.axis])[0]}
    for each in boundaries:
        cost, own = easiest.get((each.axis, each.setup)), easiest.get((each.axis, COST_REFERENCE))
        ratio = cost / own if cost and own else None
        equal = each.limit / ratio if ratio and each.limit and axes[each.axis].scales_with_dt else None
        yield replace(each, cost_ratio=ratio, limit_at_equal_cost=equal)


def _jobs(plan: ExtremesPlan) -> Iterator[tuple[str, SampleJob]]:
    """Yield the description and the function of each job: an axis or a pair on an engine configuration."""
    for axis in plan.axes:
        for setup in plan.setups(axis):
            yield f"{axis.name} on {setup.name}", _axis_job(plan, axis, setup)
    for pair in plan.pairs:
        for setup in plan.setups(pair):
            yield f"{pair.name} on {setup.name}", _pair_job(plan, pair, setup)


def _axis_job(plan: ExtremesPlan, axis: Axis, setup: EngineSetup) -> SampleJob:
    def job(submit: Submit, on_sample: OnSample) -> Boundary | None:
        levels = plan.levels(axis)
        sampling, bisect = plan.sampling, not plan.quick
        return run_axis(axis, setup, levels, plan.overrides, submit, on_sample, bisect=bisect, sampling=sampling)

    return job


def _pair_job(plan: ExtremesPlan, pair: AxisPair, setup: EngineSetup) -> SampleJob:
    def job(submit: Submit, on_sample: OnSample) -> Boundary | None:
        run_pair(pair, setup, plan.overrides, submit, on_sample)
        return None

    return job


@dataclass
class _Results:
    samples: dict[tuple[str, str, float | tuple[float, float]], Sample] = field(default_factory=dict)
    """by axis or pair, engine configuration and level: a sample whose further starts are run is replaced"""
    boundaries: list[Boundary] = field(default_factory=list)
    interrupted: bool = False


def _run_jobs(jobs: list[tuple[str, SampleJob]], plan: ExtremesPlan, on_progress: ProgressCallback) -> _Results:
    """Run all jobs in as many threads as there are workers. Each thread has a worker process and waits for it."""
    waiting: SimpleQueue[tuple[str, SampleJob]] = SimpleQueue()
    for each in jobs:
        waiting.put(each)
    messages: SimpleQueue[RunnerMessage] = SimpleQueue()
    count = min(plan.workers, max(len(jobs), 1))
    workers = [IsolatedWorker(plan.seconds, plan.memory) for _ in range(count)]
    threads = [threading.Thread(target=_work, args=(worker, waiting, messages), daemon=True) for worker in workers]
    results, done = _Results(), 0
    try:
        for thread in threads:
            thread.start()
        while done < len(jobs):
            try:
                message = messages.get(timeout=0.2)  # without a timeout, a signal would not be handled
            except Empty:
                continue
            if isinstance(message, BaseException):
                raise message
            if isinstance(message, Sample):
                results.samples[message.axis, message.setup, message.level] = message
                continue
            boundary, job_name = message
            done += 1
            if boundary is not None:
                results.boundaries.append(boundary)
            failed = sum(each.verdict == "failed" for each in results.samples.values())
            text = f"{len(results.samples)} cells, {failed} failed; {job_name}"
            on_progress(Progress(text, done / len(jobs)))
    except KeyboardInterrupt:
        results.interrupted = True
    finally:
        while not _close(workers, threads):
            results.interrupted = True
    return results


def _close(workers: Sequence[IsolatedWorker], threads: Sequence[threading.Thread]) -> bool:
    """End all workers and wait for the threads; return False if another Ctrl-C cut this short."""
    try:
        for worker in workers:
            worker.close()
        for thread in threads:
            if thread.is_alive():
                thread.join(timeout=5.0)
    except KeyboardInterrupt:
        return False
    return True


def _work(
    worker: IsolatedWorker, waiting: "SimpleQueue[tuple[str, SampleJob]]", messages: "SimpleQueue[RunnerMessage]"
) -> None:
    """Run jobs until there are none left or the worker is closed."""
    while True:
        try:
            job_name, job = waiting.get_nowait()
        except Empty:
            return
        try:
            messages.put((job(worker.submit, messages.put), job_name))
        except InterruptedError:
            return
        except BaseException as error:  # noqa: BLE001, every exception is raised again in the main thread
            messages.put(error)
            return


def _order(plan: ExtremesPlan) -> Callable[[Sample | Boundary], tuple[int, ...]]:
    """Return a sort key by axis, engine configuration and level, in the order of the plan: threads finish in any."""
    every: tuple[Axis | AxisPair, ...] = (*plan.axes, *plan.pairs)
    names = {each.name: k for k, each in enumerate(every)}
    setups: Mapping[tuple[str, str], int] = {
        (each.name, setup.name): k for each in every for k, setup in enumerate(plan.setups(each))
    }
    levels: dict[tuple[str, float | tuple[float, float]], int] = {}
    for axis in plan.axes:
        levels |= {(axis.name, level): k for k, level in enumerate(plan.levels(axis))}
    for pair in plan.pairs:
        levels |= {(pair.name, both): k for k, both in enumerate(pair.levels)}

    def key(each: Sample | Boundary) -> tuple[int, ...]:
        index = names[each.axis], setups[each.axis, each.setup]
        return (*index, levels.get((each.axis, each.level), 0)) if isinstance(each, Sample) else index

    return key
