"""Picture: one moment of a scene, drawn. It touches only what is in sight, and keeps what does not change."""

from typing import NamedTuple

import numpy as np
import pygame

from sandbox.arrays import BoolArray, IntArray
from sandbox.games.artillery.terrain import Artillery
from sandbox.play.camera import Camera
from sandbox.play.drawing.ageing import Ageing
from sandbox.play.drawing.artillery.fire import draw_above, draw_below
from sandbox.play.drawing.artillery.guns import draw_guns
from sandbox.play.drawing.artillery.land import draw_land
from sandbox.play.drawing.decks import Decks, layers_among, on_layer
from sandbox.play.drawing.discs import Discs, spokes
from sandbox.play.drawing.fixtures import draw_bounds, draw_fixtures
from sandbox.play.drawing.grid import draw_grid, draw_scale
from sandbox.play.drawing.lamps import Lamps, draw_lamps
from sandbox.play.drawing.markings import draw_markings
from sandbox.play.drawing.overlays import Overlays
from sandbox.play.drawing.palette import BACKGROUND, CLEAR, TOUCHING, ColourArray, colour_of
from sandbox.play.drawing.playfield import draw_playfield
from sandbox.play.drawing.points import LARGEST, Packed, Points, packed
from sandbox.play.drawing.polygons import Polygons
from sandbox.play.drawing.pucks import draw_pucks
from sandbox.play.drawing.table.aiming import draw_aim, draw_ways
from sandbox.play.drawing.table.balls import Balls
from sandbox.play.drawing.table.cloth import draw_table
from sandbox.play.drawing.view import View
from sandbox.play.drawing.zones import draw_zones
from sandbox.play.sight import Sight
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.description.game_tables import table_of
from sandbox.scene.scene import Scene

POINT = 1.2
"""px, the radius below which a ball is a point"""
CROWD = 20_000
"""Bodies, of which many are points."""
ROUNDISH = 0.9
"""Share of its radius that the disc within a body has at least, if only a spoke shows how it has turned."""


class Kept(NamedTuple):
    """What a background was drawn for; `scene` is compared by identity."""

    scene: Scene
    camera: Camera
    bounds: bool
    antialias: bool
    unit: float
    format: tuple[object, ...]


class Sizes(NamedTuple):
    """Which bodies are points at a scale; N of them."""

    bodies: Bodies
    scale: float
    unit: float
    tiny: BoolArray
    """(N,)"""
    all_tiny: bool
    large: IntArray
    """numbers of those that are discs"""
    side: int
    """px, of a point: about the diameter of the median of them; 0 where there is none"""


