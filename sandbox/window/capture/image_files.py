"""Outfile: where a picture or film goes. It is written under a temporary name and takes its own once it is whole.

Still: one picture taken from a surface, as bytes of a given size.
"""

import os
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from itertools import count
from pathlib import Path
from typing import Self

import numpy as np
import numpy.typing as npt
import pygame

from sandbox.whole import temporary_path
from sandbox.window.render.palette import BACKGROUND

LONGEST_STEM = 60
"""Letters of a scene's name that its files bear."""


class CaptureError(Exception):
    """A picture or film cannot be made; `str()` says why, and what would help."""


@dataclass(frozen=True)
class AtomicFile:
    """A file to be: a temporary name beside it, and how that becomes the file."""

    temporary: Path
    _placed: Callable[[Path], Path]

    @classmethod
    def at(cls, path: Path) -> Self:
        """Return an outfile that replaces what a path holds."""
        return cls(temporary_path(path.parent), lambda temporary: temporary.replace(path))

    @classmethod
    def numbered(cls, folder: Path, stem: str, suffix: str) -> Self:
        """Return an outfile that takes the first free of `sandbox-<stem>-1<suffix>`, `…-2<suffix>` and so on."""
        return cls(temporary_path(folder), partial(_place_numbered, folder=folder, stem=safe_stem(stem), suffix=suffix))

    def place(self) -> Path:
        """Give the finished file its name, and return it.

        Raises:
            CaptureError: that cannot be done; the temporary file is gone then.
        """
        try:
            return self._placed(self.temporary)
        except OSError as error:
            self.discard()
            raise unwritable_reason(self.temporary.parent, error) from None

    def discard(self) -> None:
        """Remove the temporary file, where there is one."""
        with suppress(NotADirectoryError):  # its folder has become a file
            self.temporary.unlink(missing_ok=True)


def safe_stem(name: str) -> str:
    """Return a name of letters, digits, - and _ alone, fit for a file of any system."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", name)[:LONGEST_STEM].strip("-") or "scene"


def unwritable_reason(place: Path, error: OSError) -> CaptureError:
    """Return what to say of a file that cannot be written."""
    return CaptureError(f"{place}: cannot be written: {error.strerror or error}")


def _place_numbered(temporary: Path, folder: Path, stem: str, suffix: str) -> Path:
    """Move a file to the first free number. What another process puts there meanwhile stays."""
    for number in count(1):
        path = folder / f"sandbox-{stem}-{number}{suffix}"
        try:
            os.link(temporary, path)  # unlike a rename, it never replaces
        except FileExistsError:
            continue
        except OSError:  # a file system without links: take the name by an empty file, then fill it at once
            try:
                path.open("xb").close()
            except FileExistsError:
                continue
            return temporary.replace(path)
        temporary.unlink()
        return path
    raise AssertionError("numbers do not end")


Size = tuple[int, int]
"""Width and height, px."""
Pixels = npt.NDArray[np.uint8]
"""(height, width, 3), sRGB."""

MASKS = (0xFF0000, 0xFF00, 0xFF, 0)
"""Of a surface whose pixels are 32 bits, in the order that SDL draws fastest; stated, it needs no display."""


def offscreen(size: Size) -> pygame.Surface:
    """Return an empty surface that needs no display."""
    return pygame.Surface(size, 0, 32, MASKS)


def fit_image(surface: pygame.Surface, size: Size) -> pygame.Surface:
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


def rgb_pixels(surface: pygame.Surface, size: Size) -> Pixels:
    """Return a surface's pixels in a given size."""
    data = pygame.image.tobytes(fit_image(surface, size), "RGB")
    return np.frombuffer(data, np.uint8).reshape(size[1], size[0], 3)


def png_bytes(surface: pygame.Surface) -> bytes:
    """Return a surface as the bytes of a PNG file."""
    stream = BytesIO()
    pygame.image.save(surface, stream, ".png")
    return stream.getvalue()
