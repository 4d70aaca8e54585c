"""Generators: elements that stand for many balls, expanded with the scene's seed.

Each generator draws from a stream of its own, keyed by the seed, its kind and its place among its kind, so
that adding one generator changes no other. Only uniform doubles are drawn: their stream is stable in numpy.
"""

from __future__ import annotations  # `np.random` in an annotation would import it wherever scenes are read

import math

import numpy as np

from sandbox.scene.model import Emitter, Generator, Grid, Scatter
from sandbox.scene.near import FloatArray, IntArray, near_pairs
from sandbox.scene.streams import Stream, bits, draws

ROUNDS = 400
"""Rounds of placing what is still missing before a scatter gives up."""


class GeneratorError(Exception):
    """A generator that cannot be expanded, and where it stands; `str()` says what would be right."""

    def __init__(self, location: tuple[str | int, ...], message: str) -> None:
        super().__init__(message)
        self.location = location


JAMMED = 0.6
"""Discs dropped at random jam at a coverage of 0.547 (Feder 1980); a small box holds a little more."""


def size(generator: Generator) -> int:
    """Return how many balls a generator stands for."""
    return generator.columns * generator.rows if isinstance(generator, Grid) else generator.count


def expand(generator: Generator, seed: int, index: int) -> tuple[FloatArray, FloatArray]:
    """Return positions (N, 2) in m and velocities (N, 2) in m/s.

    Args:
        generator: what to expand.
        seed: the scene's.
        index: the generator's place among its kind.

    Raises:
        GeneratorError: the balls do not fit.
    """
    match generator:
        case Grid():
            return _grid(generator, draws(Stream.GRID, seed, index))
        case Scatter():
            return _scatter(generator, draws(Stream.SCATTER, seed, index), index)
        case Emitter():
            return _emitter(generator, draws(Stream.EMITTER, seed, index))


def lifetimes(emitter: Emitter, seed: int, index: int) -> FloatArray:
    """Return how long each particle lives, (N,) s, shortest first; inf for ever.

    What is drawn is independent of the velocities, which all are drawn alike: to sort it changes nothing that can be
    seen of the particles, and lets those that are left have consecutive numbers.
    """
    if emitter.lifetime is None:
        return np.full(emitter.count, np.inf)
    stream = bits(Stream.EMITTER, seed, index)
    stream.advance(2 * emitter.count)  # past the velocities: a draw is one step of the stream
    random = np.random.Generator(stream).random(emitter.count)
    return np.sort(emitter.lifetime + (random * 2.0 - 1.0) * emitter.lifetime_jitter)


def _spread(random: np.random.Generator, count: int, half_width: float) -> FloatArray:
    return (random.random((count, 2)) * 2.0 - 1.0) * half_width


def _grid(grid: Grid, random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    count = size(grid)
    row, column = np.divmod(np.arange(count), grid.columns)
    position = np.asarray(grid.origin) + np.column_stack((column, row)) * np.asarray(grid.spacing)
    position += _spread(random, count, grid.jitter)
    return position, np.asarray(grid.velocity) + _spread(random, count, grid.velocity_jitter)


def _scatter(scatter: Scatter, random: np.random.Generator, index: int) -> tuple[FloatArray, FloatArray]:
    """Random sequential addition: what overlaps an earlier ball is drawn again."""
    lower, upper = np.asarray(scatter.lower), np.asarray(scatter.upper)
    position = lower + random.random((scatter.count, 2)) * (upper - lower)
    if scatter.collides == "all":
        reach = 2.0 * scatter.radius
        covered = scatter.count * math.pi * scatter.radius**2 / float(np.prod(upper - lower + reach))
        jams = scatter.count > 1 and covered >= JAMMED
        rejected = np.arange(scatter.count) if jams else _overlapping(position, reach)
        for _ in range(0 if jams else ROUNDS):
            if not len(rejected):
                break
            position[rejected] = lower + random.random((len(rejected), 2)) * (upper - lower)
            rejected = _overlapping(position, reach)
        if len(rejected):
            raise GeneratorError(
                ("scatter", index, "count"),
                f"{scatter.count:,} balls of radius {scatter.radius:g} m do not fit at random without overlap: "
                f"they would cover {covered:.0%} of the box, and random placement jams near 50 %; lower the "
                'count or the radius, widen the box, use a [[grid]], or let them overlap with collides = "none"',
            )
    velocity = np.asarray(scatter.velocity) + _spread(random, scatter.count, scatter.velocity_jitter)
    return position, velocity


def _overlapping(position: FloatArray, reach: float) -> IntArray:
    """Return the later ball of every overlapping pair."""
    late = [np.maximum(i, j)[np.hypot(*(position[i] - position[j]).T) < reach] for i, j in near_pairs(position, reach)]
    return np.unique(np.concatenate(late)) if late else np.empty(0, dtype=np.int64)


def _emitter(emitter: Emitter, random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    slowest, fastest = np.asarray(emitter.velocity_min), np.asarray(emitter.velocity_max)
    position = np.tile(np.asarray(emitter.position), (emitter.count, 1))
    return position, slowest + random.random((emitter.count, 2)) * (fastest - slowest)