class Picture:
    """Draws pictures of scenes. One of them serves a window for its whole life; its caches are bounded."""

    def __init__(self) -> None:
        self._discs = Discs()
        self._points = Points()
        self._polygons = Polygons()
        self._balls = Balls()
        self._decks = Decks()
        self._lamps = Lamps()
        self._overlays = Overlays(self._discs, self._points, self._polygons)
        self._background: tuple[Kept, pygame.Surface] | None = None
        self._sizes: Sizes | None = None
        self._known: tuple[Bodies, Scene] | None = None
        self._colours: ColourArray = np.empty((0, 3), np.uint8)
        self._turning: BoolArray = np.empty(0, np.bool_)
        self._tones: tuple[ColourArray, tuple[object, ...], Packed] | None = None
        self._ageing: Ageing | None = None

    def draw(
        self,
        surface: pygame.Surface,
        camera: Camera,
        sight: Sight,
        *,
        antialias: bool = True,
        unit: float = 1.0,
        foot: float = 0.0,
        scale: bool = True,
    ) -> None:
        """Draw one moment over the whole of a surface.

        Args:
            surface: of any format; `camera.size` is its size.
            camera: what it shows.
            sight: the moment. Bodies at nan or inf, and those not present, are left out.
            antialias: whether edges are smooth; without, it takes about half the time.
            unit: px, of a line that is one pixel wide on a 1080p display; all widths and letters grow with it.
            foot: px at the lower edge that something else will cover.
            scale: draw the bar that tells how long things are.
        """
        self._blit_background(surface, camera, sight, antialias, unit)
        if sight.lit:
            self._lamps.draw(surface, camera, sight.scene, sight.lit)
        self._know(sight)
        sizes = self._sized(sight.bodies, camera.scale, unit)
        colours, ageing = self._colours, self._ageing
        if sight.overlapping is not None:
            colours, ageing = _by_contact(sight.overlapping, len(sight.bodies)), None
        if "shapes" in sight.overlays and sizes.side:
            self._draw_points(surface, camera, sight, sizes, colours, ageing)

        shown = _in_sight(camera, sight, None if self._overlays.need_bodies(sight) else sizes.large)
        tint = colours[shown] if ageing is None else ageing.over(colours[shown], shown, sight.frame.time)
        view = View(
            surface=surface,
            camera=camera,
            sight=sight,
            unit=unit,
            antialias=antialias,
            shown=shown,
            centre=camera.to_screen(sight.frame.position[shown]),
            radius=sight.bodies.radius[shown] * camera.scale,
            colours=tint,
        )
        self._overlays.below(view)
        if sight.aim is not None:
            draw_ways(view, sight.aim, self._colours)
        if sight.gunnery is not None:
            draw_below(view, sight.gunnery)
        if "shapes" in sight.overlays and sight.scene.surface is not None and not sizes.side:
            if sight.scene.surface.bodies == "pucks" and sight.bodies.round.all():
                draw_pucks(view, self._discs)
            else:
                self._balls.draw(view)
        elif "shapes" in sight.overlays:
            own = _drawn_otherwise(sight)
            large = np.flatnonzero(~sizes.tiny[shown]) if sizes.side else None
            if len(own):
                others = np.flatnonzero(~np.isin(shown, own))
                large = others if large is None else np.intersect1d(large, others)
            self._draw_layers(view, large)
            if sight.gunnery is not None:
                draw_guns(view, sight.gunnery, {n: tuple(self._colours[n].tolist()) for n in own.tolist()})
        self._overlays.above(view)
        if sight.aim is not None:
            draw_aim(view, sight.aim)
        if sight.gunnery is not None:
            draw_above(view, sight.gunnery)
        if scale:
            draw_scale(surface, camera, unit, foot)

    def _draw_layers(self, view: View, which: IntArray | None) -> None:
        """Draw the bodies that are no points, from the ground up, with what is fixed on each layer above it."""
        scene = view.sight.scene
        if len(scene.layers) == 1:
            self._draw_bodies(view, which)
            return
        which = np.arange(len(view.shown)) if which is None else which
        layer = layers_among(view.sight.frame, view.shown[which])
        for k in range(len(scene.layers)):
            if k > 0:
                self._decks.draw(view.surface, view.camera, scene, k, view.unit, view.antialias)
            self._draw_bodies(view, which[layer == k])

    def _draw_bodies(self, view: View, which: IntArray | None) -> None:
        """Draw the bodies that are no points: all, or those at some places of the view."""
        centre, radius, colours, shown = view.centre, view.radius, view.colours, view.shown
        if which is not None:
            centre, radius, colours, shown = centre[which], radius[which], colours[which], shown[which]
        bodies, frame = view.sight.bodies, view.sight.frame
        turning, lone = self._turning[shown], bodies.round[shown]
        if lone.all():
            self._discs.draw(view.surface, centre, radius, colours, view.style())
        else:
            those, angle = shown[~lone], frame.angle[shown[~lone]]
            self._polygons.draw(
                view.surface, bodies, those, centre[~lone], angle, view.camera.scale, colours[~lone], view.style()
            )
            self._discs.draw(view.surface, centre[lone], radius[lone], colours[lone], view.style())
            turning &= lone | (bodies.core[shown] > ROUNDISH * bodies.radius[shown])
            radius = bodies.core[shown] * view.camera.scale
        if not turning.all():
            centre, radius, colours, shown = centre[turning], radius[turning], colours[turning], shown[turning]
        if len(shown):
            spokes(view.surface, centre, radius, frame.angle[shown], colours, view.antialias)

    def _draw_points(
        self,
        surface: pygame.Surface,
        camera: Camera,
        sight: Sight,
        sizes: "Sizes",
        colours: ColourArray,
        ageing: Ageing | None,
    ) -> None:
        """Draw the bodies that are too small for discs, those who fade as they do at their ages."""
        form = (surface.get_masks(), surface.get_bytesize())
        if self._tones is None or self._tones[0] is not colours or self._tones[1] != form:
            self._tones = colours, form, packed(colours, surface)
        if ageing is not None:
            ageing.fade(self._tones[2], packed(ageing.shades, surface), sight.frame.time)
        frame = sight.frame
        count = min(len(frame.position), len(colours))
        who = None if sizes.all_tiny and frame.present.all() else frame.present[:count] & sizes.tiny[:count]
        self._points.draw(surface, camera, frame.position[:count], self._tones[2], who, sizes.side)

    def _sized(self, bodies: Bodies, scale: float, unit: float) -> "Sizes":
        """Return who is drawn how at a scale; it is worked out when that changes."""
        known = self._sizes
        if known is None or known.bodies is not bodies or known.scale != scale or known.unit != unit:
            tiny = bodies.radius * scale < POINT * max(unit, 1.0)
            side = 0
            if tiny.any():
                diameter = 2.0 * float(np.median(bodies.radius[tiny])) * scale
                # Of a crowd one sees the gaps rather than the points: they are drawn no larger than they are.
                side = int(diameter) if len(tiny) > CROWD else round(diameter)
                side = min(max(side, round(unit), 1), LARGEST)
            self._sizes = known = Sizes(bodies, scale, unit, tiny, bool(tiny.all()), np.flatnonzero(~tiny), side)
        return known

    def _know(self, sight: Sight) -> None:
        """Work out what holds for bodies as long as they stay the same: their colours, and who can turn."""
        bodies, scene = sight.bodies, sight.scene
        if self._known is not None and self._known[0] is bodies and self._known[1] is scene:
            return
        self._known, self._colours = (bodies, scene), colour_of(bodies)
        ageing = Ageing(bodies)
        self._ageing = ageing if len(ageing) else None
        turned = (bodies.angle != 0.0) | (bodies.angular_velocity != 0.0)
        self._turning = turned | contact_matrix(sight.setup or scene, bodies).turnable

    def _blit_background(
        self, surface: pygame.Surface, camera: Camera, sight: Sight, antialias: bool, unit: float
    ) -> None:
        form = (surface.get_size(), surface.get_masks(), surface.get_bytesize())
        wanted = Kept(sight.scene, camera, "bounds" in sight.overlays, antialias, unit, form)
        known = self._background
        if known is None or known[0].scene is not wanted.scene or known[0][1:] != wanted[1:]:
            drawn = pygame.Surface(surface.get_size(), 0, surface)
            drawn.fill(BACKGROUND)
            area = sight.scene.play.area
            if sight.scene.play.ground == "playfield":
                draw_playfield(drawn, camera, sight.scene, unit, antialias)
            elif table_of(sight.scene, Artillery) is not None:
                draw_land(drawn, camera, sight.scene, unit, antialias)
            elif area is None:
                draw_grid(drawn, camera, unit)
                draw_markings(drawn, camera, sight.scene, unit, antialias)
                draw_lamps(drawn, camera, sight.scene, unit, antialias)
                draw_zones(drawn, camera, sight.scene, unit, antialias)
                ground = sight.scene if len(sight.scene.layers) == 1 else on_layer(sight.scene, 0)
                draw_fixtures(drawn, camera, ground, unit, antialias)
            else:
                draw_table(drawn, camera, sight.scene, area, unit, antialias)
            if wanted.bounds:
                draw_bounds(drawn, camera, sight.scene.world.bounds, unit, antialias)
            self._background = known = (wanted, drawn)
        surface.blit(known[1], (0, 0))


