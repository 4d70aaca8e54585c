"""Plots made by commands of the documentation."""

import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from sandbox.cli.main import call

from .files import save_png

COLOURS = 64
WIDTH = 960
"""px"""


def plot(*arguments: str) -> Callable[[Path], None]:
    """Return a function that makes a plot by a command with `--plot FILE`."""

    def make(path: Path) -> None:
        with TemporaryDirectory() as folder:
            drawn = Path(folder) / "plot.png"
            if call([*arguments, "--quiet", "--plot", str(drawn)]) == 2:
                sys.exit(f"sandbox {' '.join(arguments)} failed")
            save_narrowed(drawn, path)

    return make


def save_narrowed(drawn: Path, path: Path) -> None:
    """Save a plot scaled to the page width."""
    image = Image.open(drawn).convert("RGB")
    height = round(image.height * WIDTH / image.width)
    save_png(image.resize((WIDTH, height), Image.Resampling.LANCZOS), path, COLOURS)
