"""Expansion of grids, scatters, emitters and stacks, and the start state of the bodies of all generators.

Each generator has its own random stream, keyed by the seed, its kind and its index among its kind, so that adding a
generator does not change the others; see `random_streams.py`. Only uniform doubles are drawn: their stream is stable
across versions of numpy.
"""

from __future__ import annotations  # `np.random` in an annotation would import it wherever scenes are read

import math
from dataclasses import replace

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.articulated import cloth_layout, limb_layout, node_count, rope_layout
from sandbox.scene.compile.bodies import Layout, rotated, uniform_layout
from sandbox.scene.description.base import BodySource, Point
from sandbox.scene.description.discs import Emitter, Generator, Grid, Scatter
from sandbox.scene.description.generators import Cloth, Ragdoll, Rope, Stack, segments
from sandbox.scene.geometry.neighbours import near_pairs
from sandbox.scene.random_streams import Stream, bits, draws

MAX_ROUNDS = 400
"""Rounds of placing the remaining balls before a scatter fails."""


class GeneratorError(Exception):
    """A generator cannot be expanded; `location` is its position, and `str()` gives the reason and a remedy."""

    def __init__(self, location: tuple[str | int, ...], message: str) -> None:
        super().__init__(message)
        self.location = location


JAMMING_COVERAGE = 0.6
"""Random sequential addition of discs jams at a coverage of 0.547 (Feder 1980); a small box holds a little more."""


def size(generator: Generator) -> int:
    """Return the number of balls of a generator."""
    return generator.columns * generator.rows if isinstance(generator, Grid) else generator.count


def expand(generator: Generator, seed: int, index: int) -> tuple[FloatArray, FloatArray]:
    """Return positions (N, 2) in m and velocities (N, 2) in m/s.

    Args:
        generator: to be expanded.
        seed: of the scene.
        index: index of the generator among its kind.

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
    """Return the lifetime of each particle, (N,) s, ascending; inf without one.

    Lifetimes are independent of velocities, which are identically distributed. So sorting does not change the
    distribution, and the remaining particles have consecutive indices.
    """
    if emitter.lifetime is None:
        return np.full(emitter.count, np.inf)
    stream = bits(Stream.EMITTER, seed, index)
    stream.advance(2 * emitter.count)  # skip the velocities: each draw is one step of the stream
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
    """Random sequential addition: a ball that overlaps an earlier one is drawn again."""
    lower, upper = np.asarray(scatter.lower), np.asarray(scatter.upper)
    position = lower + random.random((scatter.count, 2)) * (upper - lower)
    if scatter.collides == "all":
        diameter = 2.0 * scatter.radius
        covered = scatter.count * math.pi * scatter.radius**2 / float(np.prod(upper - lower + diameter))
        jams = scatter.count > 1 and covered >= JAMMING_COVERAGE
        rejected = np.arange(scatter.count) if jams else _overlapping(position, diameter)
        for _ in range(0 if jams else MAX_ROUNDS):
            if not len(rejected):
                break
            position[rejected] = lower + random.random((len(rejected), 2)) * (upper - lower)
            rejected = _overlapping(position, diameter)
        if len(rejected):
            raise GeneratorError(
                ("scatter", index, "count"),
                f"{scatter.count:,} balls of radius {scatter.radius:g} m do not fit at random without overlap: "
                f"they would cover {covered:.0%} of the box, and random placement jams near 50 %; use "
                'fewer or smaller balls, a larger box or a [[grid]], or let them overlap with collides = "none"',
            )
    velocity = np.asarray(scatter.velocity) + _spread(random, scatter.count, scatter.velocity_jitter)
    return position, velocity


def _overlapping(position: FloatArray, diameter: float) -> IntArray:
    """Return the later ball of every overlapping pair."""
    late = [
        np.maximum(i, j)[np.hypot(*(position[i] - position[j]).T) < diameter] for i, j in near_pairs(position, diameter)
    ]
    return np.unique(np.concatenate(late)) if late else np.empty(0, dtype=np.int64)


def _emitter(emitter: Emitter, random: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    slowest, fastest = np.asarray(emitter.velocity_min), np.asarray(emitter.velocity_max)
    position = np.tile(np.asarray(emitter.position), (emitter.count, 1))
    return position, slowest + random.random((emitter.count, 2)) * (fastest - slowest)


def stacked(stack: Stack, random: np.random.Generator) -> Layout:
    """Return the start state of the boxes of a stack, row by row from the bottom, each from the left."""
    width, height = stack.size[0] + stack.gap, stack.size[1] + stack.gap
    per_row = stack.columns - stack.fewer * np.arange(stack.rows)
    row = np.repeat(np.arange(stack.rows), per_row)
    column = np.arange(stack.count) - np.repeat(np.cumsum(per_row) - per_row, per_row)
    x = (column - 0.5 * (per_row[row] - 1)) * width
    x += (random.random(stack.count) * 2.0 - 1.0) * stack.jitter
    offset = np.column_stack((x, 0.5 * stack.size[1] + row * height))
    position = np.asarray(stack.base) + (rotated(offset, stack.angle) if stack.angle else offset)
    fixed = np.full(stack.count, stack.fixed)
    return uniform_layout(position, stack.velocity, stack.angle, stack.angular_velocity, fixed)


def count_of(source: BodySource) -> int:
    """Return the number of bodies of an element."""
    match source:
        case Grid() | Scatter() | Emitter():
            return size(source)
        case Stack():
            return source.count
        case Rope():
            return node_count(source)
        case Cloth():
            return source.columns * source.rows
        case Ragdoll():
            return len(segments(source))
        case _:
            return 1


def layout_of(generator: BodySource, seed: int, index: int, gravity: Point) -> Layout:
    """Return the start state of the bodies of a generator.

    Args:
        generator: an element with several bodies.
        seed: of the scene.
        index: index of the generator among its kind.
        gravity: of the scene, m/s²; slack ropes sag along it.

    Raises:
        GeneratorError: the bodies do not fit.
    """
    match generator:
        case Grid() | Scatter() | Emitter():
            position, velocity = expand(generator, seed, index)
            layout = uniform_layout(position, velocity, generator.angle, generator.angular_velocity)
            if isinstance(generator, Emitter):
                return replace(layout, lifetime=lifetimes(generator, seed, index))
            return layout
        case Stack():
            return stacked(generator, draws(Stream.STACK, seed, index))
        case Rope():
            return rope_layout(generator, gravity)
        case Cloth():
            return cloth_layout(generator)
        case Ragdoll():
            return limb_layout(generator)
        case _:
            raise TypeError(f"{type(generator).__name__} is not a generator")