def _in_sight(camera: Camera, sight: Sight, among: IntArray | None) -> IntArray:
    """Return the numbers of the bodies that are present and at least partly in the picture."""
    frame = sight.frame
    count = min(len(frame.position), len(sight.bodies))
    position, radius, present = frame.position[:count], sight.bodies.radius[:count], frame.present[:count]
    if among is not None and len(among) < count:
        among = among[among < count]
        position, radius, present = position[among], radius[among], present[among]
    else:
        among = None
    with np.errstate(invalid="ignore", over="ignore"):  # what is far out of sight may overflow, or be nan
        seen = np.flatnonzero(camera.in_sight(position, radius) & present)
    return seen if among is None else among[seen]


def _drawn_otherwise(sight: Sight) -> IntArray:
    """Return the numbers of the bodies that are more than their shapes: tanks."""
    return np.asarray([] if sight.gunnery is None else [gun.number for gun in sight.gunnery.guns], np.int64)


def _by_contact(overlapping: BoolArray, count: int) -> ColourArray:
    """Return the colours of a scene that shows contact by colour."""
    touching = np.zeros(count, np.bool_)
    touching[: len(overlapping)] = overlapping[:count]
    return np.where(touching[:, None], np.asarray(TOUCHING, np.uint8), np.asarray(CLEAR, np.uint8))
