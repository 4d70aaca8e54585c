"""Thumbnails of the gallery: each shipped scene at a characteristic time of a run on its default engine."""

from pathlib import Path
from typing import NamedTuple

from PIL import Image, ImageChops

import sandbox
from sandbox.engines.registry import usual
from sandbox.games.pinball.bot import PinballBot
from sandbox.measure.run.runner import run
from sandbox.measure.run.sessions import play_out
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.camera import Camera, ViewBox
from sandbox.window.capture.image_files import offscreen
from sandbox.window.playback.recorded import RecordedRun
from sandbox.window.render.palette import BACKGROUND
from sandbox.window.render.renderer import Renderer
from sandbox.window.view_bounds import should_rotate

from .files import image_of, save_png

SIZE = (360, 225)
SUPERSAMPLING = 2
"""The picture is drawn larger by this factor, and averaged."""
LINES = 1.8
"""Unit of line widths; lines are wider than in the window, because the picture is small."""
FAINT = 0.35
"""Opacity of earlier times."""


class Moment(NamedTuple):
    """Time, trails and view of a thumbnail."""

    time: float
    """time of the picture, s"""
    strobe: int = 0
    """number of earlier times that are drawn faintly, equally spaced from the start"""
    trail: float = 0.0
    """duration of trails, s"""
    box: ViewBox | None = None
    """visible part of the world, m; None: bounds of the run"""
    player: str | None = None
    """player of a game with rules; None: no inputs"""


MOMENTS = {
    "benchmark/bounce_to_rest": Moment(2.05, strobe=8),
    "benchmark/box_slides": Moment(1.6, strobe=2),
    "benchmark/box_sticks": Moment(0.5),
    "benchmark/break_shot": Moment(0.4, trail=0.4),
    "benchmark/bullet": Moment(0.012, strobe=6, box=((0.72, -0.16), (1.24, 0.16))),
    "benchmark/chain_of_20": Moment(1.0, strobe=4),
    "benchmark/double_pendulum": Moment(4.0, trail=3.0),
    "benchmark/elastic_ball": Moment(0.8, strobe=5),
    "benchmark/far_pyramid": Moment(1.0),
    "benchmark/figure_eight": Moment(6.9, trail=6.4),
    "benchmark/friction_ramp": Moment(2.0, strobe=4),
    "benchmark/gas": Moment(4.0),
    "benchmark/heavy_on_light": Moment(2.0),
    "benchmark/incline": Moment(1.6, strobe=4),
    "benchmark/kepler": Moment(5.2, strobe=18),
    "benchmark/lift": Moment(2.7, strobe=16, box=((-2.9, -1.8), (2.9, 1.8))),
    "benchmark/newtons_cradle": Moment(0.4, strobe=2),
    "benchmark/oblique": Moment(1.3, strobe=5),
    "benchmark/pendulum_170": Moment(2.6, strobe=14),
    "benchmark/pendulum_5": Moment(0.95, strobe=4, box=((-0.6, -1.12), (0.6, 0.06))),
    "benchmark/pendulum_90": Moment(1.12, strobe=8),
    "benchmark/pile": Moment(2.0),
    "benchmark/projectile": Moment(2.9, trail=2.9),
    "benchmark/pyramid": Moment(1.0),
    "benchmark/restitution_row": Moment(1.25, trail=0.61),
    "benchmark/rest_depth": Moment(0.5, box=((-0.2, -0.03), (0.2, 0.23))),
    "benchmark/rolling_resistance": Moment(8.0, strobe=8),
    "benchmark/slide_to_roll": Moment(1.0, strobe=4),
    "benchmark/slide_to_stop": Moment(1.1, strobe=3),
    "benchmark/spring": Moment(1.0, strobe=2),
    "benchmark/stiff_spring": Moment(0.2, strobe=4),
    "benchmark/stiff_spring_beyond": Moment(0.04, strobe=3),
    "benchmark/tower": Moment(1.0),
    "benchmark/two_balls": Moment(0.75, strobe=3),
    "billiards/8-ball": Moment(1.2),
    "billiards/9-ball": Moment(1.0),
    "billiards/bank": Moment(2.0, trail=2.0),
    "billiards/half_ball": Moment(1.6, strobe=8),
    "billiards/snooker": Moment(2.5),
    "billiards/straight-rail": Moment(4.0, trail=4.0),
    "billiards/stun_draw_follow": Moment(1.6, strobe=6),
    "billiards/three-cushion": Moment(5.0, trail=5.0),
    "billiards/throw": Moment(3.0, trail=3.0),
    "games/bipedal_walker": Moment(0.2, box=((2.0, 2.0), (9.5, 7.0))),
    "games/conveyor": Moment(3.0),
    "games/curling": Moment(60.0, player="random"),
    "games/demolition": Moment(2.6),
    "games/harbour": Moment(1.2, box=((-8.6, -4.4), (10.4, 4.4))),
    "games/landing": Moment(4.8, trail=4.8),
    "games/lunar_lander": Moment(1.1, strobe=4),
    "games/moving_platforms": Moment(1.75, trail=1.7),
    "games/racing_car": Moment(4.0, trail=2.5),
    "games/rube_goldberg": Moment(6.0),
    "games/table_tennis": Moment(0.72, trail=0.72, box=((-1.6, 0.1), (2.0, 1.7))),
    "joints/atwood": Moment(0.8, strobe=3),
    "joints/bridge": Moment(4.0),
    "joints/buggy": Moment(2.6, box=((0.5, -0.9), (7.5, 3.2))),
    "joints/cloth": Moment(4.0),
    "joints/flipper": Moment(2.0, strobe=8),
    "joints/hanging_chain": Moment(2.0),
    "joints/ragdoll_stairs": Moment(1.1, strobe=2),
    "joints/slider_crank": Moment(0.3, strobe=3),
    "joints/tearing_cloth": Moment(0.6),
    "particles/fireworks_100k": Moment(0.8, box=((-36.0, -2.0), (36.0, 42.0))),
    "particles/smoke": Moment(1.0, box=((-8.0, -3.5), (6.0, 5.25))),
    "particles/sparks": Moment(0.6),
    "pinball/classic": Moment(20.0, trail=1.5, player="skilled"),
    "pinball/full": Moment(20.0, trail=1.5, player="skilled"),
    "tutorial/balloon_and_feather": Moment(1.6, strobe=4),
    "tutorial/ball": Moment(1.0, strobe=5),
    "tutorial/bounce": Moment(1.7, strobe=8),
    "tutorial/circle_half_plane": Moment(0.1),
    "tutorial/fast_ball": Moment(0.1, strobe=4),
    "tutorial/fireworks": Moment(1.4),
    "tutorial/overpass": Moment(2.4, trail=2.4),
    "tutorial/sensors": Moment(3.7, trail=3.0, box=((-4.9, -1.0), (6.1, 4.9))),
    "tutorial/spaceship": Moment(4.8, trail=4.8),
}
"""By scene; the thumbnails of artillery are made from the window."""
LARGEST = 9_000
"""Largest size of a thumbnail, bytes."""


