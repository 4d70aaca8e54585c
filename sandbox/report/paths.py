"""Paths: where bodies went, in the plane or along one axis against time, among the fixed things."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import AxLine, Line2D
from matplotlib.patches import Circle, Polygon

from sandbox.arrays import FloatArray
from sandbox.report.panels import BEYOND, CLOSED, MOST_POINTS, STILL, draw, draw_closed
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.fixed import Plane, Post
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

SOLID: dict[str, Any] = {"color": "#9a9a9a", "lw": 1.4, "zorder": 0.6}
"""Fixed things."""


def moving_axes(runs: Iterable[Trajectory], numbers: list[int]) -> list[int]:
    """Return the axes, 0 or 1, along which some of the bodies move in some run; both, where none does."""
    places = [run.position[:, numbers] for run in runs]
    span = [max((_span(position[..., axis]) for position in places), default=0.0) for axis in (0, 1)]
    return [axis for axis in (0, 1) if span[axis] > STILL * max(span)] or [0, 1]


def _span(position: FloatArray) -> float:
    """Return how far any one of (T, K) coordinates travels."""
    if not position.size:
        return 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        travelled = np.asarray(position.max(axis=0) - position.min(axis=0))
    return float(np.nan_to_num(travelled, nan=0.0, posinf=0.0).max())


def draw_path(panel: Axes, run: Trajectory, number: int, axes: list[int], colour: str, until: float | None) -> None:
    """Draw where a body went, in two lines: as far as the truth is trusted, and pale beyond."""
    position = np.where((run.time >= run.retired_time[number])[:, None], np.nan, run.position[:, number])
    trusted = run.time <= (math.inf if until is None else until)
    begun = np.append(~trusted[1:], True)  # the pale line begins where the other ends
    for kept in (trusted, begun):
        there = np.where(kept[:, None], position, np.nan)
        if len(axes) == 1:
            draw(panel, run.time, there[:, axes[0]], colour)
        else:
            panel.plot(*_path(there).T, color=colour, solid_joinstyle="round", solid_capstyle="butt")


def draw_truth(panel: Axes, run: Trajectory, number: int, axes: list[int], until: float) -> None:
    """Draw where a body should have gone, thin and dashed, up to a time."""
    valid = (run.time <= until) & ~(run.time >= run.retired_time[number])
    if len(axes) == 1:
        draw_closed(panel, run.time, run.position[:, number, axes[0]], valid)
        return
    x, y = _path(run.position[valid, number]).T
    panel.plot(x, y, **CLOSED)


def _path(position: FloatArray) -> FloatArray:
    """Thin a path (T, 2), and leave out what cannot be drawn."""
    kept = position[:: max(1, math.ceil(len(position) / MOST_POINTS))]
    kept = np.concatenate((kept, position[-1:]))
    fine = np.asarray((np.abs(kept) < BEYOND).all(axis=1))
    return np.where(fine[:, None], kept, np.nan)


def draw_fixed(panel: Axes, scene: Scene) -> None:
    """Draw planes, walls, posts and fixed bodies; as artists they have no say in the limits."""
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
        for piece in pieces if len(pieces) > 1 else ():  # of what several make up, only the outer half of edges is seen
            inside = {"color": panel.get_facecolor(), "lw": 0.0, "zorder": SOLID["zorder"] + 0.01}
            panel.add_artist(Polygon(piece, **inside))


def outlines_of(bodies: Bodies, number: int) -> list[FloatArray]:
    """Return the outlines (K, 2) of a body's pieces as it starts, m."""
    shapes, angle = bodies.shapes, float(bodies.angle[number])
    cos, sin = math.cos(angle), math.sin(angle)
    turn = np.asarray(((cos, sin), (-sin, cos)))
    found = []
    for piece in np.flatnonzero(shapes.body == number).tolist():
        corners = shapes.corner[shapes.first[piece] : shapes.first[piece + 1]]
        found.append(bodies.position[number] + _widened(corners, float(shapes.radius[piece])) @ turn)
    return found


def _widened(corners: FloatArray, radius: float) -> FloatArray:
    """Return the outline of a hull that is widened by a radius, m."""
    if radius == 0.0:
        return corners
    if len(corners) == 1:
        spots = np.linspace(-math.pi, math.pi, 65)[None, :-1]
    else:
        way = np.roll(corners, -1, axis=0) - corners
        normal = np.arctan2(-way[:, 0], way[:, 1])
        before = np.roll(normal, 1)
        spots = before[:, None] + np.mod(normal - before, 2.0 * math.pi)[:, None] * np.linspace(0.0, 1.0, 25)
    around = corners[:, None] + radius * np.stack((np.cos(spots), np.sin(spots)), axis=-1)
    return np.asarray(around.reshape(-1, 2))
