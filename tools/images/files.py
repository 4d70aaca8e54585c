"""Image files: PNGs with a palette, gifs with one palette for all frames."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pygame
from PIL import Image

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "images"
SAMPLES = 24
"""Number of frames of a film from which its palette is chosen."""


def image_of(surface: pygame.Surface) -> Image.Image:
    """Return a surface as an image."""
    return Image.frombytes("RGB", surface.get_size(), pygame.image.tobytes(surface, "RGB"))


def reduce_colours(image: Image.Image, colours: int) -> Image.Image:
    """Return an image with a palette of `colours` colours, without dithering.

    The most common colours are kept. Of the rest one half is chosen by frequency and one half by coverage of the colour
    space, so that small bright objects keep their colours.
    """
    image = image.convert("RGB")
    found = image.getcolors(colours)
    if found is not None:
        return image.quantize(len(found), Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    counted: list[Any] = image.getcolors(image.width * image.height) or []
    commonest = sorted(counted, reverse=True)[: colours // 8]
    kept: list[int] = [part for _, colour in commonest for part in colour]
    rest = (colours - len(commonest)) // 2
    for method in (Image.Quantize.MEDIANCUT, Image.Quantize.MAXCOVERAGE):
        kept += (image.quantize(rest, method).getpalette() or [])[: 3 * rest]
    palette = Image.new("P", (1, 1))
    palette.putpalette(kept)
    return image.quantize(palette=palette, dither=Image.Dither.NONE)


def save_png(image: Image.Image, path: Path, colours: int = 256) -> None:
    """Write an image as a PNG with a palette."""
    path.parent.mkdir(parents=True, exist_ok=True)
    reduce_colours(image, colours).save(path, optimize=True)


def save_gif(frames: Sequence[Image.Image], path: Path, fps: float, colours: int, hold: float = 0.0) -> None:
    """Write frames as a gif that loops.

    Args:
        frames: frames of equal size.
        path: path of the file.
        fps: frames per second; a gif has durations in hundredths of a second.
        colours: number of colours of the common palette.
        hold: additional duration of the last frame, s.
    """
    chosen = np.unique(np.linspace(0, len(frames) - 1, SAMPLES).round().astype(int))
    montage = np.concatenate([np.asarray(frames[k].convert("RGB")) for k in chosen.tolist()])
    palette = reduce_colours(Image.fromarray(montage), colours)
    reduced = [frame.convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    durations = [round(1000.0 / fps)] * len(frames)
    durations[-1] += round(1000.0 * hold)
    reduced[0].save(path, save_all=True, append_images=reduced[1:], duration=durations, loop=0, optimize=True)
