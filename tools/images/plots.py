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


RAIN = """
title = "Rain"
world = { gravity = [0.0, -9.81], duration = 1.0 }
plane = [{ name = "floor", point = [0.0, 0.0], normal = [0.0, 1.0] }]
[[scatter]]
name = "drop"
count = 10
lower = [-1.0, 1.0]
upper = [1.0, 3.0]
radius = 0.05
restitution = 0.5
"""
"""Scene of the page about sweeps"""


def sweep(quantity: str, keys: str) -> Callable[[Path], None]:
    """Return a function that plots a quantity of a sweep of rain over some keys."""

    def make(path: Path) -> None:
        with TemporaryDirectory() as folder:
            scene, store, drawn = (Path(folder) / name for name in ("rain.toml", "runs", "plot.png"))
            scene.write_text(RAIN)
            sweeps = ["--sweep", "scatter.drop.restitution=0:0.9:10", "--sweep", "solver.dt=0.001:0.016:5:log"]
            more = ["--seeds", "20", "--workers", "2", "--keep", "summary", "--out", str(store), "--quiet"]
            if call(["run", str(scene), *sweeps, *more]) or call(
                ["runs", str(store), "--plot", quantity, "--by", keys, "--to", str(drawn), "--quiet"]
            ):
                sys.exit("the sweep failed")
            save_narrowed(drawn, path, 256)

    return make


def save_narrowed(drawn: Path, path: Path, colours: int = COLOURS) -> None:
    """Save a plot scaled to the page width."""
    image = Image.open(drawn).convert("RGB")
    height = round(image.height * WIDTH / image.width)
    save_png(image.resize((WIDTH, height), Image.Resampling.LANCZOS), path, colours)


def reliability(path: Path) -> None:
    """Draw the reliability diagram of the stored forecasts."""
    from tools.calibration import forecast

    forecast.plot(forecast.summary(forecast.read_cases(forecast.STORED)), path)
