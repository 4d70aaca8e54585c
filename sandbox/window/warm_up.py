"""Warm-up: runs a scene briefly, out of sight, so that all kernels that playing it needs are compiled at once.

A kernel is compiled at its first call. Without a warm-up a first game would stop for that several times: when it opens,
at the first contact, at the first step back. What has been warmed up is marked beside the compiled code, so that later
windows start at once.
"""

import math
from collections.abc import Callable, Iterator
from hashlib import blake2b
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np
import pygame

from sandbox.action import ActionError, Strike
from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.engines.common.kernel import COMPILED, cache_folder
from sandbox.engines.contract import Divergence, Exhaustion, Refusal, SnapshotError
from sandbox.engines.exact.tabletop.shots import Table
from sandbox.engines.registry import ENGINES, engine_named
from sandbox.engines.switching import SwitchableSimulation
from sandbox.scene.compile.demands import demands
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.surface import Stroke
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import shipped
from sandbox.window.camera import Camera
from sandbox.window.playback.snapshot import OVERLAYS, Snapshot
from sandbox.window.render.renderer import Renderer
from sandbox.window.view_bounds import view_bounds

MAX_STEPS = 1000
"""steps of a trial run"""
MAX_TIME = 0.3
"""s of a trial run, compilation left out"""
RESUMED_STEPS = 10
"""steps after a state is restored"""
PICTURE_SIZE = (320, 240)
"""px"""
CUE_SPEED = 4.0
"""m/s, speed of the trial shot on a table: it reaches other balls and cushions"""
NO_KEY_SETTINGS = frozenset({"dt", "substeps", "iterations", "record_every", "tolerance"})
"""settings that are numbers, which do not decide which kernels are called"""


SIZES = (64, 1024)
"""numbers of bodies between which drawing and broad phase call the same kernels"""

HAND_WRITTEN = frozenset({"exact", "reference"})
"""engines all of whose scenes call kernels"""


class WarmUpPart(NamedTuple):
    """Part of a warm-up."""

    name: str
    run: Callable[[], None]


def warm_up(scene: Scene, engine: str, settings: Settings | None, on_part: Callable[[str], None]) -> None:
    """Compile the kernels of a scene on an engine, unless that was done for one of the same physics.

    Args:
        scene: scene as it is played.
        engine: name of the engine. If it refuses the scene, nothing is compiled.
        settings: solver settings; None for those of the scene.
        on_part: receives the description of each part before it begins, such as `part 1 of 3: the engine exact`.
    """
    wanted = scene.solver if settings is None else settings
    if not COMPILED or engine_named(engine).missing(scene, wanted):
        return
    mark = _mark(warm_up_key(scene, engine, wanted))
    if mark is None or mark.exists():
        return
    parts = tuple(_parts(scene, engine, wanted))
    for k, part in enumerate(parts, 1):
        on_part(f"part {k} of {len(parts)}: {part.name}")
        part.run()
    mark.touch()


def warm_up_key(scene: Scene, engine: str, settings: Settings) -> str:
    """Return a text that is equal for scenes whose play calls the same kernels."""
    chosen = settings.model_dump(exclude=set(NO_KEY_SETTINGS))
    kinds = sorted(kind for kind, elements in scene.kinds.items() if elements)
    joints = sorted({joint.kind for joint in scene.joints})
    size = sum(len(scene.bodies) > limit for limit in SIZES)
    fixed = sorted({type(each).__name__ for each in scene.fixed})
    return f"{engine} {sorted(demands(Setup.of(scene)))} {chosen} {kinds} {joints} {fixed} {size} {scene.play.game}"


def warm_ups() -> dict[str, tuple[Scene, str]]:
    """Return scene and engine of each distinct warm-up of the shipped scenes, by its key."""
    found: dict[str, tuple[Scene, str]] = {}
    for entry in shipped():
        scene = load(entry.path)
        for engine, kind in ENGINES.items():
            if not kind.missing(scene, scene.solver):
                found.setdefault(warm_up_key(scene, engine, scene.solver), (scene, engine))
    return found