def make(name: str, path: Path) -> None:
    """Make the thumbnail of a scene, such as `tutorial/bounce`, with as many colours as fit into `LARGEST` bytes."""
    save(thumbnail(name, MOMENTS[name]), path)


def save(image: Image.Image, path: Path) -> None:
    """Write a thumbnail with as many colours as fit into `LARGEST` bytes."""
    for colours in (256, 128, 64, 32, 16, 8):
        save_png(image, path, colours)
        if path.stat().st_size <= LARGEST:
            return


def thumbnail(name: str, moment: Moment) -> Image.Image:
    """Return the picture of a run at a moment."""
    scene = sandbox.load(find(name), [f"world.duration={moment.time}"])
    film = RecordedRun(_run(scene, moment), name)
    size = SIZE[0] * SUPERSAMPLING, SIZE[1] * SUPERSAMPLING
    camera = Camera.fitting(moment.box or film.bounds, size, turned=should_rotate(scene, size))
    overlays = frozenset({"shapes", *(("trails",) if moment.trail else ())})
    renderer, surface, combined = Renderer(), offscreen(size), None
    for k in range(moment.strobe + 1):
        time = film.duration * (1.0 - k / max(moment.strobe, 1))
        renderer.draw(surface, camera, film.snapshot(time, overlays, moment.trail or 1.0), ui_scale=LINES, scale=False)
        image = image_of(surface)
        faint = Image.blend(Image.new("RGB", size, BACKGROUND), image, FAINT)
        combined = image if combined is None else ImageChops.lighter(combined, faint)
    assert combined is not None
    return combined.reduce(SUPERSAMPLING)


def _run(scene: sandbox.Scene, moment: Moment) -> sandbox.Trajectory:
    if moment.player is None:
        return run(scene, usual(scene), audit=False)
    player = PinballBot(scene.world.seed, 0.95) if moment.player == "skilled" else moment.player
    return play_out(scene, player, usual(scene)).trajectory
