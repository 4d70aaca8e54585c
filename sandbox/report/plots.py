"""Plots of one run: position, velocity and energy against time, with the closed form drawn over them."""

from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple
from uuid import uuid4
from warnings import catch_warnings, filterwarnings

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager
from matplotlib.lines import Line2D
from matplotlib.text import Text

from sandbox.measure.closed_form import ClosedForm, closed_form
from sandbox.measure.energy import Energies, energies
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene
from sandbox.trajectory import BoolArray, FloatArray, Trajectory

FORMATS: dict[str, dict[str, None]] = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
"""Suffixes that can be written, each with the metadata to leave out: the same run makes the same picture."""

MOST_BODIES = 5
"""Drawn where none is named."""
MOST_CONTACTS = 40
"""From here on contacts would hide the curves, and are left out."""
MOST_POINTS = 4000
"""Points to a curve; longer ones keep the extremes of every stretch."""

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7", "#56B4E9")
"""Of Okabe and Ito (2008): told apart under every common colour blindness. Their yellow is too pale on white."""
ENERGY = {"kinetic": "#56B4E9", "potential": "#CC79A7", "total": "#444444"}
INK, FAINT = "#222222", "#8a8a8a"

FALLBACK_FONTS = ("Noto Sans CJK JP", "Hiragino Sans", "Microsoft YaHei", "Segoe UI Emoji", "Noto Sans Arabic")
"""For names beyond what the font that comes with matplotlib can write."""


class Curve(NamedTuple):
    """One body as it is drawn; nan where it was not there."""

    name: str
    colour: str
    position: FloatArray
    velocity: FloatArray
    form: ClosedForm | None


def plot_run(
    trajectory: Trajectory,
    scene: Scene,
    path: str | Path,
    bodies: Sequence[str] | None = None,
    run_bodies: Bodies | None = None,
) -> Path:
    """Draw a run into a file, whose suffix says in which format; written to a temporary name first.

    Args:
        trajectory: the run.
        scene: its scene.
        path: where to, `.png`, `.svg` or `.pdf`.
        bodies: names to draw; by default the first `MOST_BODIES` that are not fixed.
        run_bodies: the run's bodies, where some were spawned.

    Raises:
        ValueError: the suffix is none of those, or there is no body of a name.
        OSError: the file cannot be written.
    """
    path = Path(path)
    kind = format_of(path)
    figure = draw_run(trajectory, scene, bodies, run_bodies)
    temporary = path.with_name(f".{uuid4().hex}.tmp")
    try:
        with temporary.open("xb") as stream, catch_warnings():
            # No font has every character; a missing one shows as a box.
            filterwarnings("ignore", message="Glyph .* missing from")
            filterwarnings("ignore", message="Matplotlib currently does not support .* natively")
            figure.savefig(stream, format=kind, dpi=150, metadata=FORMATS[f".{kind}"])
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    return path


def format_of(path: str | Path) -> str:
    """Return the format that a file's suffix asks for, without the dot.

    Raises:
        ValueError: with the suffixes that would be right.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise ValueError(f"{str(path)!r}: a plot is written as {', '.join(FORMATS)}; {suffix or 'no suffix'} is not one")
    return suffix[1:]


def draw_run(
    trajectory: Trajectory,
    scene: Scene,
    bodies: Sequence[str] | None = None,
    run_bodies: Bodies | None = None,
) -> Figure:
    """Return the figure that `plot_run` writes: position and velocity by axis, and the energy of the scene.

    An axis along which nothing moves is left out. The title gives the largest distance from the closed form.

    Raises:
        ValueError: there is no body of a name, or the run's bodies are not those described.
    """
    run_bodies = scene.bodies if run_bodies is None else run_bodies
    numbers = _chosen(trajectory, run_bodies, bodies)
    curves = [
        _curve(trajectory, scene, number, colour) for number, colour in zip(numbers, cycle(COLOURS), strict=False)
    ]
    axes = _moving_axes(curves)
    figure = Figure(figsize=(5.0 + 3.0 * len(axes), 8.0), layout="constrained", facecolor="white")
    rows = [[f"{what} {'xy'[axis]}" for axis in axes] for what in ("position", "velocity")]
    panels = figure.subplot_mosaic([*rows, ["energy"] * len(axes)], sharex=True)

    for axis in axes:
        for what, unit in (("position", "m"), ("velocity", "m/s")):
            panel = panels[f"{what} {'xy'[axis]}"]
            panel.set_ylabel(f"{what} {'xy'[axis]}, {unit}")
            for curve in curves:
                _line(panel, trajectory.time, getattr(curve, what)[:, axis], curve.colour)
            for curve in curves:
                if curve.form is not None:
                    _closed(panel, trajectory.time, getattr(curve.form, what)[:, axis], curve.form.valid)
    _draw_energy(panels["energy"], trajectory, scene, run_bodies, dict(zip(numbers, curves, strict=True)))

    contacts = _contacts(trajectory, numbers)
    for panel in panels.values():
        _dress(panel)
        for time in contacts:
            panel.axvline(time, color=FAINT, lw=0.7, alpha=0.4, zorder=0.5)

    entries = [(curve.name, Line2D([], [], color=curve.colour, lw=WIDE, alpha=SHEER)) for curve in curves]
    if any(curve.form is not None for curve in curves):
        entries.append(("closed form", Line2D([], [], **CLOSED)))
    if len(contacts):
        entries.append(("contact", Line2D([], [], color=FAINT, lw=0.9, alpha=0.6)))
    if entries:
        _legend(figure, entries, loc="outside lower center", ncols=min(len(entries), 4))
    _title(figure, trajectory, scene, curves)
    return figure


def _chosen(trajectory: Trajectory, bodies: Bodies, names: Sequence[str] | None) -> list[int]:
    if names is None:
        return [int(n) for n in np.flatnonzero(~bodies.fixed)[:MOST_BODIES]]
    known = trajectory.names.tolist()
    unknown = [name for name in names if name not in known]
    if unknown:
        near = get_close_matches(unknown[0], known, n=3) or known[:3]
        raise ValueError(f"no body named {unknown[0]!r}; there is {', '.join(map(repr, near)) or 'none'}")
    return [trajectory.number(name) for name in dict.fromkeys(names)]


def _curve(trajectory: Trajectory, scene: Scene, number: int, colour: str) -> Curve:
    gone = (trajectory.time >= trajectory.retired_time[number])[:, None]
    return Curve(
        name=str(trajectory.names[number]),
        colour=colour,
        position=np.where(gone, np.nan, trajectory.position[:, number]),
        velocity=np.where(gone, np.nan, trajectory.velocity[:, number]),
        form=closed_form(trajectory, scene, number),
    )


def _moving_axes(curves: list[Curve]) -> list[int]:
    """Return the axes along which something moves; both, where nothing does."""
    if not curves:
        return [0, 1]
    places = _shown(np.stack([curve.position for curve in curves], axis=1))
    spans = [np.ptp(p, axis=0).max() if len(p := _finite_rows(places[..., axis])) else 0.0 for axis in (0, 1)]
    return [axis for axis in (0, 1) if spans[axis] > REST * max(spans)] or [0, 1]
