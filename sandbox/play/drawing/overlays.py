"""Overlays: everything that is drawn about bodies besides their shapes, each part when it is asked for."""

import numpy as np

from sandbox.play.drawing.arrows import draw_contacts, draw_impulses, draw_velocities
from sandbox.play.drawing.discs import Discs
from sandbox.play.drawing.drives import draw_hinges, draw_stops
from sandbox.play.drawing.fittings import draw_fittings
from sandbox.play.drawing.flames import draw_flames
from sandbox.play.drawing.joints import draw_joints, held
from sandbox.play.drawing.marks import (
    draw_boxes,
    draw_centres,
    draw_flashes,
    draw_names,
    draw_picked,
    draw_pull,
    draw_verdicts,
)
from sandbox.play.drawing.palette import FAINT, INK, mixed
from sandbox.play.drawing.points import Points
from sandbox.play.drawing.polygons import Polygons
from sandbox.play.drawing.strokes import stroke
from sandbox.play.drawing.trails import draw_trails
from sandbox.play.drawing.view import View
from sandbox.play.sight import Sight

BODILY = frozenset({"velocities", "bounds", "centres", "names", "trails"})
"""Overlays that need to know which bodies are in sight."""
APART = 3.0
"""px between a body and its ghost from which a line joins them"""
MOST_GHOSTS = 4000


class Overlays:
    """Draws the overlays of a picture, what lies below the bodies and what lies above them."""

    def __init__(self, discs: Discs, points: Points, polygons: Polygons) -> None:
        self._discs = discs
        self._points = points
        self._polygons = polygons

    def need_bodies(self, sight: Sight) -> bool:
        """Tell whether the bodies in sight must be known, even those that are mere points."""
        return not BODILY.isdisjoint(sight.overlays) or sight.overlapping is not None

    def below(self, view: View) -> None:
        """Draw what bodies cover."""
        if "trails" in view.sight.overlays:
            draw_trails(view, self._points)
        if "shapes" in view.sight.overlays and view.sight.flames:
            draw_flames(view)
        if "shapes" in view.sight.overlays and len(view.sight.links):
            draw_joints(view, held(view), self._discs)

    def above(self, view: View) -> None:
        """Draw what covers bodies."""
        overlays, drives = view.sight.overlays, view.sight.scene.drives
        if drives and "shapes" in overlays:
            draw_hinges(view, self._discs)
        if view.sight.ghost is not None:
            self._ghost(view)
        if "bounds" in overlays:
            draw_boxes(view, self._polygons)
        if "joints" in overlays and len(view.sight.links):
            draw_fittings(view, held(view), self._discs)
        if drives and "joints" in overlays:
            draw_stops(view)
        if "centres" in overlays:
            draw_centres(view)
        if view.sight.overlapping is not None:
            draw_verdicts(view)
        if "velocities" in overlays:
            draw_velocities(view)
        if "impulses" in overlays:
            draw_impulses(view)
        if "contacts" in overlays:
            draw_contacts(view, self._discs)
        draw_flashes(view)
        draw_picked(view, self._discs, self._polygons)
        draw_pull(view, self._discs)
        if "names" in overlays:
            draw_names(view, self._polygons)

    def _ghost(self, view: View) -> None:
        """Draw the bodies of the other engine hollow, and join each to its own where they are apart."""
        ghost, frame, camera = view.sight.ghost, view.sight.frame, view.camera
        assert ghost is not None
        count = min(len(ghost.position), len(frame.position), len(view.sight.bodies))
        place, radius = ghost.position[:count], view.sight.bodies.radius[:count]
        with np.errstate(invalid="ignore", over="ignore"):
            there = camera.in_sight(place, radius) & ghost.present[:count]
        seen = np.flatnonzero(there & ~view.sight.bodies.fixed[:count])  # what never moves never differs
        if len(seen) > MOST_GHOSTS:
            seen = seen[np.linspace(0, len(seen) - 1, MOST_GHOSTS).astype(np.intp)]
        if not len(seen):
            return
        centre, own = camera.to_screen(place[seen]), camera.to_screen(frame.position[seen])
        tint = np.broadcast_to(np.asarray(INK, np.uint8), (len(seen), 3))
        style = view.style(1.5)._replace(hollow=True)
        size, bodies = radius[seen] * camera.scale, view.sight.bodies
        lone = bodies.round[seen] | (size < 2.0 * view.unit)
        self._discs.draw(view.surface, centre[lone], np.maximum(size[lone], 2.0 * view.unit), tint[lone], style)
        who, angle = seen[~lone], ghost.angle[seen[~lone]]
        self._polygons.draw(view.surface, bodies, who, centre[~lone], angle, camera.scale, tint[~lone], style)
        with np.errstate(invalid="ignore", over="ignore"):
            gap = np.hypot(*(centre - own).T)
        for k in np.flatnonzero((gap > APART * view.unit) & frame.present[seen]).tolist():
            (ax, ay), (bx, by) = own[k].tolist(), centre[k].tolist()
            stroke(view.surface, (ax, ay), (bx, by), mixed(FAINT, INK, 0.3), 1.0 * view.unit, view.antialias)
