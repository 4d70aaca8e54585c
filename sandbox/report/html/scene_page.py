"""Notebook displays of a scene and of a run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from markupsafe import Markup

from sandbox.arrays import FloatArray
from sandbox.engines.registry import able
from sandbox.formatting import UNKNOWN, format_number, format_plural
from sandbox.measure.metrics.contacts import collisions, first_collision
from sandbox.report.colours import css_class_of
from sandbox.report.html.inline_svg import time_chart
from sandbox.report.html.page import (
    Content,
    HtmlColumn,
    Page,
    Section,
    concatenated,
    definitions,
    fragment,
    isolated,
    paragraph,
    table,
)
from sandbox.report.html.replay import Track, replay
from sandbox.report.html.replay_data import Bounds, viewport
from sandbox.report.run_plot import outlines_of, run_energy_chart
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Plane, Post
from sandbox.scene.files.load import from_session
from sandbox.trajectory import Trajectory

MAX_DRAWN = 2000
"""Bodies in the picture; of more, the first ones are drawn."""
TEMPLATE = "notebook.html.j2"
WIDTH, HEIGHT = 560.0, 300.0
"""Units of the picture."""


class Shape(NamedTuple):
    """An element of an SVG picture."""

    element: str
    attributes: Mapping[str, object]
    text: str = ""


def scene_page(scene: Scene) -> Page:
    """Return the page of a scene: a picture of its start, and a table of its key figures."""
    body = fragment(TEMPLATE, "side", scene_picture(scene), definitions(_scene_figures(scene)))
    lead = isolated(scene.about) if scene.about else None
    return Page(scene.title or "Untitled scene", "Scene", [Section("At the start", body)], lead)


def scene_picture(scene: Scene) -> Markup:
    """Return a static picture of a scene at its start, as SVG."""
    bodies = scene.bodies
    frame = PictureFrame.around(viewport(scene, [bodies.position[None]]), WIDTH, HEIGHT)
    shapes = static_shapes(scene, frame)
    for k in range(min(len(bodies), MAX_DRAWN)):
        fill = "var(--solid)" if bodies.fixed[k] else "var(--e0)"
        style = {"fill": fill, "stroke": "var(--paper)", "stroke-width": 0.5}
        shapes += [line(frame.at(piece), style, closed=True) for piece in outlines_of(bodies, k)]
    return frame.svg(shapes, f"{scene.title or 'scene'} at the start")


@dataclass(frozen=True)
class PictureFrame:
    """Mapping of a part of the world to an SVG picture."""

    box: Bounds
    """left, bottom, right, top, m"""
    scale: float
    """units of the picture per metre"""

    @classmethod
    def around(cls, box: Bounds, width: float, height: float) -> Self:
        """Return the largest picture of a box that is at most `width` wide and `height` high."""
        left, bottom, right, top = box
        return cls(box, min(width / (right - left), height / (top - bottom)))

    def at(self, points: FloatArray) -> FloatArray:
        """Return points (…, 2), m, in units of the picture, y down; points far outside are moved closer to it."""
        moved = (points - (self.box[0], self.box[3])) * (self.scale, -self.scale)
        return np.clip(moved, -1e5, 1e5)

    def svg(self, shapes: Sequence[Shape], label: str, css_class: str = "scene") -> Markup:
        """Return the picture of some shapes."""
        left, bottom, right, top = self.box
        width, height = f"{self.scale * (right - left):.0f}", f"{self.scale * (top - bottom):.0f}"
        return fragment(TEMPLATE, "picture", width, height, label, css_class, shapes)


def static_shapes(scene: Scene, frame: PictureFrame) -> list[Shape]:
    """Return planes, walls, posts and pockets as shapes of an SVG picture."""
    left, bottom, right, top = frame.box
    solid: dict[str, object] = {"fill": "none", "stroke": "var(--solid-edge)", "stroke-width": 2.0}
    parts = []
    for thing in scene.fixed:
        if isinstance(thing, Plane):
            normal = np.asarray(thing.normal) / np.hypot(*thing.normal)
            along = np.asarray((-normal[1], normal[0])) * 2.0 * (right - left + top - bottom)
            middle = np.asarray((0.5 * (left + right), 0.5 * (bottom + top)))
            foot = middle - ((middle - np.asarray(thing.point)) @ normal) * normal
            parts.append(line(frame.at(np.asarray((foot - along, foot + along))), solid))
        elif isinstance(thing, Post):
            parts.append(circle(frame, thing.position, thing.radius, solid))
        else:
            points = [*thing.points, thing.points[0]] if thing.closed else thing.points
            wall_style = {**solid, "stroke-width": max(2.0, frame.scale * thing.thickness)}
            parts.append(line(frame.at(np.asarray(points, np.float64)), wall_style))
    hole = {"fill": "var(--pocket)", "stroke": "var(--solid-edge)", "stroke-width": 1.0}
    parts += [circle(frame, pocket.position, pocket.radius, hole) for pocket in scene.pockets]
    return parts


def circle(
    frame: PictureFrame, centre: Sequence[float] | FloatArray, radius: float, style: Mapping[str, object]
) -> Shape:
    """Return a circle, m, as a shape of an SVG picture."""
    (x, y), size = frame.at(np.asarray([centre]))[0].tolist(), max(frame.scale * radius, 0.5)
    return Shape("circle", {"cx": f"{x:.6g}", "cy": f"{y:.6g}", "r": f"{size:.6g}", **style})


def line(points: FloatArray, style: Mapping[str, object], closed: bool = False) -> Shape:
    """Return a line through points (K, 2), in units of the picture, as a shape of it."""
    corners = "L".join(f"{x:.1f} {y:.1f}" for x, y in points.tolist())
    return Shape("path", {"d": f"M{corners}{'Z' if closed else ''}", **style})


def _scene_figures(scene: Scene) -> dict[str, Content]:
    """Return the key figures of a scene by name."""
    world, solver = scene.world, scene.solver
    fixed = int(scene.bodies.fixed.sum())
    gravity = ", ".join(format_number(x) for x in world.gravity)
    counts = {
        "planes": len(scene.planes),
        "walls": len(scene.walls),
        "posts": len(scene.posts),
        "pockets": len(scene.pockets),
        "zones": len(scene.zones),
        "sensors": len(scene.sensors),
        "joints": len(scene.joint_arrays),
    }
    count = format_plural(len(scene.bodies), "body", "bodies")
    return {
        "bodies": f"{count}, {fixed:,} static" if fixed else count,
        **{name: f"{count:,}" for name, count in counts.items() if count},
        "gravity": f"({gravity}) m/s²",
        "duration": f"{format_number(world.duration, 4)} s",
        "dt": f"{format_number(solver.dt, 4)} s" + (f", {solver.substeps} substeps" if solver.substeps > 1 else ""),
        "seed": str(world.seed),
        "engines": ", ".join(able(scene)) or "none can run it",
    }


MAX_LISTED = 12
"""Bodies whose final state is listed."""
FINAL = (
    HtmlColumn("body"),
    HtmlColumn("x, m", True),
    HtmlColumn("y, m", True),
    HtmlColumn("v_x, m/s", True),
    HtmlColumn("v_y, m/s", True),
)


def run_page(run: Trajectory, replayed: bool = True) -> Page:
    """Return the page of a run.

    Args:
        run: the run; without frames, such as after a refusal, the page has its status and reason.
        replayed: with the replay.
    """
    scene = from_session(dict(run.info["scene"]), "info.scene")
    sections: list[Section] = []
    if len(run.time) and replayed:
        sections.append(Section("Replay", _replay(run, scene)))
    sections.append(Section("Figures", definitions(_run_figures(run))))
    if len(run.time):
        sections.append(Section("Final state", _final(run)))
    remarks = [str(run.reason)] if run.reason else list(run.warnings)
    lead = isolated("; ".join(remarks)) if remarks else None
    engine = run.info.get("engine")
    return Page(scene.title or "Untitled scene", f"Run on {engine}" if engine else "Run", sections, lead)


def _replay(run: Trajectory, scene: Scene) -> Markup:
    """Return the replay, and beside it the energy where the run has the scene's own bodies and joints."""
    if len(run.broken_time) not in (0, len(scene.joint_arrays)):
        return paragraph("The run changed its joints; `sandbox replay` shows it.")
    name = str(run.info.get("engine") or "truth")
    has_own_bodies = len(run.names) == len(scene.bodies)
    shown = run if has_own_bodies else _with_bodies(run, len(scene.bodies))
    canvas = replay(scene, [Track(name, css_class_of(name), shown)], None)
    if not has_own_bodies:
        spawned = len(run.names) - len(scene.bodies)
        return concatenated(canvas, paragraph(f"Without {spawned:,} bodies that were added during the run."))
    duration = max(scene.world.duration, float(run.time[-1]))
    label = "kinetic, potential and total energy against time"
    chart = time_chart(run_energy_chart(run, scene, duration), "run-energy", label, duration)
    return fragment("comparison.html.j2", "linked_plots", canvas, [chart])


