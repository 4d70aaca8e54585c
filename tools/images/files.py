"""Image files: PNGs with a palette, gifs that share one palette over all frames."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pygame
from PIL import Image

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "images"
SAMPLES = 24
"""frames of a film from which its palette is chosen"""


def image_of(surface: pygame.Surface) -> Image.Image:
    """Return a surface as an image."""
    return Image.frombytes("RGB", surface.get_size(), pygame.image.tobytes(surface, "RGB"))


def reduce_colours(image: Image.Image, colours: int) -> Image.Image:
    """Return an image with a palette of so many colours, without dithering.

    The commonest are kept as they are; of the rest half are those of which there is most, and half are spread, so that
    small bright things keep theirs.
    """
    image = image.convert("RGB")
    found = image.getcolors(colours)
    if found is not None:
        return image.quantize(len(found), Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    commonest = sorted(image.getcolors(image.width * image.height), reverse=True)[: colours // 8]
    kept = [part for _, colour in commonest for part in colour]
    rest = (colours - len(commonest)) // 2
    for how in (Image.Quantize.MEDIANCUT, Image.Quantize.MAXCOVERAGE):
        kept += (image.quantize(rest, how).getpalette() or [])[: 3 * rest]
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
        frames: of one size.
        path: of the file.
        fps: frames a second; a gif counts hundredths of a second.
        colours: of the palette that all frames share.
        hold: s for which the last frame is shown in addition.
    """
    chosen = np.unique(np.linspace(0, len(frames) - 1, SAMPLES).round().astype(int))
    montage = np.concatenate([np.asarray(frames[k].convert("RGB")) for k in chosen.tolist()])
    palette = reduce_colours(Image.fromarray(montage), colours)
    reduced = [frame.convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    shown = [round(1000.0 / fps)] * len(frames)
    shown[-1] += round(1000.0 * hold)
    reduced[0].save(path, save_all=True, append_images=reduced[1:], duration=shown, loop=0, optimize=True)
