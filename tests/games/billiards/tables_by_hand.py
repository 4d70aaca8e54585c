"""Billiards tables of tests: the shipped scenes, and matches with balls at given positions."""

from dataclasses import replace
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


def match_with_balls_at(name: str, positions: dict[str, Point], **terms: Any) -> Match:
    """Return a match with balls at given positions; the other balls are at their initial positions."""
    initial = match(name, **terms)
    return changed_match(replace(initial, position=initial.layout.start), positions)


def changed_match(now: Match, positions: dict[str, Point] | None = None, **state: Any) -> Match:
    """Return a match with balls at other positions, and other values of the fields of its state."""
    position = list(now.position)
    for ball, at in (positions or {}).items():
        position[now.layout.number[ball]] = at
    return replace(now, position=tuple(position), state=replace(now.state, **state), verdict=None)


def run_until_rest(simulation: Simulation) -> Contacts:
    """Step until every ball is at rest; return the contacts since the last call of `contacts`."""
    simulation.step()
    while not simulation.frame().is_at_rest:
        simulation.step()
    return simulation.contacts()