def _with_bodies(run: Trajectory, count: int) -> Trajectory:
    """Return a run with only the bodies of the scene, which come first; bodies added later follow them."""
    columns = ("position", "velocity", "angle", "angular_velocity")
    kept = {key: getattr(run, key)[:, :count] for key in columns}
    return replace(run, names=run.names[:count], retired_time=run.retired_time[:count], **kept)


def _run_figures(run: Trajectory) -> dict[str, Content]:
    """Return the key figures of a run by name."""
    info = run.info
    settings = info.get("settings") or {}
    missed = run.missed_contacts
    start, end = info.get("energy_start"), info.get("energy_end")
    first = first_collision(run)
    end_time = f", to {format_number(float(run.time[-1]), 4)} s" if len(run.time) else ""
    return {
        "engine": str(info.get("engine") or UNKNOWN),
        "status": run.status,
        "bodies": f"{len(run.names):,}",
        "frames": f"{len(run.time):,}{end_time}",
        "dt": f"{format_number(settings['dt'], 4)} s" if "dt" in settings else UNKNOWN,
        "energy": f"{format_number(start, 4)} → {format_number(end, 4)} J",
        "contacts": f"{collisions(run):,}",
        "first contact": UNKNOWN if first is None else f"{format_number(first, 6)} s",
        "missed contacts": UNKNOWN if missed is None else f"{missed:,}",
        "computing time": f"{format_number(info.get('seconds'))} s",
    }


def _final(run: Trajectory) -> Markup:
    rows: list[list[Content]] = [
        [isolated(name), *(format_number(value, 4) for value in (*position, *velocity))]
        for name, position, velocity in zip(
            run.names[:MAX_LISTED].tolist(),
            run.position[-1, :MAX_LISTED].tolist(),
            run.velocity[-1, :MAX_LISTED].tolist(),
            strict=True,
        )
    ]
    more = len(run.names) - MAX_LISTED
    note = paragraph(f"and {more:,} more bodies") if more > 0 else None
    return concatenated(table(FINAL, rows, "Final state"), note)
