"""Expanding: `[pinball]` to walls, posts, zones, bodies, drives and the parts they play."""

from collections.abc import Callable
from typing import Any

from sandbox.scene.faults import Location
from sandbox.scene.model import Scene
from sandbox.scene.outranking import added, paired, stated
from sandbox.scene.pinball import driving, fixing, sensing
from sandbox.scene.pinball.building import Building
from sandbox.scene.pinball.described import Pinball
from sandbox.scene.pinball.faulting import elements_of
from sandbox.scene.pinball.materials import MATERIALS, pairs
from sandbox.scene.pinball.mirroring import both
from sandbox.scene.pinball.rolling import rolling_gravity

SUBSTEPS = 10
"""for engines that step: at 1 kHz a ball at 8 m/s covers less than its radius in one"""
DURATION = 60.0
"""s"""

BUILD: dict[str, Callable[[Building, str, Any], None]] = {
    "art": fixing.art,
    "wall": fixing.wall,
    "rubber": fixing.wall,
    "post": fixing.post,
    "gate": fixing.gate,
    "bumper": fixing.bumper,
    "slingshot": fixing.slingshot,
    "standup": fixing.standup,
    "drops": fixing.drops,
    "rollover": sensing.rollover,
    "spinner": sensing.spinner,
    "kicker": sensing.kicker,
    "ramp": sensing.ramp,
    "drain": sensing.drain,
    "flipper": driving.flipper,
    "plunger": driving.plunger,
    "ball": driving.ball,
}
"""How each kind of element is built."""


def expanded(scene: Scene) -> Scene:
    """Return the scene of primitives that a scene with a sound `[pinball]` stands for; another as it is.

    What the scene states itself comes first in each list, and outranks what is of the same name.
    """
    pinball = scene.pinball
    if pinball is None:
        return scene
    gravity = scene.world.gravity if "gravity" in scene.world.model_fields_set else rolling_gravity(pinball.slope)
    to = _built(pinball, gravity)
    changes: dict[str, Any] = {
        "pinball": None,
        "world": stated(scene.world, {"gravity": gravity, "duration": DURATION}),
        "solver": stated(scene.solver, {"substeps": SUBSTEPS}),
        "materials": added(scene.materials, MATERIALS),
        "pairs": paired(scene.pairs, pairs(pinball.ball_restitution)),
        "play": stated(scene.play, {"game": pinball.game, "ground": "playfield"}).model_copy(
            update={"parts": added(scene.play.parts, to.parts), "markings": (*to.markings, *scene.play.markings)}
        ),
    }
    for key in ("walls", "posts", "zones", "balls", "polygons", "drives"):
        changes[key] = added(getattr(scene, key), getattr(to, key))
    return scene.model_copy(update=changes)


def origins(scene: Scene) -> dict[str, Location]:
    """Return which element of a scene's sound `[pinball]` each name is of that it would write out."""
    return {} if scene.pinball is None else _built(scene.pinball, rolling_gravity(scene.pinball.slope)).origins


def _built(pinball: Pinball, gravity: tuple[float, float]) -> Building:
    to = Building(pinball.axis, pinball.tolerance, pinball.ball_radius, pinball.ball_mass, gravity)
    if pinball.outline is not None:
        to.paint(pinball.colour, to.line(pinball.outline, closed=True))
    for kind, those in elements_of(pinball):
        for k, element in enumerate(those):
            to.here = ("pinball", kind, k)
            for name, one in both(element, kind, k, pinball.axis):
                BUILD[kind](to, name, one)
    return to
