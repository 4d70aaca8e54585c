"""Manifolds: the contacts of one moment as arrays, from the candidates of the broad phase."""

from typing import Any, NamedTuple

import numpy as np

from sandbox.engines.kernel import bare_kernel as kernel
from sandbox.engines.reference.chains import is_covered
from sandbox.engines.reference.meeting import FIRST, SECOND, pair_key
from sandbox.engines.reference.narrow_phase import NARROW_PHASE
from sandbox.trajectory import BoolArray, FloatArray, IntArray

# Looked up once: compiled code cannot search a table.
circle_circle = NARROW_PHASE["circle", "circle"]
circle_half_plane = NARROW_PHASE["circle", "half_plane"]
circle_segment = NARROW_PHASE["circle", "segment"]

KIND = 60
"""Bits below the kind of a pair in its key: 0 ball-ball, 1 ball-plane, 2 ball-segment. Keys ascend."""


class Manifolds(NamedTuple):
    """K contacts, by ascending key. The second of a pair may be a fixed thing."""

    key: IntArray
    """(K,) says which pair of shapes, from step to step"""
    first: IntArray
    """(K,) body number"""
    second: IntArray
    """(K,) body number, or −1 − k"""
    normal: FloatArray
    """(K, 2) from the first to the second"""
    separation: FloatArray
    """(K,) m; negative in overlap"""
    point: FloatArray
    """(K, 2) m, midway in the overlap"""
    arm: FloatArray
    """(K, 2) m, from each centre to the contact along the normal, towards the other"""
    offset: FloatArray
    """(K, 2) m, how far to the left of the normal the contact lies from each centre; 0 for discs"""
    coefficient: FloatArray
    """(K, 2) restitution and friction of the pair"""

    @property
    def size(self) -> int:
        """K."""
        return len(self.key)

    def of(self, which: IntArray | BoolArray | slice) -> "Manifolds":
        """Return some of them."""
        columns: Any = (column[which] for column in self)
        return Manifolds(*columns)

    def joined(self, more: "Manifolds") -> "Manifolds":
        """Return these and more, one after the other: their keys need not ascend."""
        columns: Any = (np.concatenate(pair) for pair in zip(self, more, strict=True))
        return Manifolds(*columns)


@kernel
def meet_balls(
    keys: IntArray,
    position: FloatArray,
    radius: FloatArray,
    surface: IntArray,
    restitution: FloatArray,
    friction: FloatArray,
    reach: float,
    out: Manifolds,
    at: int,
) -> int:
    """Write the pairs of balls nearer than `reach` from row `at` on; return the next free row."""
    for k in range(len(keys)):
        i, j = keys[k] >> FIRST, keys[k] & SECOND
        separation, nx, ny = circle_circle(
            position[i, 0], position[i, 1], radius[i], position[j, 0], position[j, 1], radius[j]
        )
        if separation < reach:
            if at < len(out.key):
                out.key[at] = keys[k]
                out.first[at], out.second[at] = i, j
                _place(out, at, position[i, 0], position[i, 1], radius[i], radius[j], separation, nx, ny)
                out.coefficient[at, 0] = restitution[surface[i], surface[j]]
                out.coefficient[at, 1] = friction[surface[i], surface[j]]
            at += 1
    return at


@kernel
def meet_planes(
    position: FloatArray,
    radius: FloatArray,
    able: BoolArray,
    surface: IntArray,
    planes: FloatArray,
    thing: IntArray,
    thing_surface: IntArray,
    restitution: FloatArray,
    friction: FloatArray,
    reach: float,
    out: Manifolds,
    at: int,
) -> int:
    """Write the balls nearer than `reach` to half-planes from row `at` on; return the next free row."""
    for i in range(len(position)):
        if not able[i]:
            continue
        for p in range(len(planes)):
            separation, nx, ny = circle_half_plane(
                position[i, 0], position[i, 1], radius[i], planes[p, 0], planes[p, 1], planes[p, 2], planes[p, 3]
            )
            if separation < reach:
                if at < len(out.key):
                    other = thing_surface[thing[p]]
                    out.key[at] = (1 << KIND) + pair_key(i, p)
                    out.first[at], out.second[at] = i, -1 - thing[p]
                    _place(out, at, position[i, 0], position[i, 1], radius[i], 0.0, separation, nx, ny)
                    out.coefficient[at, 0] = restitution[surface[i], other]
                    out.coefficient[at, 1] = friction[surface[i], other]
                at += 1
    return at


@kernel
def meet_segments(
    keys: IntArray,
    position: FloatArray,
    radius: FloatArray,
    surface: IntArray,
    segments: FloatArray,
    joints: FloatArray,
    thing: IntArray,
    thing_surface: IntArray,
    restitution: FloatArray,
    friction: FloatArray,
    reach: float,
    out: Manifolds,
    at: int,
) -> int:
    """Write the balls nearer than `reach` to segments from row `at` on; return the next free row."""
    for k in range(len(keys)):
        i, s = keys[k] >> FIRST, keys[k] & SECOND
        separation, nx, ny = circle_segment(
            position[i, 0],
            position[i, 1],
            radius[i],
            segments[s, 0],
            segments[s, 1],
            segments[s, 2],
            segments[s, 3],
            segments[s, 4],
        )
        if separation < reach and not is_covered(
            position[i, 0],
            position[i, 1],
            segments[s, 0],
            segments[s, 1],
            segments[s, 2],
            segments[s, 3],
            nx,
            ny,
            joints[s, 0],
            joints[s, 1],
            joints[s, 2],
            joints[s, 3],
        ):
            if at < len(out.key):
                other = thing_surface[thing[s]]
                out.key[at] = (2 << KIND) + keys[k]
                out.first[at], out.second[at] = i, -1 - thing[s]
                _place(out, at, position[i, 0], position[i, 1], radius[i], segments[s, 4], separation, nx, ny)
                out.coefficient[at, 0] = restitution[surface[i], other]
                out.coefficient[at, 1] = friction[surface[i], other]
            at += 1
    return at


@kernel
def _place(
    out: Manifolds, at: int, x: float, y: float, a_arm: float, b_arm: float, separation: float, nx: float, ny: float
) -> None:
    out.normal[at, 0], out.normal[at, 1] = nx, ny
    out.separation[at] = separation
    out.arm[at, 0], out.arm[at, 1] = a_arm, b_arm
    middle = a_arm + 0.5 * separation
    out.point[at, 0], out.point[at, 1] = x + nx * middle, y + ny * middle
