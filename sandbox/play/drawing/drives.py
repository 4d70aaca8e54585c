"""Drives: the hinges of what they turn, and in the overlay of joints, how far they let their bodies go."""

import math
from collections.abc import Iterator

import numpy as np

from sandbox.play.drawing.discs import Discs, Style
from sandbox.play.drawing.fittings import arc, path, spot
from sandbox.play.drawing.palette import BACKGROUND, INK, ORANGE, SKY, Colour, mixed
from sandbox.play.drawing.strokes import Pixel
from sandbox.play.drawing.view import View
from sandbox.scene.compile.drives import Mount, mounts
from sandbox.scene.description.forces import PlungerDrive

PIN = 4.0
"""px, radius of a hinge"""
SHARE = 0.45
"""of the largest disc in its body that a hinge covers at most"""
SMALL, LARGE = 14.0, 90.0
"""px: radii of the arcs of what turns"""
BEYOND = 1.0
"""of the largest disc in a body, so far beyond its centre its arc is"""


def draw_hinges(view: View, discs: Discs) -> None:
    """Draw the hinges on which drives turn bodies, where those are in sight."""
    bodies = view.sight.bodies
    for mount, number, place in _seen(view):
        if not isinstance(mount.drive, PlungerDrive):
            size = min(PIN * view.unit, SHARE * float(bodies.core[number]) * view.camera.scale)
            for share, colour in ((1.0, BACKGROUND), (0.55, mixed(BACKGROUND, INK, 0.85))):
                tint = np.asarray([colour], np.uint8)
                style = Style(0.0, antialias=view.antialias)
                discs.draw(view.surface, np.asarray([place]), np.asarray([share * size]), tint, style)


def draw_stops(view: View) -> None:
    """Draw the stops of drives, the way between them, and on it a hand where the body is."""
    frame = view.sight.frame
    for mount, number, place in _seen(view):
        level = 0.0 if frame.drives is None else float(frame.drives[mount.number, 0])
        colour = mixed(SKY, ORANGE, level)
        drive = mount.drive
        if isinstance(drive, PlungerDrive):
            _slide(view, drive, place, frame.position[number].tolist(), mount.home, colour)
            continue
        (x, y), (rest, end) = mount.hinge, drive.stops
        own = math.atan2(-y, -x) if x or y else 0.0  # of the arm from the hinge to the body's centre
        length = (math.hypot(x, y) + BEYOND * float(view.sight.bodies.core[number])) * view.camera.scale
        size = min(max(length, SMALL * view.unit), LARGE * view.unit)
        arc(view, place, size, own + rest, max(min(end - rest, math.tau), -math.tau), INK, 1.4)
        for stop in (rest, end):
            path(view, [spot(place, 0.92 * size, own + stop), spot(place, 1.08 * size, own + stop)], INK, 1.4)
        turned = own + float(frame.angle[number])
        path(view, [spot(place, 0.25 * size, turned), spot(place, 1.04 * size, turned)], colour, 2.0)


def _slide(
    view: View, drive: PlungerDrive, place: Pixel, now: list[float], home: tuple[float, float], colour: Colour
) -> None:
    """Draw the line along which a plunger is drawn, across its ends a tick, and how far it is."""
    length = math.hypot(*drive.direction)
    ux, uy = drive.direction[0] / length, -drive.direction[1] / length  # the screen's y is down
    far = drive.travel * view.camera.scale
    pulled = math.dist(now, home) * view.camera.scale
    tick = 5.0 * view.unit
    back = place[0] - far * ux, place[1] - far * uy
    path(view, [place, back], INK, 1.6)
    for (x, y), tone in ((place, INK), (back, INK), ((place[0] - pulled * ux, place[1] - pulled * uy), colour)):
        path(view, [(x - tick * uy, y + tick * ux), (x + tick * uy, y - tick * ux)], tone, 2.2)


def _seen(view: View) -> Iterator[tuple[Mount, int, Pixel]]:
    """Yield how each driven body in sight is held, its number, and where its hinge or its stop is, px."""
    names = view.sight.bodies.names
    numbers = {names[number]: number for number in view.shown.tolist()}
    for name, mount in mounts(view.sight.scene).items():
        if name in numbers:
            drive = mount.drive
            seat = mount.home if isinstance(drive, PlungerDrive) else drive.pivot
            x, y = view.camera.to_screen(np.asarray(seat)).tolist()
            yield mount, numbers[name], (x, y)
