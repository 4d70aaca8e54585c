"""Plots of one run: position, velocity and energy against time, with the closed form drawn over them."""

from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sandbox.arrays import FloatArray
from sandbox.measure.closed_form import ClosedForm, closed_form
from sandbox.measure.energy import energies
from sandbox.report.colours import COLOURS
from sandbox.report.figure_file import FORMATS, write_figure
from sandbox.report.panels import (
    CLOSED,
    FAINT,
    INK,
    STILL,
    add_legend,
    draw,
    draw_closed,
    dress,
    key,
    literal,
    shortened,
)
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

MOST_BODIES = 5
"""Drawn where none is named."""
MOST_CONTACTS = 40
"""From here on contacts would hide the curves, and are left out."""

ENERGY = {"kinetic": "#56B4E9", "potential": "#CC79A7", "total": "#444444"}


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
    format_of(path)  # before the work
    return write_figure(draw_run(trajectory, scene, bodies, run_bodies), path)


def format_of(path: str | Path) -> str:
    """Return the format that a file's suffix asks for, without the dot.

    Raises:
        ValueError: with the suffixes that would be right.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise ValueError(
            f"{str(path)!r}: a plot is written as {', '.join(FORMATS)}; {suffix or 'no suffix'} is not one"
        )
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
    figure = Figure(figsize=(5.0 + 3.0 * len(axes), 8.0), facecolor="white")
    rows: Any = [[f"{what} {'xy'[axis]}" for axis in axes] for what in ("position", "velocity")]
    panels = figure.subplot_mosaic([*rows, ["energy"] * len(axes)], sharex=True)

    for axis in axes:
        for what, unit in (("position", "m"), ("velocity", "m/s")):
            panel = panels[f"{what} {'xy'[axis]}"]
            panel.set_ylabel(f"{what} {'xy'[axis]}, {unit}")
            for curve in curves:
                draw(panel, trajectory.time, getattr(curve, what)[:, axis], curve.colour)
            for curve in curves:
                if curve.form is not None:
                    draw_closed(panel, trajectory.time, getattr(curve.form, what)[:, axis], curve.form.valid)
    _draw_energy(panels["energy"], trajectory, scene, run_bodies, dict(zip(numbers, curves, strict=True)))

    contacts = _contacts(trajectory, numbers)
    for name, panel in panels.items():
        dress(panel)
        # The energy panel is wider than its neighbours above: these need a time of their own.
        panel.tick_params(labelbottom=name == "energy" or (len(axes) > 1 and name.startswith("velocity")))
        if not panel.lines:
            panel.text(0.5, 0.5, "no body to draw", transform=panel.transAxes, ha="center", color=FAINT)
        for time in contacts:
            panel.axvline(time, ymax=0.07, color=FAINT, lw=1.0, zorder=0.5)

    entries = [(curve.name, key(curve.colour)) for curve in curves]
    if any(curve.form is not None for curve in curves):
        entries.append(("closed form", Line2D([], [], **CLOSED)))
    if len(contacts):
        entries.append(("contact", Line2D([], [], color=FAINT, lw=0, marker="|", ms=9)))
    columns = 12 * figure.get_figwidth() / max((12 + len(shortened(name)) for name, _ in entries), default=1)
    add_legend(figure, entries, loc="outside lower center", ncols=min(max(int(columns), 1), 4, len(entries) or 1))
    figure.align_ylabels()
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
    span = [max((_span(curve.position[:, axis]) for curve in curves), default=0.0) for axis in (0, 1)]
    return [axis for axis in (0, 1) if span[axis] > STILL * max(span)] or [0, 1]


def _span(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if len(finite) else 0.0


def _contacts(trajectory: Trajectory, numbers: list[int]) -> list[float]:
    own = np.isin(trajectory.contact_pair, numbers).any(axis=1)
    return trajectory.contact_time[own].tolist() if 0 < own.sum() < MOST_CONTACTS else []


def _draw_energy(panel: Axes, trajectory: Trajectory, scene: Scene, bodies: Bodies, curves: dict[int, Curve]) -> None:
    """Draw the energy of the whole scene, and what it would be where every body that moves has a closed form."""
    panel.set_ylabel("energy of the scene, J")
    panel.set_xlabel("time, s")
    measured = energies(trajectory, scene, bodies=bodies)
    for name, colour in ENERGY.items():
        draw(panel, trajectory.time, getattr(measured, name), colour)
    entries = [(name, key(colour)) for name, colour in ENERGY.items()]
    add_legend(panel, entries, loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=3, borderaxespad=0.0)

    forms = {number: curve.form for number, curve in curves.items() if curve.form is not None}
    if not forms or any(number not in forms for number in np.flatnonzero(~bodies.fixed).tolist()):
        return
    position, velocity = trajectory.position.copy(), trajectory.velocity.copy()
    spin = trajectory.angular_velocity.copy()
    valid = np.ones(len(trajectory.time), dtype=np.bool_)
    for number, form in forms.items():
        position[:, number], velocity[:, number] = form.position, form.velocity
        valid &= form.valid
        # What nothing turns keeps the spin that was recorded.
        spin[:, number] = spin[:, number] if form.spin is None else form.spin
    exact = replace(trajectory, position=position, velocity=velocity, angular_velocity=spin)
    ideal = energies(exact, scene, bodies=bodies)
    for name in ENERGY:
        draw_closed(panel, trajectory.time, getattr(ideal, name), valid)


def _title(figure: Figure, trajectory: Trajectory, scene: Scene, curves: list[Curve]) -> None:
    """Write, above the panels, the scene's title, how it was run, and how far it is from the closed form."""
    info = trajectory.info
    settings = info.get("settings", {})
    steps = f"dt {settings.get('dt', scene.solver.dt):g} s"
    if settings.get("substeps", 1) > 1:
        steps += f" in {settings['substeps']} substeps"
    lines = [f"{info['engine']} · {steps}" if info.get("engine") else steps]
    errors = {curve.name: _largest_error(curve) for curve in curves if curve.form is not None}
    if errors:
        worst = max(errors, key=errors.__getitem__)
        of = f" ({shortened(worst)})" if len(curves) > 1 else ""
        lines.append(f"largest position error against the closed form: {errors[worst]:.3g} m{of}")
    elif curves:
        lines.append("no closed form to compare with")
    if info.get("status", "ok") != "ok":
        lines.append(shortened(f"{info['status']}: {info.get('reason') or 'no reason given'}", 100))

    tall = figure.get_figheight()
    place: dict[str, Any] = {"x": 0.1 / figure.get_figwidth(), "va": "top", "color": INK}
    title = figure.text(
        y=1 - 0.10 / tall, s=shortened(scene.title or "untitled scene", 60), fontsize=16, weight="bold", **place
    )
    below = figure.text(y=1 - 0.44 / tall, s="\n".join(lines), fontsize=10.5, linespacing=1.4, **place)
    literal(title)
    literal(below)
    figure.set_layout_engine("constrained", rect=(0.0, 0.0, 1.0, 1 - (0.5 + 0.21 * len(lines)) / tall))


def _largest_error(curve: Curve) -> float:
    assert curve.form is not None
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.max(np.hypot(*(curve.position - curve.form.position)[curve.form.valid].T)))
