"""Minimising: the smallest scene in which two engines, or an engine and the truth, still part.

    bodies, fixed things, joints and forces    what can be left out is, one kind after the other until none can
    materials                                  who is made of none
    figures and sizes                          what is at its default, fewer links, fewer corners
    duration and digits                        no longer than it takes, no more than it needs

Each step asks the same question, and keeps only what answers it with yes: so whatever ends the search, what there is
shows the disagreement.
"""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, TypeGuard

from sandbox.measure.bounded_run import TookTooLongError
from sandbox.measure.compare.delta import least
from sandbox.measure.compare.disagreement import Disagreement, Parting
from sandbox.measure.compare.gaps import close_pairs
from sandbox.measure.compare.horizon import TOUCH
from sandbox.measure.compare.simpler import fewer, optional, rounded, shorter, unused, without_keys
from sandbox.measure.compare.spelled import BONDS, FIXED, Document, Spelled, spelled
from sandbox.measure.recorder import TooLargeError
from sandbox.measure.told import Told, nobody
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps, from_document, loads
from sandbox.scene.scene import Scene

MOST_RUNS = 1000
"""Scenes that are tried, at most; each is run on both engines, and perturbed."""
PATIENCE = 300.0
"""s that it all may take; what is found by then counts."""

SOONEST = 0.8
"""The share of the time at which the scene given parts, before which a smaller one parts for another reason."""


@dataclass(frozen=True)
class Minimised:
    """The smallest scene that was found, and how. Where there was nothing to minimise, `scene` is the one given."""

    scene: Scene
    parting: Parting | None
    """where they part in it; None: they do not, not even in the scene given"""
    bodies: tuple[int, int]
    """before and after"""
    fixed: tuple[int, int]
    """fixed things, before and after"""
    runs: int
    """scenes that were tried"""
    ended: str | None
    """why the search ended before it was done: `interrupted`, or a bound that it came to; None: nothing more to do"""


def minimise(
    scene: Scene,
    disagreement: Disagreement,
    *,
    most_runs: int = MOST_RUNS,
    patience: float = PATIENCE,
    told: Told | None = None,
) -> Minimised:
    """Make a scene smaller for as long as a disagreement stays.

    The tolerance stays what it was, whatever is left out. A scene that parts sooner than the one given, or in which
    only other bodies part, has another disagreement, as when a support is left out and a body falls; it does not count.
    Nor does one in which two overlap that did not overlap as deep in the scene given. Even so, what is left need not
    part for the reason that the whole scene did: a larger tolerance asks for a larger disagreement. Ctrl-C ends the
    search, as a bound does; before the scene given has been tried, it passes through.

    Args:
        scene: what to make smaller.
        disagreement: which engines part, and by how much.
        most_runs: scenes that may be tried.
        patience: s that it all may take; a run beyond is given up. The result depends on it only where it is reached.
        told: progress callback.

    Raises:
        TookTooLongError: not even the scene given could be tried in that time.
        TooLargeError: its frames would not fit into memory.
    """
    began = perf_counter()
    parting = disagreement.of(scene, patience)
    counts = (len(scene.bodies), len(scene.fixed))
    if parting is None:
        return Minimised(scene, None, (counts[0],) * 2, (counts[1],) * 2, 1, None)
    search = Search(disagreement, scene, parting, most_runs, began + patience, told or nobody)
    ended = search.go()
    found = search.scene
    return Minimised(
        found, search.parting, (counts[0], len(found.bodies)), (counts[1], len(found.fixed)), search.runs, ended
    )


class _EnoughError(Exception):
    """A bound is reached."""


