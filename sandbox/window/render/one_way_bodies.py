"""One-way bodies: small arrows on the side from which they are solid, in the direction in which others pass them."""

import math

import numpy as np

from sandbox.scene.geometry.vectors import rotate
from sandbox.window.render.draw_context import DrawContext
from sandbox.window.render.palette import INK, SURFACE, mix_colours
from sandbox.window.render.static_geometry import draw_passing_arrows


def draw_one_way_bodies(view: DrawContext) -> None:
    """Draw the arrows of all visible one-way bodies."""
    frame, bodies = view.snapshot.frame, view.snapshot.bodies
    shown = {*view.shown.tolist()} if bodies.one_way else set()
    for index, (x, y) in bodies.one_way.items():
        if index not in shown:
            continue
        begin, end = np.searchsorted(bodies.shapes.body, (index, index + 1)).tolist()
        corner = bodies.shapes.corner[bodies.shapes.first[begin] : bodies.shapes.first[end]]
        radius = np.repeat(bodies.shapes.radius[begin:end], bodies.shapes.corners[begin:end])
        top, along = float((corner @ (x, y) + radius).max()), corner @ (y, -x)
        angle, position = float(frame.angle[index]), frame.position[index].tolist()
        ends = []
        for side in (float((along - radius).min()), float((along + radius).max())):
            dx, dy = rotate(side * y + top * x, -side * x + top * y, math.cos(angle), math.sin(angle))
            ends.append((position[0] + dx, position[1] + dy))
        a, b = view.pixels(ends)
        draw_passing_arrows(view, a, b, 0.0, mix_colours(SURFACE, INK, 0.6))
