"""Arrows: velocities, contacts with their normals, and impulses as mean forces."""

import math

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.play.drawing.discs import Discs, Style
from sandbox.play.drawing.palette import BACKGROUND, INK, ORANGE, SKY, YELLOW, Colour, mixed
from sandbox.play.drawing.strokes import arrow, stroke
from sandbox.play.drawing.text import write
from sandbox.play.drawing.touches import touches
from sandbox.play.drawing.view import View

MOST = 1000
"""Arrows of one kind; of more bodies or contacts, so many of them spread over all, or of forces the strongest"""
CROWD = 300
"""Contacts from which their marks become smaller, and arrows are drawn without a dark edge."""
SPAN = 0.1
"""s: an arrow reaches to where its body would be after so long"""
NORMAL = 16.0
"""px, of a contact's normal"""
WEIGHT = 26.0
"""px, of a force of one weight m·g"""
LARGEST = 80.0
"""px, of the largest force where weights would make it longer"""
_COOL = mixed(BACKGROUND, SKY, 0.8)
HEAT: tuple[Colour, ...] = tuple(
    mixed(_COOL, YELLOW, k / 16) if k < 16 else mixed(YELLOW, (255, 255, 255), k / 16 - 1.0) for k in range(33)
)
"""For a line's length, in 32nds of the largest: from blue through yellow to white."""
LABELS = 12
"""Up to so many forces are told in newtons."""


def draw_velocities(view: View) -> None:
    """Draw v · 0.1 s as arrows; one longer than a third of the picture is cut to that."""
    some = view.first(MOST)
    longest = max(min(view.camera.size) / 3.0, 1.0)
    with np.errstate(invalid="ignore", over="ignore"):
        way = view.camera.ways(view.sight.frame.velocity[some.shown] * SPAN)
        length = np.hypot(way[:, 0], way[:, 1])
        way = way * np.minimum(1.0, longest / np.maximum(length, 1e-300))[:, None]
    for k in np.flatnonzero((length > 2.0 * view.unit) & np.isfinite(length)).tolist():
        (x, y), (dx, dy) = some.centre[k].tolist(), way[k].tolist()
        edge = BACKGROUND if len(some.shown) <= CROWD and length[k] > 16.0 * view.unit else None
        arrow(view.surface, (x, y), (x + dx, y + dy), ORANGE, 2.0 * view.unit, view.antialias, edge)


def _in_sight(view: View, most: int) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return which contacts are in sight, (K,), where, (K, 2) px, and their normals there, (K, 2)."""
    place, normal = touches(view)
    with np.errstate(invalid="ignore", over="ignore"):
        pixels = view.camera.to_screen(place)
    seen = view.inside(pixels, 20.0 * view.unit)
    if len(seen) > most:
        seen = seen[np.linspace(0, len(seen) - 1, most).astype(np.intp)]
    return seen, pixels[seen], view.camera.ways(normal[seen]) / view.camera.scale


def draw_contacts(view: View, discs: Discs) -> None:
    """Draw where bodies touch, and the normal from the first to the second."""
    seen, place, normal = _in_sight(view, MOST)
    if not len(seen):
        return
    crowded = len(seen) > CROWD
    reach = (0.5 if crowded else 1.0) * NORMAL * view.unit
    for (x, y), (nx, ny) in zip(place.tolist(), normal.tolist(), strict=True):
        stroke(view.surface, (x, y), (x + nx * reach, y + ny * reach), INK, 1.0 * view.unit, view.antialias)
    tint = np.broadcast_to(np.asarray(ORANGE, np.uint8), (len(seen), 3))
    size = np.full(len(seen), (1.8 if crowded else 3.0) * view.unit)
    discs.draw(view.surface, place, size, tint, Style(0.0, antialias=view.antialias))


def draw_impulses(view: View) -> None:
    """Draw mean forces, |impulse| / seconds, as lines along the normal, half to each side of the contact.

    A force of one weight of the lighter body has a fixed length; where the largest in sight would become too long by
    that, or there is no gravity, it is that one which has.
    """
    seen, place, normal = _in_sight(view, 4 * MOST)
    if not len(seen) or not view.sight.seconds > 0.0:
        return
    contacts, gravity = view.sight.contacts, math.hypot(*view.sight.scene.world.gravity)
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        force = np.hypot(*contacts.impulse[seen].T) / view.sight.seconds
        force[~np.isfinite(force)] = 0.0
        share = force / max(float(force.max()), 1e-300)
        weights = (
            force / (_lighter(view, contacts.pair[seen]) * gravity) if gravity > 0.0 else np.full_like(force, np.inf)
        )
        length = np.minimum(WEIGHT * float(np.max(weights)), LARGEST) * share * view.unit
    drawn = np.flatnonzero(length > 1.0)
    drawn = drawn[np.argsort(force[drawn], kind="stable")][-MOST:]  # the strongest last: they are looked for
    for k in drawn.tolist():
        (x, y), (nx, ny), half = place[k].tolist(), normal[k].tolist(), float(length[k]) / 2.0
        ends = (x - nx * half, y - ny * half), (x + nx * half, y + ny * half)
        strength = min(2.0 * half / (LARGEST * view.unit), 1.0)
        width = (1.0 + 2.6 * strength) * view.unit
        stroke(view.surface, *ends, HEAT[int(32.0 * strength)], width, view.antialias)
        if len(drawn) <= LABELS:
            text, (right, down) = f"{float(force[k]):.3g} N", (10.0 * view.unit, 12.0 * view.unit)
            write(view.surface, text, (x + right + 1, y + down + 1), 12 * view.unit, BACKGROUND, "midleft", mono=True)
            write(view.surface, text, (x + right, y + down), 12 * view.unit, INK, "midleft", mono=True)


def _lighter(view: View, pair: IntArray) -> FloatArray:
    """Return the mass of the lighter of two that can move, kg, (K,)."""
    bodies = view.sight.bodies
    mass = np.append(np.where(bodies.fixed, np.inf, bodies.mass), np.inf)  # the last stands for all fixed things
    sides = np.where((pair >= 0) & (pair < len(bodies)), pair, len(bodies))
    lighter = np.min(mass[sides], axis=1, initial=np.inf)
    return np.asarray(np.where(np.isfinite(lighter), lighter, 1.0))
