"""Sampling: points of `--sample`, spread over several ranges at once.

A grid of d ranges with n values each has n^d points; a sample has as many as are asked for, and projects evenly on each
range. Latin hypercube sampling (McKay, Beckman and Conover 1979) has one point in each of N slices of every range;
Sobol points (Sobol 1967, scrambled after Owen 1998) also fill each pair of ranges evenly, best for powers of two. Both
are seeded, and drawn by `scipy.stats.qmc`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, Self

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.batch.sweep import SampledRange, SweepAxis
from sandbox.echo import short_repr
from sandbox.resource_limits import RUNS
from sandbox.scene.files.overrides import AddressError

Method = Literal["latin", "sobol"]
METHODS: tuple[Method, ...] = ("latin", "sobol")
MAX_LATIN = 1_000_000
"""Points of a Latin hypercube, which are drawn together; Sobol points are drawn in blocks."""
MAX_SOBOL = 2**30
"""Points of a Sobol sequence of 30 bits, the default of scipy."""
BLOCK = 4_096
"""Sobol points that are drawn at a time; a power of two keeps their balance."""


@dataclass(frozen=True)
class Sampling:
    """How many points are drawn, and how: `N[:METHOD[:SEED]]`."""

    count: int
    method: Method = "latin"
    seed: int = 0

    @classmethod
    def parse(cls, text: str) -> Self:
        """Parse `N`, `N:latin`, `N:sobol` or `N:METHOD:SEED`.

        Raises:
            AddressError: the text has another form.
        """
        count, method, seed = [*text.split(":"), *("", "latin", "0")[text.count(":") + 1 :]][:3]
        found = next((each for each in METHODS if each == method), None)
        if text.count(":") > 2 or found is None or not (_is_count(count) and _is_count(seed)):
            raise AddressError(
                f"{short_repr(text)}: a sample is N, N:latin, N:sobol or N:METHOD:SEED, such as 64:sobol:7"
            )
        points = int(count)
        if points < 1:
            raise AddressError(f"{short_repr(text)}: at least 1 point must be drawn")
        if points > RUNS.value:
            raise AddressError(f"{short_repr(text)}: {points:,} points; {RUNS.remedy(points)}")
        if found == "latin" and points > MAX_LATIN:
            raise AddressError(
                f"{short_repr(text)}: a Latin hypercube has up to {MAX_LATIN:,} points; draw {count}:sobol"
            )
        if points > MAX_SOBOL:
            raise AddressError(f"{short_repr(text)}: a Sobol sequence has up to {MAX_SOBOL:,} points")
        return cls(points, found, int(seed))

    @property
    def is_balanced(self) -> bool:
        """Whether the points fill the ranges evenly: Sobol points do for powers of two."""
        return self.method != "sobol" or self.count & (self.count - 1) == 0


def sampled_axis(ranges: Sequence[SampledRange], sampling: Sampling) -> SweepAxis:
    """Return the axis of points drawn from several ranges.

    Raises:
        AddressError: scipy is not installed.
    """
    try:
        import scipy.stats  # noqa: F401, found before the first point is drawn
    except ImportError:
        raise AddressError("drawing samples needs scipy: pip install -e '.[sample]'") from None
    return SweepAxis(tuple(each.key for each in ranges), _SampledPoints(tuple(ranges), sampling))


class _SampledPoints(Sequence[tuple[Any, ...]]):
    """Points drawn from ranges; the k-th depends on the ranges, the method, the seed and, for `latin`, the count."""

    def __init__(self, ranges: tuple[SampledRange, ...], sampling: Sampling) -> None:
        self._ranges, self._sampling = ranges, sampling
        self._block, self._points = -1, np.empty((0, len(ranges)))

    def __len__(self) -> int:
        return self._sampling.count

    def __getitem__(self, index: Any) -> Any:
        """Return the values of all keys at a point."""
        k = range(len(self))[index]
        size = BLOCK if self._sampling.method == "sobol" else len(self)
        if k // size != self._block:
            self._block, self._points = k // size, self._drawn(k // size)
        fractions = self._points[k % size].tolist()
        return tuple(each.value(fraction) for each, fraction in zip(self._ranges, fractions, strict=True))

    def _drawn(self, block: int) -> FloatArray:
        """Return a block of points, (n, d), each from 0 to below 1."""
        from scipy.stats import qmc

        if self._sampling.method == "latin":
            return np.asarray(qmc.LatinHypercube(len(self._ranges), rng=self._sampling.seed).random(len(self)))
        engine = qmc.Sobol(len(self._ranges), rng=self._sampling.seed)
        if block:
            engine.fast_forward(block * BLOCK)
        return np.asarray(engine.random(BLOCK))


def _is_count(text: str) -> bool:
    return text.isascii() and text.isdecimal() and len(text) < 19