def _mark(key: str) -> Path | None:
    """Return the file that marks a warm-up as done; None if nothing can be stored, so that it would be in vain."""
    folder = cache_folder()
    return None if folder is None else folder / f"warm-{blake2b(key.encode(), digest_size=8).hexdigest()}"


def _parts(scene: Scene, engine: str, settings: Settings) -> Iterator[WarmUpPart]:
    if _calls_kernels(scene, engine):
        yield WarmUpPart(f"the engine {engine}", lambda: _run_briefly(scene, engine, settings))
    if scene.surface is not None:
        yield WarmUpPart("the prediction of shots", lambda: _predict(scene))
    yield WarmUpPart("the pictures", lambda: _draw(scene, engine, settings))


def _calls_kernels(scene: Scene, engine: str) -> bool:
    """Return whether an engine computes a scene with kernels: pymunk only on a table, and for free particles."""
    if engine != "pymunk":
        return engine in HAND_WRITTEN
    return scene.surface is not None or any(body.collides == "none" for body in scene.body_sources)


def _run_briefly(scene: Scene, engine: str, settings: Settings) -> None:
    """Run a scene until it has had some contacts; then continue from a restored state, as after a step back."""
    try:
        simulation = SwitchableSimulation(scene, engine, settings)
    except Refusal:  # for its size, which `missing` does not know
        return
    try:
        simulation.contacts()
        stroke = _stroke(scene)
        if stroke is not None:
            simulation.apply(Strike(time=0.0, ball=scene.bodies.names[0], **stroke.model_dump()))
        _step(simulation, MAX_STEPS)
        resumed = SwitchableSimulation.resumed(simulation.checkpoint())
        _step(resumed, RESUMED_STEPS)
        resumed.close()
        copied = simulation.snapshot().resumed()
        _step(copied, RESUMED_STEPS)
        copied.close()
    except (ActionError, Divergence, Exhaustion, Refusal, SnapshotError):
        pass  # as far as it came; the session reports it if the player meets it
    finally:
        simulation.close()


def _step(simulation: SwitchableSimulation, steps: int) -> None:
    """Make steps with their contacts and states, for a limited time."""
    simulation.patience = MAX_TIME
    began, compiled = perf_counter(), COMPILE_CLOCK.seconds
    for _ in range(steps):
        simulation.step()
        simulation.contacts()
        simulation.frame().state_hash()
        if perf_counter() - began - (COMPILE_CLOCK.seconds - compiled) > MAX_TIME:
            return


def _stroke(scene: Scene) -> Stroke | None:
    """Return a stroke of the first ball of a table towards the middle of the others; None without a table."""
    if scene.surface is None or len(scene.bodies) < 2:
        return None
    across, up = (scene.bodies.position[1:].mean(axis=0) - scene.bodies.position[0]).tolist()
    return Stroke(aim=math.atan2(up, across), speed=CUE_SPEED)


def _predict(scene: Scene) -> None:
    """Predict a shot as the cue does while the player aims, on the exact engine."""
    stroke = _stroke(scene)
    try:
        if stroke is not None:
            outcome = Table(scene).shoot(stroke, scene.bodies.names[0], record_paths=True)
            outcome.path_of(scene.bodies.names[0], 0.05)
    except (ActionError, Exhaustion, Refusal, ValueError):
        pass  # tables without prediction are played without it


def _draw(scene: Scene, engine: str, settings: Settings) -> None:
    """Draw a scene with all overlays."""
    pygame.font.init()  # `sandbox warm` has no window
    surface = pygame.Surface(PICTURE_SIZE)
    camera = Camera.fitting(view_bounds(scene), PICTURE_SIZE)
    try:
        simulation = SwitchableSimulation(scene, engine, settings)
    except Refusal:
        return
    frame = simulation.frame()
    simulation.close()
    trails = (np.repeat(frame.position[None], 3, axis=0),)
    for overlays in (frozenset({"shapes"}), frozenset(OVERLAYS)):
        Renderer().draw(surface, camera, Snapshot(scene, scene.bodies, frame, overlays=overlays, trails=trails))
