"""Wires: thin antialiased lines into pixels in one pass, thousands a picture, compiled where it can be."""

import math

import numpy as np
import numpy.typing as npt

from sandbox.arrays import FloatArray
from sandbox.engines.common.kernel import bare_kernel
from sandbox.play.drawing.blend import FULL, blended


@bare_kernel
def wires(
    pixels: npt.NDArray[np.uint32],
    stride: int,
    area: tuple[int, int, int, int],
    ends: FloatArray,
    tones: npt.NDArray[np.uint32],
) -> None:
    """Draw lines of 1 px in their order, as Wu did, 1991: in each step along a line two pixels share it.

    Args:
        pixels: of the surface, flat.
        stride: of a row, px.
        area: left, top, right and bottom of what may be drawn on, px.
        ends: (K, 4) px, x and y of both ends, in an area not much larger than the picture.
        tones: (K,) as the surface holds them.
    """
    left, top, right, bottom = area
    for k in range(len(ends)):
        ax, ay, bx, by = ends[k, 0] - 0.5, ends[k, 1] - 0.5, ends[k, 2] - 0.5, ends[k, 3] - 0.5
        steep = abs(by - ay) > abs(bx - ax)
        if steep:
            ax, ay, bx, by = ay, ax, by, bx
        if ax > bx:
            ax, ay, bx, by = bx, by, ax, ay
        slope = (by - ay) / (bx - ax) if bx > ax else 0.0
        first, last = math.floor(ax + 0.5), math.floor(bx + 0.5)
        along_low, along_high = (top, bottom) if steep else (left, right)
        across_low, across_high = (left, right) if steep else (top, bottom)
        tone = int(tones[k])
        for along in range(max(first, along_low), min(last + 1, along_high)):
            share = min(along + 0.5, bx) - max(along - 0.5, ax) if last > first else max(bx - ax, 0.5)
            across = ay + slope * (along - ax)
            row = math.floor(across)
            part = across - row
            for side in range(2):
                cover = share * (part if side else 1.0 - part)
                if across_low <= row + side < across_high:
                    place = along * stride + row + side if steep else (row + side) * stride + along
                    pixels[place] = blended(int(pixels[place]), tone, int(cover * FULL + 0.5))
