"""Stacking: where the boxes of a stack start."""

from __future__ import annotations  # `np.random` in an annotation would import it wherever scenes are read

import numpy as np

from sandbox.scene.layout import Layout, alike, turned
from sandbox.scene.stacks import Stack


def stacked(stack: Stack, random: np.random.Generator) -> Layout:
    """Lay out the boxes of a stack, row by row from the bottom, each from the left."""
    width, height = stack.size[0] + stack.gap, stack.size[1] + stack.gap
    per_row = stack.columns - stack.fewer * np.arange(stack.rows)
    row = np.repeat(np.arange(stack.rows), per_row)
    column = np.arange(stack.count) - np.repeat(np.cumsum(per_row) - per_row, per_row)
    x = (column - 0.5 * (per_row[row] - 1)) * width
    x += (random.random(stack.count) * 2.0 - 1.0) * stack.jitter
    offset = np.column_stack((x, 0.5 * stack.size[1] + row * height))
    position = np.asarray(stack.base) + (turned(offset, stack.angle) if stack.angle else offset)
    return alike(position, stack.velocity, stack.angle, stack.angular_velocity)
