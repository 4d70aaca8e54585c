"""Still: one picture taken from a surface, as bytes of a given size."""

from io import BytesIO

import numpy as np
import numpy.typing as npt
import pygame

from sandbox.play.drawing.palette import BACKGROUND

Size = tuple[int, int]
"""Width and height, px."""
Pixels = npt.NDArray[np.uint8]
"""(height, width, 3), sRGB."""

MASKS = (0xFF0000, 0xFF00, 0xFF, 0)
"""Of a surface whose pixels are 32 bits, in the order that SDL draws fastest; stated, it needs no display."""


def offscreen(size: Size) -> pygame.Surface:
    """Return an empty surface that needs no display."""
    return pygame.Surface(size, 0, 32, MASKS)


def fitted(surface: pygame.Surface, size: Size) -> pygame.Surface:
    """Return a picture in another size, averaged where it shrinks, with bars where the proportions differ."""
    if surface.get_size() == size:
        return surface
    width, height = surface.get_size()
    share = min(size[0] / max(width, 1), size[1] / max(height, 1))
    inner = (min(max(round(width * share), 1), size[0]), min(max(round(height * share), 1), size[1]))
    # Off by rounding alone, it is no bar but one row of pixels: stretch over it.
    inner = (size[0] if size[0] - inner[0] < 2 else inner[0], size[1] if size[1] - inner[1] < 2 else inner[1])
    plain = offscreen((width, height))  # what smoothscale takes, whatever the surface is like
    plain.blit(surface, (0, 0))
    small = pygame.transform.smoothscale(plain, inner)
    if inner == size:
        return small
    whole = offscreen(size)
    whole.fill(BACKGROUND)
    whole.blit(small, ((size[0] - inner[0]) // 2, (size[1] - inner[1]) // 2))
    return whole


def pixels(surface: pygame.Surface, size: Size) -> Pixels:
    """Return a surface's pixels in a given size."""
    data = pygame.image.tobytes(fitted(surface, size), "RGB")
    return np.frombuffer(data, np.uint8).reshape(size[1], size[0], 3)


def png(surface: pygame.Surface) -> bytes:
    """Return a surface as the bytes of a PNG file."""
    stream = BytesIO()
    pygame.image.save(surface, stream, ".png")
    return stream.getvalue()
