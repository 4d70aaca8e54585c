"""Flippers: scenes with the flipper of a pinball machine, with parameters from Visual Pinball."""

import math
from typing import Any

from sandbox.action import Drive
from sandbox.engines.switching import SwitchableSimulation
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document

LENGTH = 0.0702  # m
MASS = 0.080  # kg
MOMENT = MASS * LENGTH**2 / 3.0
REST, END = math.radians(-31.0), math.radians(20.0)
BALL_RADIUS = 0.01349  # radius, m

TORQUE = {
    "kind": "torque",
    "stops": [REST, END],
    "torque": 0.513,
    "ramp": 0.030,
    "return_ratio": 0.058,
    "hold_ratio": 0.75,
    "hold_within": math.radians(6.0),
    "bounce": 0.3,
    "moment": MOMENT,
}


def flipper(**drive: Any) -> dict[str, Any]:
    """Return the tables of a flipper at rest about the origin and of its drive."""
    angle = drive.pop("angle", REST)
    outline = [[-0.0116, 0.0], [0.0, -0.0116], [LENGTH, -0.007], [LENGTH + 0.007, 0.0], [LENGTH, 0.007], [0.0, 0.0116]]
    body = {"name": "bat", "points": outline, "angle": angle, "mass": MASS, "restitution": 0.8, "friction": 0.6}
    return {"polygon": [body], "drive": [{"name": "flip", "body": "bat", "pivot": [0.0, 0.0], **TORQUE, **drive}]}


def bar(angle: float = 0.0, **drive: Any) -> dict[str, Any]:
    """Return the tables of a straight bar, 80 by 20 mm, that pivots about its left end, and of its drive."""
    position = [0.04 * math.cos(angle), 0.04 * math.sin(angle)]
    body = {"name": "bar", "size": [0.08, 0.02], "position": position, "angle": angle, "mass": MASS, "restitution": 1.0}
    drive_table = {**TORQUE, "stops": [0.0, 0.5], **drive}
    del drive_table["moment"]
    return {"box": [body], "drive": [{"name": "flip", "body": "bar", "pivot": [0.0, 0.0], **drive_table}]}


BAR_MOMENT = MASS * (0.08**2 + 0.02**2) / 12.0 + MASS * 0.04**2


def ball(x: float, y: float, vx: float = 0.0, vy: float = 0.0, **keys: Any) -> dict[str, Any]:
    """Return the table of a pinball."""
    return {"name": "ball", "position": [x, y], "velocity": [vx, vy], "radius": BALL_RADIUS, "mass": MASS, **keys}


def scene(*tables: dict[str, Any], gravity: tuple[float, float] = (0.0, 0.0), dt: float = 1e-3, **more: Any) -> Scene:
    """Return a scene of the given tables."""
    document: dict[str, Any] = {"world": {"gravity": list(gravity), "duration": 1.0}, "solver": {"dt": dt, **more}}
    for each in tables:
        document |= each
    return from_document(document)


def press(simulation: SwitchableSimulation, level: float = 1.0, drive: str = "flip") -> None:
    """Set the level of a drive."""
    simulation.apply(Drive(time=0.0, drive=drive, level=level))
