"""Builders of scenes and simulations for the tests of engines."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.contract import Simulation
from sandbox.engines.registry import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.files.load import from_document, load

ROOT = Path(__file__).resolve().parents[2]

FLOOR = {"name": "floor", "point": [0, 0], "normal": [0, 1]}

EARTH = {"gravity": [0.0, -9.81]}

PYMUNK_SETTINGS = {"integrator": "explicit_euler", "detection": "discrete", "response": "impulse"}
"""Settings with which the reference engine reproduces pymunk's scheme."""


def ball(x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"position": [x, y], "radius": 0.5, **more}


def scene_of(*balls: dict[str, Any], solver: dict[str, Any] | None = None, **document: Any) -> Scene:
    return from_document({"ball": list(balls), "solver": solver or {}, **document})


def make_scene(**tables: Any) -> Scene:
    """Return a scene of some tables, and of `world` and `solver`."""
    return from_document(tables)


def shipped(name: str) -> Scene:
    """Return a scene of the repository."""
    return load(ROOT / "scenes" / f"{name}.toml")


def simulation_of(scene: Scene, engine: str = "reference", **settings: Any) -> Simulation:
    return start(scene, engine, scene.solver.replace(**settings))


def side_by_side(scene: Scene, steps: int, **settings: Any) -> Iterator[tuple[Simulation, Simulation]]:
    """Yield the simulations of pymunk and of the reference engine after each step."""
    theirs, ours = (
        simulation_of(scene, "pymunk", **settings),
        simulation_of(scene, "reference", **PYMUNK_SETTINGS, **settings),
    )
    for _ in range(steps):
        theirs.step()
        ours.step()
        yield theirs, ours


def body_store_of(scene: Scene) -> BodyStore:
    return BodyStore(Setup.of(scene), scene.solver.h)


def small_pile(count: int = 60) -> Scene:
    """Return balls that fall into a box and settle, with friction and little restitution."""
    coefficients = {"restitution": 0.1, "friction": 0.5}
    planes = [
        {**FLOOR, "material": "stone"},
        {"name": "left", "point": [0, 0], "normal": [1, 0], "material": "stone"},
        {"name": "right", "point": [0.68, 0], "normal": [-1, 0], "material": "stone"},
    ]
    grid = {"origin": [0.07, 0.06], "columns": 6, "rows": count // 6, "spacing": [0.108, 0.103], "radius": 0.05}
    return from_document(
        {
            "world": {**EARTH, "seed": 1},
            "solver": {"dt": 1 / 120},
            "material": [{"name": "stone"}],
            "pair": [{"between": ["stone", "stone"], **coefficients}],
            "plane": planes,
            "grid": [{**grid, "jitter": 0.002, "mass": 0.1, "material": "stone"}],
        }
    )
