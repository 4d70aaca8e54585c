"""Scatter: particles into pixels in one pass, compiled where it can be."""

import numpy as np
import numpy.typing as npt

from sandbox.engines.kernel import kernel
from sandbox.trajectory import BoolArray, FloatArray


@kernel
def scatter(
    pixels: npt.NDArray[np.uint32],
    stride: int,
    area: tuple[int, int, int, int],
    position: FloatArray,
    colours: npt.NDArray[np.uint32],
    present: BoolArray,
    centre: tuple[float, float],
    scale: float,
    middle: tuple[float, float],
    side: int,
) -> None:
    """Draw particles as squares.

    Args:
        pixels: of the surface, flat.
        stride: of a row, px.
        area: left, top, right and bottom of what may be drawn on, px.
        position: (N, 2) m.
        colours: (N,) as the surface holds them.
        present: (N,) who is drawn.
        centre: of the camera, m.
        scale: of the camera, px/m.
        middle: of the picture, px.
        side: of a square, px.
    """
    left, top, right, bottom = area
    back = float(side // 2)
    for i in range(len(position)):
        if not present[i]:
            continue
        # In the order of Camera.to_screen, so that both say the same pixel. What is cut off counts from 0 on, where
        # rounding down and cutting off are one; nan is on no side of anything.
        x = (position[i, 0] - centre[0]) * scale + middle[0]
        y = (position[i, 1] - centre[1]) * -scale + middle[1]
        if side == 1:
            if x >= left and x < right and y >= top and y < bottom:
                pixels[int(y) * stride + int(x)] = colours[i]
            continue
        x, y = np.floor(x) - back, np.floor(y) - back
        if x > left - side and x < right and y > top - side and y < bottom:
            for row in range(max(int(y), top), min(int(y) + side, bottom)):
                for column in range(max(int(x), left), min(int(x) + side, right)):
                    pixels[row * stride + column] = colours[i]
