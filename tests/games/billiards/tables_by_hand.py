"""Tables for tests: the shipped ones, and balls put where a test wants them."""

from functools import cache
from pathlib import Path
from typing import Any

from sandbox.engines.contract import Simulation
from sandbox.games.billiards.match import Match
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.files.load import load
from sandbox.trajectory import Contacts

SCENES = Path(__file__).parents[3] / "scenes" / "billiards"


@cache
def table(name: str, seed: int | None = None) -> Scene:
    return load(SCENES / f"{name}.toml", () if seed is None else [("world.seed", seed)])


def match(name: str, **terms: Any) -> Match:
    return Match.begin(table(name), **terms)


def lying(name: str, places: dict[str, Point], **terms: Any) -> Match:
    """A match with balls elsewhere; those that are not named are where they begin."""
    scene = table(name)
    position = scene.bodies.position.copy()
    for ball, at in places.items():
        position[scene.bodies.names.index(ball)] = at
    begun = Match.begin(scene, **terms)
    plain = begun.document() | {"position": position.tolist()}
    return Match.restored(scene, plain)


def run_until_rest(simulation: Simulation) -> Contacts:
    """Step until every ball is at rest; return the contacts since they were last asked for."""
    simulation.step()
    while not simulation.frame().is_at_rest:
        simulation.step()
    return simulation.contacts()