class Search:
    """The smallest scene so far, and what has been tried."""

    def __init__(
        self, disagreement: Disagreement, scene: Scene, parting: Parting, most_runs: int, end: float, told: Told
    ) -> None:
        self.scene, self.parting, self.runs = scene, parting, 1
        self._asked, self._most_runs, self._end, self._told = disagreement, most_runs, end, told
        self._given = scene, parting
        self._soonest = SOONEST * parting.time
        self._overlaps = overlaps(scene)
        self._known: dict[str, tuple[Scene, Parting] | None] = {}
        self._now: Spelled = spelled(scene, whole=True)

    def go(self) -> str | None:
        """Search; return why it ended before it was done, or None."""
        ended: str | None = None
        try:
            try:
                self._smaller()
            except _EnoughError as error:
                ended = str(error)
            return (
                ended if self._is_confirmed() else "the result of an engine is not reproducible, so nothing was removed"
            )
        except KeyboardInterrupt:
            return "interrupted"

    def _smaller(self) -> None:
        for whole in (False, True):
            laid = spelled(self.scene, whole)
            # Shorter first: all that follows is quicker then.
            tries = (*shorter(laid.document, self.parting.time), laid.document)
            if any(self._take(laid.with_document(each)) for each in tries):
                break
        self._prune()
        self._simplify()

    def _take(self, candidate: Spelled) -> bool:
        """Try a scene; where it shows the disagreement, go on with it."""
        key = json.dumps(candidate.document)
        if key not in self._known:
            self._known[key] = self._try(candidate)
        found = self._known[key]
        if found is None:
            return False
        self.scene, self.parting, self._now = *found, candidate
        return True

    def _try(self, candidate: Spelled) -> tuple[Scene, Parting] | None:
        try:
            scene = from_document(candidate.document)
        except SceneError:  # what is left does not go together
            return None
        if not len(scene.bodies) or self._overlaps_anew(scene):
            return None
        left = self._end - perf_counter()
        if self.runs >= self._most_runs:
            raise _EnoughError(f"{self._most_runs:,} scenes have been tried")
        if left <= 0.0:
            raise _EnoughError("the time limit was reached")
        self.runs += 1
        self._told(f"{len(self.scene.bodies):,} bodies, {len(self.scene.fixed):,} fixed objects; try {self.runs:,}")
        try:
            parting = self._asked.of(scene, left)
        except TookTooLongError:
            raise _EnoughError("the time limit was reached") from None
        except TooLargeError:
            return None
        return (scene, parting) if self._is_the_same(parting) else None

    def _is_the_same(self, parting: Parting | None) -> TypeGuard[Parting]:
        """Tell whether a scene parts no sooner than the one given, and one of the same bodies does."""
        if parting is None or parting.time < self._soonest:
            return False
        its = self._given[1].bodies
        return bool(parting.bodies & its) or parting.bodies == its

    def _overlaps_anew(self, scene: Scene) -> bool:
        """Tell whether two overlap that did not in the scene given, or deeper."""
        return any(depth > self._overlaps.get(pair, 0.0) + TOUCH for pair, depth in overlaps(scene).items())

    def _take_first(self, candidates: Iterable[Document]) -> bool:
        """Go on with the first that shows the disagreement."""
        return any(self._take(self._now.with_document(each)) for each in candidates)

    def _prune(self) -> None:
        """Leave out whatever can be: bodies, fixed things, bonds; again, until nothing can."""
        before = None
        while before != self._now.document:
            before = self._now.document
            self._leave_out(self._now.movers)
            self._leave_out(self._now.places(FIXED))
            self._leave_out(self._now.places(BONDS))
            self._take(self._now.without(unused(self._now.document)))

    def _leave_out(self, places: Sequence[tuple[str, int]]) -> None:
        start = self._now
        least(places, lambda kept: self._take(start.without(frozenset(places) - frozenset(kept))))

    def _simplify(self) -> None:
        """Take figures to their defaults, generators to fewer parts, walls to fewer corners; then time and digits."""
        start, keys = self._now, optional(self._now.document)
        gone = frozenset(keys)
        least(keys, lambda kept: self._take(start.with_document(without_keys(start.document, gone - frozenset(kept)))))
        self._prune()  # without gravity nothing needs a floor
        for k, wall in enumerate(self._now.document.get("wall", ())):
            self._cut_corners(k, wall["points"])
        for kind, k in self._now.movers:
            for key in fewer(self._now.document[kind][k]):
                self._take_first(_with(self._now.document, kind, k, key[0], n) for n in key[1])
        self._take_first(shorter(self._now.document, self.parting.time))
        self._take_first(rounded(self._now.document, None))
        for kind, k in (*self._now.movers, *self._now.places(FIXED)):
            self._take_first(rounded(self._now.document, (kind, k)))
        self._take_first(shorter(self._now.document, self.parting.time))

    def _cut_corners(self, k: int, points: Sequence[Any]) -> None:
        start = self._now.document
        if len(points) > 2:
            least(range(len(points)), lambda kept: self._take_corners(start, k, [points[n] for n in kept]))

    def _take_corners(self, document: Document, k: int, points: list[Any]) -> bool:
        return len(points) >= 2 and self._take(self._now.with_document(_with(document, "wall", k, "points", points)))

    def _is_confirmed(self) -> bool:
        """Read what will be written, and try once more; where it does not part again, go back to the scene given."""
        scene = loads(dumps(self.scene))
        parting = self._asked.of(scene)
        if not self._is_the_same(parting) or self._overlaps_anew(scene):
            self.scene, self.parting = self._given
            return False
        self.scene, self.parting = scene, parting
        return True


def overlaps(scene: Scene) -> dict[frozenset[str], float]:
    """Return how deep each two overlap at the start of a scene, m, by their names."""
    names = (*scene.bodies.names, *reversed(scene.fixed_names))  # −1 − k counts from the end
    return {frozenset((names[a], names[b])): -clear for (a, b), clear in close_pairs(scene) if clear < 0.0}


def _with(document: Document, kind: str, k: int, key: str, value: Any) -> Document:
    """Return a document with one value changed."""
    tables = [{**table, key: value} if n == k else table for n, table in enumerate(document[kind])]
    return {**document, kind: tables}
