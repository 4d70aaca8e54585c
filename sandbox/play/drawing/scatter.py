"""Scatter: particles into pixels in one pass, and their fading in another, compiled where it can be."""

import numpy as np
import numpy.typing as npt

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.kernel import kernel


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
    back = side // 2
    for i in range(len(position)):
        if not present[i]:
            continue
        # In the order of Camera.to_screen, so that both say the same pixel.
        x = (position[i, 0] - centre[0]) * scale + middle[0]
        y = (position[i, 1] - centre[1]) * -scale + middle[1]
        # From 0 on, cutting off is rounding down. nan is on no side of anything.
        if x >= left + back and x < right - side + back + 1 and y >= top + back and y < bottom - side + back + 1:
            corner = (int(y) - back) * stride + int(x) - back
            for row in range(side):
                for column in range(side):
                    pixels[corner + row * stride + column] = colours[i]
        elif side > 1 and x > left - side and x < right + side and y > top - side and y < bottom + side:
            first, above = int(np.floor(x)) - back, int(np.floor(y)) - back
            for row in range(max(above, top), min(above + side, bottom)):
                for column in range(max(first, left), min(first + side, right)):
                    pixels[row * stride + column] = colours[i]


@kernel
def fade(
    tones: npt.NDArray[np.uint32],
    shades: npt.NDArray[np.uint32],
    time: float,
    born: FloatArray,
    rate: FloatArray,
    first: IntArray,
    steps: int,
) -> None:
    """Give particles the tones of their ages.

    Args:
        tones: (F,) as the surface holds them.
        shades: (S,) all there are.
        time: s.
        born: (F,) s.
        rate: (F,) shades a second.
        first: (F,) the shade that each begins with.
        steps: how many each has.
    """
    for i in range(len(tones)):
        age = (time - born[i]) * rate[i]
        tones[i] = shades[first[i] + int(min(max(age, 0.0), steps - 1.0))]
