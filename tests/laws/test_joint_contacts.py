"""Joints with and without contacts of their bodies: `collide`, on every engine that has the joint."""

from typing import Any

import pytest

import sandbox
from sandbox.engines.registry import able
from sandbox.scene.files.load import from_document

LOOSE: dict[str, dict[str, Any]] = {
    "slide": {"least": 0.0, "most": 100.0, "anchors": [[0.0, 0.5], [0.0, -0.5]]},
    "rotary_limit": {"least": -9.0, "most": 9.0},
    "gear": {"ratio": 1.0},
    "motor": {"rate": 0.0, "max_torque": 0.0},
    "ratchet": {"ratchet": 1.0},
    "spring": {"rest_length": 0.0, "stiffness": 1e-12},
    "rotary_spring": {"rest_angle": 0.0, "stiffness": 1e-12},
}
"""Joints that have no effect on two discs that meet head-on"""


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("kind", LOOSE)
def test_jointed_bodies_collide_only_if_the_joint_allows_it(kind: str) -> None:
    """Equal discs with e = 1 exchange their velocities, or pass through each other."""
    tested = []
    for collide in (True, False):
        balls = [
            {"name": name, "position": [x, 0.0], "radius": 0.2, "velocity": [-x, 0.0], "restitution": 1.0}
            for name, x in (("left", -1.0), ("right", 1.0))
        ]
        joint = {"kind": kind, "between": ["left", "right"], "collide": collide, **LOOSE[kind]}
        scene = from_document({"ball": balls, "joint": [joint], "world": {"duration": 2.0}})
        for engine in able(scene):
            tested.append(engine)
            velocity = sandbox.run(scene, engine).velocity[-1, :, 0]
            assert velocity == pytest.approx([-1.0, 1.0] if collide else [1.0, -1.0], abs=1e-5)  # box2d has 32 bits
    assert set(tested) >= ({"pymunk"} if kind == "ratchet" else {"pymunk", "reference"})


def test_bodies_of_a_spring_that_breaks_collide_again() -> None:
    """The spring breaks while the discs are far apart; they bounce on every engine."""
    balls = [
        {"name": name, "position": [x, 0.0], "radius": 0.2, "velocity": [-x, 0.0], "restitution": 1.0}
        for name, x in (("left", -1.0), ("right", 1.0))
    ]
    spring = {"kind": "spring", "between": ["left", "right"], "rest_length": 0.0, "stiffness": 1e-9, "strength": 1e-12}
    scene = from_document({"ball": balls, "joint": [spring], "world": {"duration": 2.0}})
    engines = able(scene)
    assert "box2d" in engines
    for engine in engines:
        assert sandbox.run(scene, engine).velocity[-1, :, 0] == pytest.approx([-1.0, 1.0], abs=1e-5)
