"""Image files: atomic output files with free numbers in their names, pixels of surfaces, and PNGs."""

import os
import re
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO
from itertools import count
from pathlib import Path
from typing import Self

import numpy as np
import numpy.typing as npt
import pygame

from sandbox.atomic_write import temporary_path
from sandbox.window.render.palette import BACKGROUND

MAX_STEM = 60
"""characters of a scene's name in the names of its files"""
MASKS = (0xFF0000, 0xFF00, 0xFF, 0)
"""masks of a surface of 32 bits per pixel, in the order that SDL draws fastest; explicit masks need no display"""

Size = tuple[int, int]
"""Width and height, px."""
Pixels = npt.NDArray[np.uint8]
"""(height, width, 3), sRGB."""


class PictureError(Exception):
    """A picture or film cannot be made; the message states the reason and a remedy."""


@dataclass(frozen=True)
class AtomicFile:
    """An output file that is written under a temporary name and gets its own name when it is complete."""

    temporary: Path
    """path to write to"""
    path: Path
    """path of the complete file"""
    is_numbered: bool = False
    """whether the first free number is appended to the name; else an existing file is replaced"""

    @classmethod
    def at(cls, path: Path) -> Self:
        """Return a file that replaces an existing one."""
        return cls(temporary_path(path.parent), path)

    @classmethod
    def numbered(cls, folder: Path, stem: str, suffix: str) -> Self:
        """Return a file with the first free name of `sandbox-<stem>-1<suffix>`, `…-2<suffix>` and so on."""
        return cls(temporary_path(folder), folder / f"sandbox-{safe_stem(stem)}{suffix}", is_numbered=True)

    def place(self) -> Path:
        """Rename the complete file to its final name, and return its path.

        Raises:
            PictureError: the file cannot be renamed; the temporary file is removed then.
        """
        try:
            return self._link_numbered() if self.is_numbered else self.temporary.replace(self.path)
        except OSError as error:
            self.discard()
            raise unwritable_reason(self.temporary.parent, error) from None

    def discard(self) -> None:
        """Remove the temporary file, if it exists."""
        with suppress(NotADirectoryError):  # its folder has become a file
            self.temporary.unlink(missing_ok=True)

    def _link_numbered(self) -> Path:
        """Move the file to the first free number; a file that another process creates meanwhile is kept."""
        for number in count(1):
            path = self.path.with_name(f"{self.path.stem}-{number}{self.path.suffix}")
            try:
                os.link(self.temporary, path)  # unlike a rename, it never replaces
            except FileExistsError:
                continue
            except OSError:  # a file system without links: reserve the name by an empty file, then replace that
                try:
                    path.open("xb").close()
                except FileExistsError:
                    continue
                return self.temporary.replace(path)
            self.temporary.unlink()
            return path
        raise AssertionError("unreachable: count() is infinite")


def safe_stem(name: str) -> str:
    """Return a name with each run of other characters than ASCII letters, digits, `-` and `_` replaced by `-`."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", name)[:MAX_STEM].strip("-") or "scene"


def unwritable_reason(path: Path, error: OSError) -> PictureError:
    """Return the error for a file or folder that cannot be written."""
    return PictureError(f"{path}: cannot be written: {error.strerror or error}")


def offscreen(size: Size) -> pygame.Surface:
    """Return an empty surface that needs no display."""
    return pygame.Surface(size, 0, 32, MASKS)


def fit_image(surface: pygame.Surface, size: Size) -> pygame.Surface:
    """Return a picture in another size, averaged if it shrinks, with bars if the proportions differ."""
    if surface.get_size() == size:
        return surface
    width, height = surface.get_size()
    factor = min(size[0] / max(width, 1), size[1] / max(height, 1))
    inner = (min(max(round(width * factor), 1), size[0]), min(max(round(height * factor), 1), size[1]))
    # A bar of one row of pixels comes from rounding alone: stretch the picture over it.
    inner = (size[0] if size[0] - inner[0] < 2 else inner[0], size[1] if size[1] - inner[1] < 2 else inner[1])
    source = offscreen((width, height))  # smoothscale requires this pixel format
    source.blit(surface, (0, 0))
    scaled = pygame.transform.smoothscale(source, inner)
    if inner == size:
        return scaled
    fitted = offscreen(size)
    fitted.fill(BACKGROUND)
    fitted.blit(scaled, ((size[0] - inner[0]) // 2, (size[1] - inner[1]) // 2))
    return fitted


def rgb_pixels(surface: pygame.Surface, size: Size) -> Pixels:
    """Return a surface's pixels in a given size."""
    data = pygame.image.tobytes(fit_image(surface, size), "RGB")
    return np.frombuffer(data, np.uint8).reshape(size[1], size[0], 3)


def png_bytes(surface: pygame.Surface) -> bytes:
    """Return a surface as the bytes of a PNG file."""
    stream = BytesIO()
    pygame.image.save(surface, stream, ".png")
    return stream.getvalue()


def save_image(surface: pygame.Surface, outfile: AtomicFile) -> Path:
    """Write a surface as a complete PNG or not at all, and return its path.

    Raises:
        PictureError: the file cannot be written.
    """
    try:
        with outfile.temporary.open("xb") as stream:
            stream.write(png_bytes(surface))
    except OSError as error:
        outfile.discard()
        raise unwritable_reason(outfile.temporary.parent, error) from None
    except BaseException:
        outfile.discard()
        raise
    return outfile.place()


def screenshot(surface: pygame.Surface, folder: Path, stem: str) -> Path:
    """Write a surface as `sandbox-<stem>-<n>.png`, n being the first free number, and return its path.

    Args:
        surface: picture.
        folder: folder of the file.
        stem: name of the scene; see `safe_stem`.

    Raises:
        PictureError: the folder cannot be written to.
    """
    return save_image(surface, AtomicFile.numbered(folder, stem, ".png"))
