"""Renderer of a scene snapshot, of the inset that magnifies part of it in a corner, and of frames as arrays.

Only visible bodies are drawn. Static content is cached until the scene or the camera changes.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pygame

from sandbox.action import Throttle
from sandbox.arrays import BoolArray, IntArray
from sandbox.game_names import GAMES, game_specs, spec_of
from sandbox.game_spec import GameSpec, import_part
from sandbox.games.contract import HasLamps, HasViewState, Rules
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.trajectory import Frame
from sandbox.window.camera import Camera, ViewBox
from sandbox.window.playback.snapshot import Snapshot, active_thrusters
from sandbox.window.render.accents import AccentNumbers
from sandbox.window.render.circles import CircleRenderer, draw_rotation_marks
from sandbox.window.render.draw_context import Canvas, DrawContext, GameView
from sandbox.window.render.grid import draw_grid, draw_scale
from sandbox.window.render.lamps import LampRenderer, draw_lamps
from sandbox.window.render.overlays import OverlayRenderer
from sandbox.window.render.palette import BACKGROUND, CLEAR, INK, SKY, TOUCHING, ColourArray, colour_of, mix_colours
from sandbox.window.render.particles import MAX_POINT_SIZE, LifetimeColours, Packed, ParticleRenderer, packed_pixels
from sandbox.window.render.polygons import PolygonRenderer
from sandbox.window.render.sensors import SensorRenderer
from sandbox.window.render.static_geometry import (
    LayerRenderer,
    draw_attractions,
    draw_bounds,
    draw_markings,
    draw_static_bodies,
    draw_zones,
    layers_among,
    on_layer,
)
from sandbox.window.view_bounds import view_bounds

MAX_POINT_RADIUS = 1.2
"""px, radius below which a ball is drawn as a point"""
CROWD_COUNT = 20_000
"""Number of bodies above which the size of points is rounded down."""
MIN_ROUNDNESS = 0.9
"""Ratio of inscribed to bounding radius above which a non-circular body gets a rotation mark."""


class CachedBackground(NamedTuple):
    """Cache key of a background; `scene` is compared by identity."""

    scene: Scene
    camera: Camera
    bounds: bool
    antialias: bool
    ui_scale: float
    format: tuple[object, ...]


class BodySizes(NamedTuple):
    """Classification of N bodies as points or discs at a scale."""

    bodies: Bodies
    scale: float
    ui_scale: float
    tiny: BoolArray
    """(N,) whether a body is drawn as a point"""
    all_tiny: bool
    large: IntArray
    """indices of the bodies that are not points"""
    side: int
    """px, side of a point: about the median diameter of the points; 0 if there are none"""


class Renderer:
    """Draws snapshots of scenes. One renderer serves a window for its whole life; its caches are bounded.

    Args:
        accents: of the elements, if they are to stay while the scene is edited; by default those of their order.
    """

    def __init__(self, accents: AccentNumbers | None = None) -> None:
        self._accents = accents
        self._discs = CircleRenderer()
        self._points = ParticleRenderer()
        self._polygons = PolygonRenderer()
        self._layers = LayerRenderer()
        self._lamps = LampRenderer()
        self._sensors = SensorRenderer()
        self._games = GameViews()
        self._overlays = OverlayRenderer(self._discs, self._points, self._polygons)
        self._background: tuple[CachedBackground, pygame.Surface] | None = None
        self._sizes: BodySizes | None = None
        self._known: tuple[Bodies, Scene] | None = None
        self._colours: ColourArray = np.empty((0, 3), np.uint8)
        self._can_rotate: BoolArray = np.empty(0, np.bool_)
        self._tones: tuple[ColourArray, tuple[object, ...], Packed] | None = None
        self._ageing: LifetimeColours | None = None

    def draw(
        self,
        surface: pygame.Surface,
        camera: Camera,
        snapshot: Snapshot,
        *,
        antialias: bool = True,
        ui_scale: float = 1.0,
        foot: float = 0.0,
        scale: bool = True,
        hud: bool = True,
    ) -> None:
        """Draw a snapshot over the whole surface.

        Args:
            surface: of any format and of size `camera.size`.
            camera: the view.
            snapshot: the snapshot. Bodies at nan or inf, and absent bodies, are skipped.
            antialias: whether edges are smooth; without it, drawing takes about half the time.
            ui_scale: px, width of a line that is one pixel wide on a 1080p display; line widths and text scale with it.
            foot: px at the lower edge that will be covered.
            scale: whether to draw the scale bar.
            hud: whether the view of a game may draw its HUD.
        """
        canvas = Canvas(surface, camera, ui_scale, antialias)
        self._blit_background(canvas, snapshot)
        if snapshot.lit:
            self._lamps.draw(canvas, snapshot.scene, snapshot.lit)
        self._update_bodies(snapshot)
        sizes = self._body_sizes(snapshot.bodies, camera.scale, ui_scale)
        colours, ageing = self._colours, self._ageing
        if snapshot.overlapping is not None:
            colours, ageing = _contact_colours(snapshot.overlapping, len(snapshot.bodies)), None
        if "shapes" in snapshot.overlays and sizes.side:
            self._draw_points(canvas, snapshot, sizes, colours, ageing)

        shown = _visible_bodies(camera, snapshot, None if self._overlays.need_bodies(snapshot) else sizes.large)
        tint = colours[shown] if ageing is None else ageing.over(colours[shown], shown, snapshot.frame.time)
        view = DrawContext(
            surface=surface,
            camera=camera,
            snapshot=snapshot,
            ui_scale=ui_scale,
            antialias=antialias,
            shown=shown,
            centre=camera.to_screen(snapshot.frame.position[shown]),
            radius=snapshot.bodies.radius[shown] * camera.scale,
            colours=tint,
            body_colours=self._colours,
            has_points=sizes.side > 0,
        )
        game = self._games.view_of(snapshot.scene)
        self._sensors.draw(canvas, snapshot)
        self._overlays.below(view)
        if game is not None:
            game.below(view)
        if "shapes" in snapshot.overlays:
            drawn = np.empty(0, np.int64) if game is None else game.bodies(view)
            which = np.flatnonzero(~sizes.tiny[shown]) if sizes.side else None
            if len(drawn):
                others = np.flatnonzero(~np.isin(shown, drawn))
                which = others if which is None else np.intersect1d(which, others)
            if which is None or len(which):
                self._draw_layers(view, which)
        self._overlays.above(view)
        if game is not None:
            game.above(view)
        if scale:
            draw_scale(canvas, foot)
        if hud and game is not None and hasattr(game, "hud"):
            game.hud(view)

    def _draw_layers(self, view: DrawContext, which: IntArray | None) -> None:
        """Draw the bodies that are not points, from the lowest layer up; a raised layer is drawn before its bodies."""
        scene = view.snapshot.scene
        if len(scene.layers) == 1:
            self._draw_bodies(view, which)
            return
        which = np.arange(len(view.shown)) if which is None else which
        layer = layers_among(view.snapshot.frame, view.shown[which])
        for k in range(len(scene.layers)):
            if k > 0:
                self._layers.draw(view, scene, k)
            self._draw_bodies(view, which[layer == k])

    def _draw_bodies(self, view: DrawContext, which: IntArray | None) -> None:
        """Draw the bodies that are not points: all visible ones, or those at the given rows of the view."""
        centre, radius, colours, shown = view.centre, view.radius, view.colours, view.shown
        if which is not None:
            centre, radius, colours, shown = centre[which], radius[which], colours[which], shown[which]
        bodies, frame = view.snapshot.bodies, view.snapshot.frame
        can_rotate, is_disc = self._can_rotate[shown], bodies.round[shown]
        if is_disc.all():
            self._discs.draw(view.surface, centre, radius, colours, view.style())
        else:
            indices, angle = shown[~is_disc], frame.angle[shown[~is_disc]]
            self._polygons.draw(
                view.surface,
                bodies,
                indices,
                centre[~is_disc],
                angle,
                view.camera.scale,
                colours[~is_disc],
                view.style(),
            )
            self._discs.draw(view.surface, centre[is_disc], radius[is_disc], colours[is_disc], view.style())
            can_rotate &= is_disc | (bodies.core[shown] > MIN_ROUNDNESS * bodies.radius[shown])
            radius = bodies.core[shown] * view.camera.scale
        if not can_rotate.all():
            centre, radius, colours, shown = (
                centre[can_rotate],
                radius[can_rotate],
                colours[can_rotate],
                shown[can_rotate],
            )
        if len(shown):
            draw_rotation_marks(view.surface, centre, radius, frame.angle[shown], colours, view.antialias)

    def _draw_points(
        self,
        canvas: Canvas,
        snapshot: Snapshot,
        sizes: "BodySizes",
        colours: ColourArray,
        ageing: LifetimeColours | None,
    ) -> None:
        """Draw the bodies that are too small for discs; fading ones in the colour of their age."""
        surface = canvas.surface
        pixel_format = (surface.get_masks(), surface.get_bytesize())
        if self._tones is None or self._tones[0] is not colours or self._tones[1] != pixel_format:
            self._tones = colours, pixel_format, packed_pixels(colours, surface)
        if ageing is not None:
            ageing.fade(self._tones[2], packed_pixels(ageing.shades, surface), snapshot.frame.time)
        frame = snapshot.frame
        count = min(len(frame.position), len(colours))
        indices = None if sizes.all_tiny and frame.present.all() else frame.present[:count] & sizes.tiny[:count]
        position, tones = frame.position[:count], self._tones[2][:count]
        self._points.draw(surface, canvas.camera, position, tones, indices, sizes.side)

    def _body_sizes(self, bodies: Bodies, scale: float, ui_scale: float) -> "BodySizes":
        """Return the classification of bodies at a scale, cached for the last arguments."""
        sizes = self._sizes
        if sizes is None or sizes.bodies is not bodies or sizes.scale != scale or sizes.ui_scale != ui_scale:
            tiny = bodies.radius * scale < MAX_POINT_RADIUS * max(ui_scale, 1.0)
            side = 0
            if tiny.any():
                diameter = 2.0 * float(np.median(bodies.radius[tiny])) * scale
                # In a crowd the gaps are more visible than the points: round down.
                side = int(diameter) if len(tiny) > CROWD_COUNT else round(diameter)
                side = min(max(side, round(ui_scale), 1), MAX_POINT_SIZE)
            self._sizes = sizes = BodySizes(
                bodies, scale, ui_scale, tiny, bool(tiny.all()), np.flatnonzero(~tiny), side
            )
        return sizes

    def _update_bodies(self, snapshot: Snapshot) -> None:
        """Compute the constant properties of the bodies: their colours, and which can rotate."""
        bodies, scene = snapshot.bodies, snapshot.scene
        if self._known is not None and self._known[0] is bodies and self._known[1] is scene:
            return
        numbers = None if self._accents is None else self._accents.update(bodies.elements)
        self._known, self._colours = (bodies, scene), colour_of(bodies, numbers)
        ageing = LifetimeColours(bodies)
        self._ageing = ageing if len(ageing) else None
        has_rotated = (bodies.angle != 0.0) | (bodies.angular_velocity != 0.0)
        self._can_rotate = has_rotated | contact_matrix(snapshot.setup or scene, bodies).turnable

    def _blit_background(self, canvas: Canvas, snapshot: Snapshot) -> None:
        surface, scene, has_bounds = canvas.surface, snapshot.scene, "bounds" in snapshot.overlays
        surface_format = (surface.get_size(), surface.get_masks(), surface.get_bytesize())
        key = CachedBackground(scene, canvas.camera, has_bounds, canvas.antialias, canvas.ui_scale, surface_format)
        cached = self._background
        if cached is None or cached[0].scene is not key.scene or cached[0][1:] != key[1:]:
            drawn = pygame.Surface(surface.get_size(), 0, surface)
            drawn.fill(BACKGROUND)
            target, game = replace(canvas, surface=drawn), self._games.view_of(scene)
            if game is None or not game.background(_background_context(target, snapshot)):
                draw_grid(target)
                draw_markings(target, scene)
                draw_lamps(target, scene)
                draw_zones(target, scene)
                draw_attractions(target, scene)
                draw_static_bodies(target, scene if len(scene.layers) == 1 else on_layer(scene, 0))
            if has_bounds:
                draw_bounds(target, scene.world.bounds)
            self._background = cached = (key, drawn)
        surface.blit(cached[1], (0, 0))


def _visible_bodies(camera: Camera, snapshot: Snapshot, among: IntArray | None) -> IntArray:
    """Return the indices of the bodies that are present and at least partly visible."""
    frame = snapshot.frame
    count = min(len(frame.position), len(snapshot.bodies))
    position, radius, present = frame.position[:count], snapshot.bodies.radius[:count], frame.present[:count]
    if among is not None and len(among) < count:
        among = among[among < count]
        position, radius, present = position[among], radius[among], present[among]
    else:
        among = None
    with np.errstate(invalid="ignore", over="ignore"):  # far-away positions may overflow or be nan
        visible = np.flatnonzero(camera.in_sight(position, radius) & present)
    return visible if among is None else among[visible]


def _background_context(canvas: Canvas, snapshot: Snapshot) -> DrawContext:
    """Return a context without bodies, for the cached background."""
    none = np.empty((0, 3), np.uint8)
    return DrawContext(
        surface=canvas.surface,
        camera=canvas.camera,
        ui_scale=canvas.ui_scale,
        antialias=canvas.antialias,
        snapshot=snapshot,
        shown=np.empty(0, np.int64),
        centre=np.empty((0, 2)),
        radius=np.empty(0),
        colours=none,
        body_colours=none,
    )


def _contact_colours(overlapping: BoolArray, count: int) -> ColourArray:
    """Return the body colours of a scene that shows contact by colour, (count, 3)."""
    touching = np.zeros(count, np.bool_)
    touching[: len(overlapping)] = overlapping[:count]
    return np.where(touching[:, None], np.asarray(TOUCHING, np.uint8), np.asarray(CLEAR, np.uint8))


MAX_INSET_WIDTH, MAX_INSET_HEIGHT = 0.72, 0.38
"""Largest width and height of an inset, as fractions of the free area."""
INSET_MARGIN = 10
"""px at a UI scale of 1, distance to the edges of the surface"""
MIN_MAGNIFICATION = 1.5
"""Smallest magnification, relative to the main view, at which an inset is shown."""
EDGE_COLOUR = mix_colours(SKY, INK, 0.25)


class InsetRenderer:
    """Draws the inset of a scene that defines one."""

    def __init__(self, accents: AccentNumbers | None = None) -> None:
        self._picture = Renderer(accents)
        self._surface: pygame.Surface | None = None

    def draw(
        self,
        surface: pygame.Surface,
        camera: Camera,
        snapshot: Snapshot,
        free: pygame.Rect,
        *,
        antialias: bool = True,
        ui_scale: float = 1.0,
        aside: int = 0,
    ) -> pygame.Rect | None:
        """Draw the inset in the lower right corner and outline its region; return its rectangle, or None if not drawn.

        Args:
            surface: with the main view already drawn.
            camera: of the main view.
            snapshot: the snapshot.
            free: area not covered by other elements.
            antialias: whether edges are smooth.
            ui_scale: px, width of a line that is one pixel wide on a 1080p display.
            aside: px at the lower right that are occupied.
        """
        box = snapshot.scene.play.inset
        if box is None:
            return None
        rect = _inset_rect(box, free, round(INSET_MARGIN * ui_scale), aside)
        inset_camera = Camera.fitting(box, rect.size, margin=0.0)
        if min(rect.size) < 1 or inset_camera.scale < MIN_MAGNIFICATION * camera.scale or camera.turned:
            return None
        if self._surface is None or self._surface.get_size() != rect.size:
            self._surface = pygame.Surface(rect.size, 0, surface)
        self._picture.draw(
            self._surface, inset_camera, snapshot, antialias=antialias, ui_scale=ui_scale, scale=False, hud=False
        )
        surface.blit(self._surface, rect)
        width = max(round(1.5 * ui_scale), 1)
        pygame.draw.rect(surface, EDGE_COLOUR, rect, width)
        (left, bottom), (right, top) = camera.to_screen(np.asarray(box)).tolist()
        region = pygame.Rect(round(left), round(top), round(right - left), round(bottom - top)).clip(surface.get_rect())
        if not rect.colliderect(region):
            pygame.draw.rect(surface, EDGE_COLOUR, region, width)
        return rect


def _inset_rect(box: ViewBox, free: pygame.Rect, margin: int, occupied: int) -> pygame.Rect:
    """Return the largest permitted rectangle for the inset of a box."""
    (left, bottom), (right, top) = box
    available = free.width - 2 * margin - (occupied + margin if occupied else 0)
    scale = min(
        min(MAX_INSET_WIDTH * free.width, available) / (right - left), MAX_INSET_HEIGHT * free.height / (top - bottom)
    )
    size = max(round(scale * (right - left)), 0), max(round(scale * (top - bottom)), 0)
    rect = pygame.Rect((0, 0), size)
    rect.bottomright = free.right - margin - (occupied + margin if occupied else 0), free.bottom - margin
    return rect


class GameViews:
    """Views by game, created on first use."""

    def __init__(self) -> None:
        self._views: dict[str, GameView] = {}
        self._last: tuple[Scene, GameView | None] | None = None

    def view_of(self, scene: Scene) -> GameView | None:
        """Return the view that draws a scene; None if no game has one for it."""
        if self._last is None or self._last[0] is not scene:
            path = view_path(scene)
            if path is not None and path not in self._views:
                self._views[path] = import_part(path)()
            self._last = scene, None if path is None else self._views[path]
        return self._last[1]


def view_path(scene: Scene) -> str | None:
    """Return the import string of the view that draws a scene; None if there is none.

    The game named by the scene takes precedence over games whose `presents` accepts the scene.
    """
    specs = game_specs()
    if scene.play.game is not None:
        named = _named_spec(scene.play.game)
        specs = specs if named is None else (named, *(spec for spec in specs if spec is not named))
    return next((spec.view for spec in specs if spec.view is not None and _presents(spec, scene)), None)


def _named_spec(game: str) -> GameSpec | None:
    try:
        return spec_of(game)
    except (ImportError, AttributeError, ValueError):
        assert game not in GAMES
        return None  # an installed game that fails to import: starting the game reports the error


def _presents(spec: GameSpec, scene: Scene) -> bool:
    if spec.presents is None:
        return scene.play.game in spec.names
    return bool(import_part(spec.presents)(scene))


class OffscreenRenderer:
    """Draws frames into an array."""

    def __init__(self, size: tuple[int, int]) -> None:
        """Create a renderer for frames of `size`, px."""
        pygame.font.init()
        self._surface = pygame.Surface(size)
        self._renderer, self._inset = Renderer(), InsetRenderer()

    def picture(
        self, scene: Scene, bodies: Bodies, frame: Frame, rules: Rules | None, throttles: Mapping[str, Throttle]
    ) -> npt.NDArray[np.uint8]:
        """Return a frame of a game as the window shows it, without text: (height, width, 3).

        Args:
            scene: in its current form.
            bodies: including spawned ones.
            frame: state of the bodies.
            rules: of the game, the source of lit lamps and of the view state (guns, blasts); None without a game.
            throttles: current settings, by thruster name.
        """
        camera = Camera.fitting(view_bounds(scene), self._surface.get_size())
        lit = rules.lit_lamps() if isinstance(rules, HasLamps) else frozenset[str]()
        game = rules.view_state(frame.time) if isinstance(rules, HasViewState) else None
        flames = active_thrusters(scene, bodies, throttles, frame.time)
        snapshot = Snapshot(scene, bodies, frame, flames=flames, lit=lit, game=game)
        self._renderer.draw(self._surface, camera, snapshot, hud=False)
        self._inset.draw(self._surface, camera, snapshot, self._surface.get_rect())
        return np.ascontiguousarray(pygame.surfarray.array3d(self._surface).swapaxes(0, 1))
