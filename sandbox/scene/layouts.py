"""Layouts: where the bodies of every generator start, and how many each has.

Each generator draws from a stream of its own: see `streams.py`.
"""

from dataclasses import replace

from sandbox.scene.discs import Emitter, Grid, Scatter
from sandbox.scene.generators import expand, lifetimes, size
from sandbox.scene.layout import Layout, alike
from sandbox.scene.limbs import limb_layout
from sandbox.scene.part import Point
from sandbox.scene.ragdoll import Ragdoll, segments
from sandbox.scene.stacking import stacked
from sandbox.scene.stacks import Stack
from sandbox.scene.streams import Stream, draws
from sandbox.scene.surfaced import Mover
from sandbox.scene.weaves import Cloth, Rope
from sandbox.scene.weaving import cloth_layout, node_count, rope_layout


def count_of(mover: Mover) -> int:
    """Return how many bodies a mover has."""
    match mover:
        case Grid() | Scatter() | Emitter():
            return size(mover)
        case Stack():
            return mover.count
        case Rope():
            return node_count(mover)
        case Cloth():
            return mover.columns * mover.rows
        case Ragdoll():
            return len(segments(mover))
        case _:
            return 1


def layout_of(generator: Mover, seed: int, index: int, gravity: Point) -> Layout:
    """Lay out the bodies of a generator.

    Args:
        generator: anything that has bodies but is not one itself.
        seed: the scene's.
        index: the generator's place among its kind.
        gravity: the scene's, m/s²; slack ropes hang that way.

    Raises:
        GeneratorError: the bodies do not fit.
    """
    match generator:
        case Grid() | Scatter() | Emitter():
            position, velocity = expand(generator, seed, index)
            layout = alike(position, velocity, generator.angle, generator.angular_velocity)
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
            raise TypeError(f"{type(generator).__name__} is no generator")
