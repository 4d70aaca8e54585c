"""Plots of runs: paths, and quantities over time with their closed forms."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from difflib import get_close_matches
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import AxLine, Line2D
from matplotlib.patches import Circle, Polygon

from sandbox.arrays import FloatArray
from sandbox.measure.analytic import ClosedForm, closed_form
from sandbox.measure.metrics.contacts import are_collisions
from sandbox.measure.metrics.energy import energies
from sandbox.report.colours import COLOURS
from sandbox.report.style import (
    BEYOND,
    CHART_POINTS,
    CLOSED,
    FAINT,
    FORMATS,
    INK,
    MAX_POINTS,
    STILL,
    add_legend,
    chart_figure,
    draw,
    draw_closed,
    dress,
    finish_chart,
    key,
    literal,
    shortened,
    write_figure,
)
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Plane, Post
from sandbox.trajectory import Trajectory

SOLID: dict[str, Any] = {"color": "#9a9a9a", "lw": 1.4, "zorder": 0.6}
"""Line of static bodies."""


def moving_axes(runs: Iterable[Trajectory], numbers: list[int]) -> list[int]:
    """Return the axes, 0 or 1, along which some of the bodies move in some run; both if none moves."""
    positions = [run.position[:, numbers] for run in runs]
    span = [max((_robust_span(position[..., axis]) for position in positions), default=0.0) for axis in (0, 1)]
    return [axis for axis in (0, 1) if span[axis] > STILL * max(span)] or [0, 1]


def _robust_span(position: FloatArray) -> float:
    """Return the largest range of any of the coordinates (T, K), m."""
    if not position.size:
        return 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        travelled = np.asarray(position.max(axis=0) - position.min(axis=0))
    return float(np.nan_to_num(travelled, nan=0.0, posinf=0.0).max())


def draw_path(panel: Axes, run: Trajectory, number: int, axes: list[int], colour: str, until: float | None) -> None:
    """Draw the path of a body in two lines: up to the time until which the truth is trusted, and beyond it."""
    position = np.where((run.time >= run.retired_time[number])[:, None], np.nan, run.position[:, number])
    trusted = run.time <= (math.inf if until is None else until)
    untrusted = np.append(~trusted[1:], True)  # the pale line begins where the other ends
    for kept in (trusted, untrusted):
        shown = np.where(kept[:, None], position, np.nan)
        if len(axes) == 1:
            draw(panel, run.time, shown[:, axes[0]], colour)
        else:
            panel.plot(*_path(shown).T, color=colour, solid_joinstyle="round", solid_capstyle="butt")


def draw_truth(panel: Axes, run: Trajectory, number: int, axes: list[int], until: float) -> None:
    """Draw the true path of a body up to a time, thin and dashed."""
    valid = (run.time <= until) & ~(run.time >= run.retired_time[number])
    if len(axes) == 1:
        draw_closed(panel, run.time, run.position[:, number, axes[0]], valid)
        return
    x, y = _path(run.position[valid, number]).T
    panel.plot(x, y, **CLOSED)


def _path(position: FloatArray) -> FloatArray:
    """Decimate a path (T, 2); points that cannot be drawn become nan."""
    kept = position[:: max(1, math.ceil(len(position) / MAX_POINTS))]
    kept = np.concatenate((kept, position[-1:]))
    is_drawable = np.asarray((np.abs(kept) < BEYOND).all(axis=1))
    return np.where(is_drawable[:, None], kept, np.nan)


def draw_fixed(panel: Axes, scene: Scene) -> None:
    """Draw planes, walls, posts and static bodies; as artists they do not influence the limits of the axes."""
    for thing in scene.fixed:
        if isinstance(thing, Plane):
            x, y = thing.point
            panel.add_artist(AxLine((x, y), (x - thing.normal[1], y + thing.normal[0]), None, **SOLID))
        elif isinstance(thing, Post):
            panel.add_artist(Circle(thing.position, thing.radius, fill=False, **SOLID))
        else:
            points = [*thing.points, thing.points[0]] if thing.closed else thing.points
            panel.add_artist(Line2D(*np.asarray(points).T, **SOLID))
    bodies = scene.bodies
    for number in np.flatnonzero(bodies.fixed).tolist():
        pieces = outlines_of(bodies, number)
        edge = SOLID if len(pieces) == 1 else SOLID | {"lw": 2.0 * SOLID["lw"]}
        for piece in pieces:
            panel.add_artist(Polygon(piece, fill=False, **edge))
        for piece in pieces if len(pieces) > 1 else ():  # hides the edges between the pieces
            inside = {"color": panel.get_facecolor(), "lw": 0.0, "zorder": SOLID["zorder"] + 0.01}
            panel.add_artist(Polygon(piece, **inside))


def outlines_of(bodies: Bodies, number: int) -> list[FloatArray]:
    """Return the outlines (K, 2) of the pieces of a body at the start, m."""
    shapes, angle = bodies.shapes, float(bodies.angle[number])
    cos, sin = math.cos(angle), math.sin(angle)
    turn = np.asarray(((cos, sin), (-sin, cos)))
    found = []
    for piece in np.flatnonzero(shapes.body == number).tolist():
        corners = shapes.corner[shapes.first[piece] : shapes.first[piece + 1]]
        found.append(bodies.position[number] + _widened(corners, float(shapes.radius[piece])) @ turn)
    return found


def _widened(corners: FloatArray, radius: float) -> FloatArray:
    """Return the outline of a convex hull offset by a radius, m."""
    if radius == 0.0:
        return corners
    if len(corners) == 1:
        angles = np.linspace(-math.pi, math.pi, 65)[None, :-1]
    else:
        edge = np.roll(corners, -1, axis=0) - corners
        normal = np.arctan2(-edge[:, 0], edge[:, 1])
        before = np.roll(normal, 1)
        angles = before[:, None] + np.mod(normal - before, 2.0 * math.pi)[:, None] * np.linspace(0.0, 1.0, 25)
    around = corners[:, None] + radius * np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    return np.asarray(around.reshape(-1, 2))


MAX_BODIES = 5
"""Number of bodies drawn if none is named."""
MAX_CONTACTS = 40
"""Number of contacts from which on their marks are omitted, because they would hide the curves."""
ENERGY = {"kinetic": "#56B4E9", "potential": "#CC79A7", "total": "#444444"}


class Curve(NamedTuple):
    """Curves of one body; nan while it is absent."""

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
    """Draw a run into a file, in the format of its suffix; written to a temporary name first.

    Args:
        trajectory: the run.
        scene: its scene.
        path: path of the file, `.png`, `.svg` or `.pdf`.
        bodies: names to draw; by default the first `MAX_BODIES` that are not fixed.
        run_bodies: bodies of the run, if some were added; default: those of the scene.

    Raises:
        ValueError: the suffix is not one of these, or no body has a given name.
        OSError: the file cannot be written.
    """
    path = Path(path)
    format_of(path)  # checked before the figure is drawn
    return write_figure(draw_run(trajectory, scene, bodies, run_bodies), path)


def format_of(path: str | Path) -> str:
    """Return the format of a file by its suffix, without the dot.

    Raises:
        ValueError: another suffix; the message lists the valid ones.
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

    An axis along which nothing moves is omitted. The title gives the largest distance from the closed form.

    Raises:
        ValueError: no body has a given name, or `run_bodies` are not those of the run.
    """
    run_bodies = scene.bodies if run_bodies is None else run_bodies
    numbers = _chosen(trajectory, run_bodies, bodies)
    curves = [
        _curve(trajectory, scene, number, colour) for number, colour in zip(numbers, cycle(COLOURS), strict=False)
    ]
    axes = _moving_axes(curves)
    figure = Figure(figsize=(5.0 + 3.0 * len(axes), 8.0), facecolor="white")
    rows: Any = [[f"{quantity} {'xy'[axis]}" for axis in axes] for quantity in ("position", "velocity")]
    panels = figure.subplot_mosaic([*rows, ["energy"] * len(axes)], sharex=True)

    for axis in axes:
        for quantity, unit in (("position", "m"), ("velocity", "m/s")):
            panel = panels[f"{quantity} {'xy'[axis]}"]
            panel.set_ylabel(f"{quantity} {'xy'[axis]}, {unit}")
            for curve in curves:
                draw(panel, trajectory.time, getattr(curve, quantity)[:, axis], curve.colour)
            for curve in curves:
                if curve.form is not None:
                    draw_closed(panel, trajectory.time, getattr(curve.form, quantity)[:, axis], curve.form.valid)
    _draw_energy(panels["energy"], trajectory, scene, run_bodies, dict(zip(numbers, curves, strict=True)))

    contacts = _contacts(trajectory, numbers)
    for name, panel in panels.items():
        dress(panel)
        # The energy panel is wider than the panels above, which therefore need their own tick labels.
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
        return [int(n) for n in np.flatnonzero(~bodies.fixed)[:MAX_BODIES]]
    known = trajectory.names.tolist()
    unknown = [name for name in names if name not in known]
    if unknown:
        suggestions = get_close_matches(unknown[0], known, n=3) or known[:3]
        raise ValueError(f"no body named {unknown[0]!r}; there is {', '.join(map(repr, suggestions)) or 'none'}")
    return [trajectory.number(name) for name in dict.fromkeys(names)]


def _curve(trajectory: Trajectory, scene: Scene, number: int, colour: str) -> Curve:
    is_retired = (trajectory.time >= trajectory.retired_time[number])[:, None]
    return Curve(
        name=str(trajectory.names[number]),
        colour=colour,
        position=np.where(is_retired, np.nan, trajectory.position[:, number]),
        velocity=np.where(is_retired, np.nan, trajectory.velocity[:, number]),
        form=closed_form(trajectory, scene, number),
    )


def _moving_axes(curves: list[Curve]) -> list[int]:
    """Return the axes along which something moves; both if nothing moves."""
    span = [max((_span(curve.position[:, axis]) for curve in curves), default=0.0) for axis in (0, 1)]
    return [axis for axis in (0, 1) if span[axis] > STILL * max(span)] or [0, 1]


def _span(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if len(finite) else 0.0


def _contacts(trajectory: Trajectory, numbers: list[int]) -> list[float]:
    is_drawn = np.isin(trajectory.contact_pair, numbers).any(axis=1) & are_collisions(trajectory)
    return trajectory.contact_time[is_drawn].tolist() if 0 < is_drawn.sum() < MAX_CONTACTS else []


def run_energy_chart(trajectory: Trajectory, scene: Scene, duration: float) -> Figure:
    """Return kinetic, potential and total energy of a run against time, as a chart for a page.

    Args:
        trajectory: the run; it has the bodies and joints of the scene.
        scene: its scene.
        duration: end of the time axis, s.
    """
    figure, panel = chart_figure()
    _draw_measured_energy(panel, trajectory, scene, scene.bodies, CHART_POINTS)
    dress(panel)
    finish_chart(panel, "energy of the scene, J", duration)
    panel.set_ylabel("")
    return figure


def _draw_measured_energy(
    panel: Axes, trajectory: Trajectory, scene: Scene, bodies: Bodies, max_points: int = MAX_POINTS
) -> None:
    """Draw the energy of the whole scene, with a legend above the panel."""
    measured = energies(trajectory, scene, bodies=bodies)
    for name, colour in ENERGY.items():
        draw(panel, trajectory.time, getattr(measured, name), colour, max_points)
    entries = [(name, key(colour)) for name, colour in ENERGY.items()]
    add_legend(panel, entries, loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=3, borderaxespad=0.0)


def _draw_energy(panel: Axes, trajectory: Trajectory, scene: Scene, bodies: Bodies, curves: dict[int, Curve]) -> None:
    """Draw the energy of the whole scene, and that of the closed forms where every moving body has one."""
    panel.set_ylabel("energy of the scene, J")
    panel.set_xlabel("time, s")
    _draw_measured_energy(panel, trajectory, scene, bodies)

    forms = {number: curve.form for number, curve in curves.items() if curve.form is not None}
    if not forms or any(number not in forms for number in np.flatnonzero(~bodies.fixed).tolist()):
        return
    position, velocity = trajectory.position.copy(), trajectory.velocity.copy()
    spin = trajectory.angular_velocity.copy()
    valid = np.ones(len(trajectory.time), dtype=np.bool_)
    for number, form in forms.items():
        position[:, number], velocity[:, number] = form.position, form.velocity
        valid &= form.valid
        # A closed form without rotation leaves the recorded spin.
        spin[:, number] = spin[:, number] if form.spin is None else form.spin
    exact = replace(trajectory, position=position, velocity=velocity, angular_velocity=spin)
    ideal = energies(exact, scene, bodies=bodies)
    for name in ENERGY:
        draw_closed(panel, trajectory.time, getattr(ideal, name), valid)


def _title(figure: Figure, trajectory: Trajectory, scene: Scene, curves: list[Curve]) -> None:
    """Write title of the scene, engine and step, and largest error against the closed form above the panels."""
    info = trajectory.info
    settings = info.get("settings", {})
    steps = f"dt {settings.get('dt', scene.solver.dt):g} s"
    if settings.get("substeps", 1) > 1:
        steps += f" in {settings['substeps']} substeps"
    lines = [f"{info['engine']} · {steps}" if info.get("engine") else steps]
    errors = {curve.name: _largest_error(curve) for curve in curves if curve.form is not None}
    if errors:
        worst = max(errors, key=errors.__getitem__)
        body = f" ({shortened(worst)})" if len(curves) > 1 else ""
        lines.append(f"largest position error against the closed form: {errors[worst]:.3g} m{body}")
    elif curves:
        lines.append("no closed form to compare with")
    if info.get("status", "ok") != "ok":
        lines.append(shortened(f"{info['status']}: {info.get('reason') or 'no reason given'}", 100))

    height = figure.get_figheight()
    layout: dict[str, Any] = {"x": 0.1 / figure.get_figwidth(), "va": "top", "color": INK}
    title = figure.text(
        y=1 - 0.10 / height, s=shortened(scene.title or "untitled scene", 60), fontsize=16, weight="bold", **layout
    )
    subtitle = figure.text(y=1 - 0.44 / height, s="\n".join(lines), fontsize=10.5, linespacing=1.4, **layout)
    literal(title)
    literal(subtitle)
    figure.set_layout_engine("constrained", rect=(0.0, 0.0, 1.0, 1 - (0.5 + 0.21 * len(lines)) / height))


def _largest_error(curve: Curve) -> float:
    assert curve.form is not None
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.max(np.hypot(*(curve.position - curve.form.position)[curve.form.valid].T)))
