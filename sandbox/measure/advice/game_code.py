"""Lines of code with which a game sets a recommended setting: pymunk, Box2D, or the `[solver]` of a scene file."""

from dataclasses import dataclass

from sandbox.engines.box2d_adapter.limits import SLOP_LENGTHS, scale_for
from sandbox.engines.pymunk_adapter.engine import SPACE_DEFAULTS, is_space_default
from sandbox.formatting import format_quantity
from sandbox.measure.tradeoff.recommendation import pymunk_lines
from sandbox.scene.description.world import Settings


@dataclass(frozen=True)
class GameCode:
    """Code fragment that sets a setting, and remarks about it."""

    language: str
    """`python`, `c` or `toml`"""
    lines: tuple[str, ...]
    """the fragment"""
    remarks: tuple[str, ...]
    """what the fragment cannot say: defaults that differ, units"""


def game_code(engine: str, settings: Settings, fps: float, zoom: float, is_slop_stated: bool) -> GameCode:
    """Return the lines that set a resolved setting, whose dt is that of a frame, in a game.

    Args:
        engine: name of the engine. Engines that are no library for games get the lines of a scene file.
        settings: the setting as the engine resolved it.
        fps: frames per second of the game.
        zoom: px/m, for the slop of a game whose unit is the pixel.
        is_slop_stated: whether the scene states the slop.
    """
    if engine == "pymunk":
        lines = pymunk_lines(settings, f"1 / {fps:.17g}")
        return GameCode("python", tuple(lines), tuple(_pymunk_remarks(settings, zoom, is_slop_stated)))
    if engine == "box2d":
        return _box2d_code(settings, fps)
    return _scene_code(engine, settings)


def _pymunk_remarks(settings: Settings, zoom: float, is_slop_stated: bool) -> list[str]:
    assert settings.slop is not None
    default = SPACE_DEFAULTS["collision_slop"]
    if is_space_default("collision_slop", settings.slop):
        return []
    source = "stated in the scene" if is_slop_stated else "the sandbox's default, 1 % of the smallest radius"
    pixels = settings.slop * zoom
    return [
        f"collision_slop: {format_quantity(settings.slop, 'm')} is {source}; pymunk's default is {default:g}, which "
        f"suits pixels. If the unit of the game is the pixel, at {zoom:g} px per metre, set {pixels:.4g}"
    ]


def _box2d_code(settings: Settings, fps: float) -> GameCode:
    """Return lines for Box2D v3 in C, for lengths in metres."""
    assert settings.slop is not None
    scale, definition = scale_for(settings), []
    if settings.continuous is False:
        definition.append("worldDef.enableContinuous = false;")
    if not settings.sleeping:
        definition.append("worldDef.enableSleep = false;")
    lines = [f"b2SetLengthUnitsPerMeter({1.0 / scale:.9g}f);  // before any other call"] if scale != 1.0 else []
    lines += ["b2WorldDef worldDef = b2DefaultWorldDef();", *definition] if definition else []
    lines.append(f"b2World_Step(world, 1.0f / {fps:.9g}f, {settings.substeps});  // every frame")
    remark = (
        f"slop: {format_quantity(settings.slop, 'm')}; Box2D's own is {SLOP_LENGTHS:g} of its length units, "
        f"{format_quantity(SLOP_LENGTHS, 'm')} if these are metres. Box2D has no iterations: it solves once per substep"
    )
    return GameCode("c", tuple(lines), (remark,))


def _scene_code(engine: str, settings: Settings) -> GameCode:
    """Return the `[solver]` of a scene file, for an engine of the sandbox."""
    chosen = {"dt": settings.dt, "substeps": settings.substeps, "iterations": settings.iterations}
    if engine == "exact":
        chosen = {"dt": settings.dt}
    lines = ["[solver]", *(f"{key} = {value!r}" for key, value in chosen.items())]
    if engine != "exact":
        methods = {key: getattr(settings, key) for key in ("integrator", "detection", "response", "joints")}
        lines += [f'{key} = "{value}"' for key, value in methods.items() if value is not None]
    remark = (
        f"{engine} is an engine of the sandbox, not a library for games: `sandbox.start(scene, {engine!r})` steps it"
    )
    return GameCode("toml", tuple(lines), (remark,))
