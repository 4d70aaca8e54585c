"""Reduction of a scene to a minimal one on which two engines, or an engine and the truth, still differ.

The algorithm is `ddmin` of Zeller and Hildebrandt, Simplifying and isolating failure-inducing input, IEEE Trans.
Software Eng. 28 (2002): of 2, 4, 8 … parts, one is kept or left out.

    bodies, static objects, joints and forces  one kind after the other, until nothing can be left out
    materials                                  those that are not used
    values and sizes                           default values, fewer links, fewer corners
    duration and digits                        as short and as few as possible

Each candidate is tested in the same way, and kept only if it still shows the difference, so that the search can end at
any time.
"""

import json
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, NamedTuple, TypeGuard, TypeVar

import numpy as np

from sandbox.engines.common.compile_clock import clock_without_compilation
from sandbox.jsonable import JsonObject
from sandbox.measure.compare.ground_truth import truth_of
from sandbox.measure.compare.reductions import (
    CONNECTIONS,
    FIXED_KINDS,
    ExplicitDocument,
    expand_generators,
    optional_keys,
    rounded_documents,
    shorter_durations,
    smaller_counts,
    unused_materials,
    without_keys,
)
from sandbox.measure.metrics.clearance import close_pairs
from sandbox.measure.metrics.perturbation import TOUCH_TOLERANCE, agreement_time, perturb
from sandbox.measure.metrics.trajectory_error import common_frames, errors
from sandbox.measure.run.bounded_run import RunTimeoutError, bounded_run
from sandbox.measure.run.recorder import TooLargeError
from sandbox.progress import Progress, ProgressCallback, ignore_progress
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps, from_document, loads
from sandbox.trajectory import Trajectory

T = TypeVar("T")


