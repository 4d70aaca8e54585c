"""Joints: those that are part of what one sees, rods, strings and springs, as thin lines below the bodies.

A spring's colour tells how far it is stretched: blue is short, grey at rest, orange long. Many of them, as those of a
cloth, are plain lines.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pygame

from sandbox.arrays import FloatArray, IntArray
from sandbox.play.drawing.discs import Discs, Style
from sandbox.play.drawing.palette import BACKGROUND, ORANGE, SKY, SURFACE, ColourArray, mixed
from sandbox.play.drawing.points import packed
from sandbox.play.drawing.strokes import Pixel, stroke
from sandbox.play.drawing.threads import draw_threads
from sandbox.play.drawing.view import View
from sandbox.scene.compile.joint_arrays import LinkKind, Links

COILED = 500
"""Springs up to which each is a zigzag."""
SOLID_RODS = 500
"""Rods up to which each is more than a thread wide."""
NAIL = 3.2
"""px, radius of what the world holds a joint by"""
ZIGS = 18
"""Half turns of a spring."""
SHORTEST = 20.0
"""px: a shorter spring is a line"""
STRAINED = 0.1
"""of its length at rest: a spring so much longer has half of its colour"""
_REST = mixed(BACKGROUND, SURFACE, 0.75)
ROD = mixed(BACKGROUND, SURFACE, 0.9)
STRING = mixed(BACKGROUND, SURFACE, 0.7)
SHADES = np.asarray(
    [mixed(_REST, SKY, (32 - k) / 32) if k < 32 else mixed(_REST, ORANGE, (k - 32) / 32) for k in range(65)], np.uint8
)
"""From shortest to longest."""


@dataclass(frozen=True, eq=False)
class Held:
    """The joints in sight, J of them, and where they hold their bodies."""

    links: Links
    ends: FloatArray
    """(J, 4) px: of the first body, or the world, and of the second"""

    def of(self, *kinds: LinkKind) -> "Held":
        """Return those of some kinds."""
        which = np.isin(self.links.kind, kinds)
        return Held(self.links.some(which), self.ends[which])

    @property
    def length(self) -> FloatArray:
        """(J,) px."""
        return np.asarray(np.hypot(self.ends[:, 2] - self.ends[:, 0], self.ends[:, 3] - self.ends[:, 1]))


def held(view: View) -> Held:
    """Return the joints that are whole and whose bodies are present, those about the picture."""
    links, frame = view.sight.links, view.sight.frame
    count = min(len(frame.position), len(view.sight.bodies))
    if not len(links):
        return Held(links, np.empty((0, 4)))
    there = frame.present[:count]
    known = (links.b < count) & (links.a < count)
    if not known.all():
        links = links.some(known)
    sound = there[links.b] & ((links.a < 0) | there[links.a])
    with np.errstate(invalid="ignore", over="ignore"):
        a, b = links.ends(frame.position, frame.angle)
        ends = np.hstack((view.camera.to_screen(a), view.camera.to_screen(b)))
        width, height = view.camera.size
        margin = 100.0 * view.unit
        low, high = np.minimum(ends[:, :2], ends[:, 2:]), np.maximum(ends[:, :2], ends[:, 2:])
        sound &= (high > -margin).all(axis=1) & (low < (width + margin, height + margin)).all(axis=1)
        sound &= np.isfinite(ends).all(axis=1)
    return Held(links if sound.all() else links.some(sound), ends[sound])


def draw_joints(view: View, joints: Held, discs: Discs) -> None:
    """Draw rods, strings and springs, and where the world holds them."""
    fast = joints.of(LinkKind.ROD, LinkKind.SLIDE, LinkKind.SPRING)
    nails = fast.ends[fast.links.a < 0, :2]
    tint = np.broadcast_to(np.asarray(SURFACE, np.uint8), (len(nails), 3))
    size = np.full(len(nails), (NAIL if len(nails) <= SOLID_RODS else 0.5 * NAIL) * view.unit)
    discs.draw(view.surface, nails, size, tint, Style(0.0, antialias=view.antialias))
    _rods(view, joints.of(LinkKind.ROD), ROD, 2.4)
    _rods(view, joints.of(LinkKind.SLIDE), STRING, 1.4)
    springs = joints.of(LinkKind.SPRING)
    if not len(springs.links):
        return
    shade = strain(springs, view.camera.scale)
    if len(springs.links) > COILED:
        draw_threads(view.surface, springs.ends, packed(SHADES[shade], view.surface), view.antialias)
        return
    rest = springs.links.figures[:, 0] * view.camera.scale
    for k, row in enumerate(springs.ends.tolist()):
        red, green, blue = SHADES[shade[k]].tolist()
        _coil(view, (row[0], row[1]), (row[2], row[3]), float(rest[k]), (red, green, blue))


def strain(springs: Held, scale: float) -> IntArray:
    """Return which of `SHADES` tells how far each spring is stretched, (J,)."""
    rest = springs.links.figures[:, 0] * scale
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        stretch = np.where(rest > 0.0, springs.length / rest - 1.0, 1.0)
        share = stretch / (np.abs(stretch) + STRAINED)
    return np.rint(32.0 + 32.0 * np.nan_to_num(share, nan=1.0)).astype(np.int64)


def _rods(view: View, rods: Held, colour: tuple[int, int, int], width: float) -> None:
    if len(rods.links) > SOLID_RODS:
        tones: ColourArray = np.broadcast_to(np.asarray(colour, np.uint8), (len(rods.links), 3))
        draw_threads(view.surface, rods.ends, packed(tones, view.surface), view.antialias)
        return
    for ax, ay, bx, by in rods.ends.tolist():
        stroke(view.surface, (ax, ay), (bx, by), colour, width * view.unit, view.antialias)


def _coil(view: View, a: Pixel, b: Pixel, rest: float, colour: tuple[int, int, int]) -> None:
    """Draw a spring: the wire of its zigzag is as long as ever, so its pitch widens and its width shrinks."""
    length, unit = float(np.hypot(b[0] - a[0], b[1] - a[1])), view.unit
    reach = 4.0 * max(view.camera.size)
    far = max(map(abs, (*a, *b))) > reach
    if not SHORTEST * unit <= length or far:
        stroke(view.surface, a, b, colour, 1.4 * unit, view.antialias)
        return
    ux, uy = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    lead = min(0.1 * length, 14.0 * unit)
    pitch = (length - 2.0 * lead) / ZIGS
    widest = min(max(0.09 * rest, 3.0 * unit), 9.0 * unit)
    wire = np.hypot(2.0 * widest, 0.8 * rest / ZIGS)
    width = min(max(0.5 * float(np.sqrt(max(wire**2 - pitch**2, 0.0))), 0.35 * widest), 1.3 * widest)
    spots = [a]
    for k in range(ZIGS + 1):
        along, side = lead + pitch * k, 0.0 if k in (0, ZIGS) else width if k % 2 else -width
        spots.append((a[0] + ux * along - uy * side, a[1] + uy * along + ux * side))
    spots.append(b)
    if view.antialias:
        for shift in (-0.75, -0.25) if unit < 1.5 else (-1.0, -0.5, 0.0):
            pygame.draw.aalines(view.surface, colour, False, [(x + shift, y + shift) for x, y in spots])
        return
    for p, q in pairwise(spots):
        stroke(view.surface, p, q, colour, 1.5 * unit, antialias=False)
