"""A scene as a page: a picture of its start, and its key figures."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.registry import able
from sandbox.report.page.document import Page, Section
from sandbox.report.page.markup import Markup, tag
from sandbox.report.page.sight import Box, box_of
from sandbox.report.page.tables import pairs
from sandbox.report.page.wording import number, plural
from sandbox.report.paths import outlines_of
from sandbox.scene.description.fixed import Plane, Post
from sandbox.scene.scene import Scene

MAX_DRAWN = 2000
"""Bodies in the picture; of more, the first ones are drawn."""
WIDTH, HEIGHT = 560.0, 300.0
"""Units of the picture."""


def scene_page(scene: Scene) -> Page:
    """Return the page of a scene: a picture of its start, and a table of its key figures."""
    body = tag("div", scene_picture(scene), tag("div", pairs(_figures(scene))), class_="side")
    lead = tag("p", tag("bdi", scene.about)) if scene.about else None
    return Page(scene.title or "Untitled scene", "Scene", [Section("At the start", body)], lead)


def scene_picture(scene: Scene) -> Markup:
    """Return a static picture of a scene at its start, as SVG."""
    bodies = scene.bodies
    frame = PictureFrame.around(box_of(scene, [bodies.position[None]]), WIDTH, HEIGHT)
    parts = fixed_objects(scene, frame)
    for k in range(min(len(bodies), MAX_DRAWN)):
        look: dict[str, Any] = {
            "fill": "var(--solid)" if bodies.fixed[k] else "var(--e0)",
            "stroke": "var(--paper)",
            "stroke_width": 0.5,
        }
        parts += [line(frame.at(piece), closed=True, **look) for piece in outlines_of(bodies, k)]
    return frame.svg(parts, f"{scene.title or 'scene'} at the start")


@dataclass(frozen=True)
class PictureFrame:
    """Mapping of a part of the world to an SVG picture."""

    box: Box
    """left, bottom, right, top, m"""
    scale: float
    """units of the picture per metre"""

    @classmethod
    def around(cls, box: Box, width: float, height: float) -> Self:
        """Return the largest picture of a box that is at most `width` wide and `height` high."""
        left, bottom, right, top = box
        return cls(box, min(width / (right - left), height / (top - bottom)))

    def at(self, points: FloatArray) -> FloatArray:
        """Return points (…, 2), m, in units of the picture, y down; points far outside are moved closer to it."""
        moved = (points - (self.box[0], self.box[3])) * (self.scale, -self.scale)
        return np.clip(moved, -1e5, 1e5)

    def svg(self, parts: Sequence[Markup], label: str, class_: str = "scene") -> Markup:
        """Return the picture of these parts."""
        left, bottom, right, top = self.box
        width, height = f"{self.scale * (right - left):.0f}", f"{self.scale * (top - bottom):.0f}"
        size = {"viewBox": f"0 0 {width} {height}", "width": width, "height": height}
        return tag("svg", *parts, role="img", aria_label=label, class_=class_, **size)


def fixed_objects(scene: Scene, frame: PictureFrame) -> list[Markup]:
    """Return planes, walls, posts and pockets as parts of an SVG picture."""
    left, bottom, right, top = frame.box
    solid: dict[str, Any] = {"fill": "none", "stroke": "var(--solid-edge)", "stroke_width": 2.0}
    parts = []
    for thing in scene.fixed:
        if isinstance(thing, Plane):
            normal = np.asarray(thing.normal) / np.hypot(*thing.normal)
            along = np.asarray((-normal[1], normal[0])) * 2.0 * (right - left + top - bottom)
            middle = np.asarray((0.5 * (left + right), 0.5 * (bottom + top)))
            foot = middle - ((middle - np.asarray(thing.point)) @ normal) * normal
            parts.append(line(frame.at(np.asarray((foot - along, foot + along))), **solid))
        elif isinstance(thing, Post):
            parts.append(circle(frame, thing.position, thing.radius, **solid))
        else:
            points = [*thing.points, thing.points[0]] if thing.closed else thing.points
            own: dict[str, Any] = {**solid, "stroke_width": max(2.0, frame.scale * thing.thickness)}
            parts.append(line(frame.at(np.asarray(points, np.float64)), **own))
    hole: dict[str, Any] = {"fill": "var(--pocket)", "stroke": "var(--solid-edge)", "stroke_width": 1.0}
    parts += [circle(frame, pocket.position, pocket.radius, **hole) for pocket in scene.pockets]
    return parts


def circle(frame: PictureFrame, centre: Sequence[float] | FloatArray, radius: float, **look: Any) -> Markup:
    """Return a circle, m, as part of an SVG picture."""
    (x, y), size = frame.at(np.asarray([centre]))[0].tolist(), max(frame.scale * radius, 0.5)
    return tag("circle", cx=x, cy=y, r=size, **look)


def line(points: FloatArray, closed: bool = False, **look: Any) -> Markup:
    """Return a line through points (K, 2) in units of the picture, as part of it."""
    corners = "L".join(f"{x:.1f} {y:.1f}" for x, y in points.tolist())
    return tag("path", d=f"M{corners}{'Z' if closed else ''}", **look)


def _figures(scene: Scene) -> list[tuple[str, str]]:
    """Return names and values of what a scene holds."""
    world, solver = scene.world, scene.solver
    fixed = int(scene.bodies.fixed.sum())
    gravity = ", ".join(number(x) for x in world.gravity)
    counts = {
        "planes": len(scene.planes),
        "walls": len(scene.walls),
        "posts": len(scene.posts),
        "pockets": len(scene.pockets),
        "zones": len(scene.zones),
        "joints": len(scene.links),
    }
    moving = plural(len(scene.bodies), "body").replace("bodys", "bodies")
    return [
        ("bodies", f"{moving}, {fixed:,} static" if fixed else moving),
        *((name, f"{count:,}") for name, count in counts.items() if count),
        ("gravity", f"({gravity}) m/s²"),
        ("duration", f"{number(world.duration, 4)} s"),
        ("dt", f"{number(solver.dt, 4)} s" + (f", {solver.substeps} substeps" if solver.substeps > 1 else "")),
        ("seed", str(world.seed)),
        ("engines", ", ".join(able(scene)) or "none can run it"),
    ]