def ddmin(items: Sequence[T], holds: Callable[[tuple[T, ...]], bool]) -> tuple[T, ...]:
    """Return a part of some items for which `holds` is true, and false without any one item more.

    It takes about 2·log₂(N) calls if a single item matters, and at most N² + 3·N. A smaller part without several items
    at once can exist. The items keep their order.

    Args:
        items: N items; `holds` is true for all of them together.
        holds: test of a part; it can be called several times with the same part.
    """
    if items and holds(()):
        return ()
    kept, parts = tuple(items), 2
    while len(kept) > 1:
        bounds = [len(kept) * k // parts for k in range(parts + 1)]
        cuts = [(bounds[k], bounds[k + 1]) for k in range(parts)]
        for begin, end in cuts:
            if holds(kept[begin:end]):
                kept, parts = kept[begin:end], 2
                break
        else:
            for begin, end in cuts if parts > 2 else ():  # with two parts, each leaves out the other
                if holds(kept[:begin] + kept[end:]):
                    kept, parts = kept[:begin] + kept[end:], max(parts - 1, 2)
                    break
            else:
                if parts >= len(kept):
                    break
                parts = min(2 * parts, len(kept))
    return kept


class DivergencePoint(NamedTuple):
    """First frame at which two runs differ by more than the tolerance."""

    time: float
    """s"""
    body: str | None
    """name of the body with the largest distance; None if a run has ended before"""
    distance: float
    """m; inf if a run is no longer finite"""
    bodies: frozenset[str] = frozenset()
    """names of all bodies whose distance exceeds the tolerance then"""


class DivergenceTest:
    """Test whether the runs of a scene diverge.

    One engine is compared with the truth, up to its `trusted_until`. Two engines are compared with each other, up to
    the time at which a perturbation of all bodies by 1e-12 m changes either run by more than the tolerance. Both
    correspond to `first_divergence` of `compare`. A run that is refused or fails does not diverge.
    """

    def __init__(self, engines: Sequence[str], tolerance: float) -> None:
        """Define the test for one engine or two.

        Args:
            engines: names of the engines.
            tolerance: tolerance of positions, m.

        Raises:
            ValueError: there are no engines, or more than two.
        """
        if not 1 <= len(engines) <= 2:
            raise ValueError(
                f"a disagreement is between one engine and the truth, or between two engines, not {len(engines)}"
            )
        self.engines, self.tolerance = tuple(engines), tolerance

    def __str__(self) -> str:
        """Return the names of the two sides."""
        return " and ".join((*self.engines, "the truth")[:2])

    def of(self, scene: Scene, time_limit: float = math.inf) -> DivergencePoint | None:
        """Return the first divergence in a scene, or None.

        Args:
            scene: the scene, run with its own settings.
            time_limit: time limit of the engines' runs together, s; a truth that has to be found has limits of its own.

        Raises:
            RunTimeoutError: the time limit was exceeded.
            TooLargeError: the frames would not fit into memory.
        """
        deadline = clock_without_compilation() + time_limit

        def run_engine(setup: Setup, engine: str) -> Trajectory:
            return bounded_run(setup, engine, setup.scene.solver, math.inf, deadline, audit=False)[0]

        if len(self.engines) == 1:
            truth = truth_of(scene, scene.solver, self.tolerance)
            if truth is None:
                return None
            return self._divergence(
                scene, run_engine(Setup.of(scene), self.engines[0]), truth.trajectory, truth.trusted_until
            )
        one, other = (run_engine(Setup.of(scene), engine) for engine in self.engines)
        divergence = self._divergence(scene, one, other, scene.world.duration)
        moved = perturb(scene) if divergence is not None else None
        if divergence is None or moved is None:
            return divergence
        for engine, run in zip(self.engines, (one, other), strict=True):
            again = run_engine(moved, engine)
            if (
                run.status == again.status == "ok"
                and agreement_time(run, again, scene, self.tolerance) < divergence.time
            ):
                return None
        return divergence

    def _divergence(self, scene: Scene, one: Trajectory, other: Trajectory, until: float) -> DivergencePoint | None:
        """Return the first divergence of two runs up to a time, s."""
        if {one.status, other.status} - {"ok", "diverged"}:
            return None
        moving = ~scene.bodies.fixed
        first = errors(one, other, moving).first_above(self.tolerance, until)
        if first is None:  # all common frames agree, but one run may have ended early
            ended_early = min((run for run in (one, other) if run.status == "diverged"), key=_end, default=None)
            if ended_early is None or _end(ended_early) > until or one.status == other.status:
                return None
            return DivergencePoint(_end(ended_early), None, math.inf)
        frames, other_frames = common_frames(one, other)
        row = int(np.flatnonzero(one.time[frames] == first)[0])
        both = (one.present(frames[row : row + 1]) & other.present(other_frames[row : row + 1]))[0] & moving
        with np.errstate(over="ignore", invalid="ignore"):
            away = np.hypot(*(one.position[frames[row]] - other.position[other_frames[row]]).T)
        away = np.where(both, np.where(np.isnan(away), np.inf, away), -1.0)
        worst = int(away.argmax())
        diverged = frozenset(map(str, one.names[away > self.tolerance]))
        return DivergencePoint(first, str(one.names[worst]), float(away[worst]), diverged)


def _end(run: Trajectory) -> float:
    return float(run.time[-1])


MAX_SCENES = 1000
"""Largest number of scenes that are tested; each is run on both engines, and perturbed."""
TIME_LIMIT = 300.0
"""s, time limit of the whole reduction."""

EARLIEST_FRACTION = 0.8
"""A smaller scene that diverges before this fraction of the original time does so for another reason."""


@dataclass(frozen=True)
class ReducedScene:
    """Smallest scene that was found; the original scene if its runs do not diverge."""

    scene: Scene
    divergence: DivergencePoint | None
    """first divergence in it; None if the runs of the original scene do not diverge"""
    bodies: tuple[int, int]
    """number of bodies before and after"""
    fixed: tuple[int, int]
    """number of static objects before and after"""
    runs: int
    """number of scenes that were tested"""
    ended: str | None
    """reason why the search ended early: `interrupted`, or a limit; None if it is complete"""


def minimise(
    scene: Scene,
    disagreement: DivergenceTest,
    *,
    max_scenes: int = MAX_SCENES,
    time_limit: float = TIME_LIMIT,
    on_progress: ProgressCallback | None = None,
) -> ReducedScene:
    """Make a scene smaller as long as its runs diverge.

    The tolerance is that of the original scene. A scene that diverges earlier, or in which only other bodies diverge,
    shows another difference and does not count; for example a body falls because its support was left out. Nor does a
    scene count in which bodies overlap more deeply than in the original. The cause in the result can still differ from
    that in the original; a larger tolerance demands a larger difference. Ctrl-C and limits end the search with the
    smallest scene so far; before the original scene has been tested, Ctrl-C is raised.

    Args:
        scene: the original scene.
        disagreement: the test.
        max_scenes: largest number of scenes that are tested.
        time_limit: time limit of the whole search, s. The result depends on it only if it is reached.
        on_progress: progress callback.

    Raises:
        RunTimeoutError: the original scene could not be tested within the time limit.
        TooLargeError: the frames of the original scene would not fit into memory.
    """
    began = perf_counter()
    divergence = disagreement.of(scene, time_limit)
    counts = (len(scene.bodies), len(scene.fixed))
    if divergence is None:
        return ReducedScene(scene, None, (counts[0],) * 2, (counts[1],) * 2, 1, None)
    search = SceneReduction(
        disagreement, scene, divergence, max_scenes, began + time_limit, on_progress or ignore_progress
    )
    ended = search.go()
    found = search.scene
    return ReducedScene(
        found, search.divergence, (counts[0], len(found.bodies)), (counts[1], len(found.fixed)), search.runs, ended
    )


class _LimitReachedError(Exception):
    """A limit of the search is reached."""


class SceneReduction:
    """Smallest scene so far, and the results of all tests."""

    def __init__(
        self,
        disagreement: DivergenceTest,
        scene: Scene,
        divergence: DivergencePoint,
        max_scenes: int,
        end: float,
        on_progress: ProgressCallback,
    ) -> None:
        self.scene, self.divergence, self.runs = scene, divergence, 1
        self._test, self._max_scenes, self._end, self._on_progress = disagreement, max_scenes, end, on_progress
        self._original = scene, divergence
        self._earliest = EARLIEST_FRACTION * divergence.time
        self._overlaps = initial_overlaps(scene)
        self._known: dict[str, tuple[Scene, DivergencePoint] | None] = {}
        self._document: ExplicitDocument = expand_generators(scene, whole=True)

    def go(self) -> str | None:
        """Run the search; return the reason why it ended early, or None."""
        ended: str | None = None
        try:
            try:
                self._reduce()
            except _LimitReachedError as error:
                ended = str(error)
            return (
                ended if self._is_confirmed() else "the result of an engine is not reproducible, so nothing was removed"
            )
        except KeyboardInterrupt:
            return "interrupted"

    def _reduce(self) -> None:
        for whole in (False, True):
            expanded = expand_generators(self.scene, whole)
            # The duration first, because all later tests are then faster.
            attempts = (*shorter_durations(expanded.document, self.divergence.time), expanded.document)
            if any(self._take(expanded.with_document(each)) for each in attempts):
                break
        self._prune()
        self._simplify()

    def _take(self, candidate: ExplicitDocument) -> bool:
        """Test a scene, and continue with it if it shows the difference."""
        key = json.dumps(candidate.document)
        if key not in self._known:
            self._known[key] = self._try(candidate)
        found = self._known[key]
        if found is None:
            return False
        self.scene, self.divergence, self._document = *found, candidate
        return True

    def _try(self, candidate: ExplicitDocument) -> tuple[Scene, DivergencePoint] | None:
        try:
            scene = from_document(candidate.document)
        except SceneError:  # the rest is no valid scene
            return None
        if not len(scene.bodies) or self._overlaps_anew(scene):
            return None
        left = self._end - perf_counter()
        if self.runs >= self._max_scenes:
            raise _LimitReachedError(f"{self._max_scenes:,} scenes have been tried")
        if left <= 0.0:
            raise _LimitReachedError("the time limit was reached")
        self.runs += 1
        self._on_progress(
            Progress(f"{len(self.scene.bodies):,} bodies, {len(self.scene.fixed):,} fixed objects; try {self.runs:,}")
        )
        try:
            divergence = self._test.of(scene, left)
        except RunTimeoutError:
            raise _LimitReachedError("the time limit was reached") from None
        except TooLargeError:
            return None
        return (scene, divergence) if self._is_the_same(divergence) else None

    def _is_the_same(self, divergence: DivergencePoint | None) -> TypeGuard[DivergencePoint]:
        """Return whether a divergence is not earlier than the original one, and concerns one of the same bodies."""
        if divergence is None or divergence.time < self._earliest:
            return False
        original = self._original[1].bodies
        return bool(divergence.bodies & original) or divergence.bodies == original

    def _overlaps_anew(self, scene: Scene) -> bool:
        """Return whether bodies overlap more deeply than in the original scene."""
        return any(
            depth > self._overlaps.get(pair, 0.0) + TOUCH_TOLERANCE for pair, depth in initial_overlaps(scene).items()
        )

    def _take_first(self, candidates: Iterable[JsonObject]) -> bool:
        """Continue with the first scene that shows the difference."""
        return any(self._take(self._document.with_document(each)) for each in candidates)

    def _prune(self) -> None:
        """Leave out bodies, static objects, joints and forces, repeatedly until nothing more can be left out."""
        before = None
        while before != self._document.document:
            before = self._document.document
            self._leave_out(self._document.body_tables)
            self._leave_out(self._document.tables_of(FIXED_KINDS))
            self._leave_out(self._document.tables_of(CONNECTIONS))
            self._take(self._document.without(unused_materials(self._document.document)))

    def _leave_out(self, tables: Sequence[tuple[str, int]]) -> None:
        start = self._document
        ddmin(tables, lambda kept: self._take(start.without(frozenset(tables) - frozenset(kept))))

    def _simplify(self) -> None:
        """Set values to their defaults, reduce counts and corners, then shorten the duration and round numbers."""
        start, keys = self._document, optional_keys(self._document.document)
        gone = frozenset(keys)
        ddmin(keys, lambda kept: self._take(start.with_document(without_keys(start.document, gone - frozenset(kept)))))
        self._prune()  # without gravity no floor is needed
        for k, wall in enumerate(self._document.document.get("wall", ())):
            self._cut_corners(k, wall["points"])
        for kind, k in self._document.body_tables:
            for key in smaller_counts(self._document.document[kind][k]):
                self._take_first(_with_value(self._document.document, kind, k, key[0], n) for n in key[1])
        self._take_first(shorter_durations(self._document.document, self.divergence.time))
        self._take_first(rounded_documents(self._document.document, None))
        for kind, k in (*self._document.body_tables, *self._document.tables_of(FIXED_KINDS)):
            self._take_first(rounded_documents(self._document.document, (kind, k)))
        self._take_first(shorter_durations(self._document.document, self.divergence.time))

    def _cut_corners(self, k: int, points: Sequence[Any]) -> None:
        start = self._document.document
        if len(points) > 2:
            ddmin(range(len(points)), lambda kept: self._take_corners(start, k, [points[n] for n in kept]))

    def _take_corners(self, document: JsonObject, k: int, points: list[Any]) -> bool:
        return len(points) >= 2 and self._take(
            self._document.with_document(_with_value(document, "wall", k, "points", points))
        )

    def _is_confirmed(self) -> bool:
        """Test the scene as it will be written; if it no longer shows the difference, return to the original scene."""
        scene = loads(dumps(self.scene))
        divergence = self._test.of(scene)
        if not self._is_the_same(divergence) or self._overlaps_anew(scene):
            self.scene, self.divergence = self._original
            return False
        self.scene, self.divergence = scene, divergence
        return True


def initial_overlaps(scene: Scene) -> dict[frozenset[str], float]:
    """Return the depth of each overlap at the start of a scene, m, by the names of the two bodies."""
    names = (*scene.bodies.names, *reversed(scene.fixed_names))  # −1 − k counts from the end
    return {frozenset((names[a], names[b])): -clear for (a, b), clear in close_pairs(scene) if clear < 0.0}


def _with_value(document: JsonObject, kind: str, k: int, key: str, value: Any) -> JsonObject:
    """Return a document with one value changed."""
    tables = [{**table, key: value} if n == k else table for n, table in enumerate(document[kind])]
    return {**document, kind: tables}
