"""A body that is gone, for whatever reason, misses no contacts: the audit follows removals, lifetimes and bounds."""

from typing import Any

import pytest

from sandbox.action import Action, Impulse, Remove, Spawn
from sandbox.engines.registry import ENGINES
from sandbox.measure.run.runner import run
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document

STILL = {"velocity_min": [0.0, 0.0], "velocity_max": [0.0, 0.0], "collides": "all"}
TARGETS: dict[str, tuple[dict[str, Any], tuple[Action, ...]]] = {
    "present": ({"ball": [{"name": "target", "position": [0.0, 0.0], "radius": 0.1}]}, ()),
    "spawned": ({}, (Spawn(time=0.3, ball=Ball(name="target", position=(0.0, 0.0), radius=0.1)),)),
    "removed": (
        {"ball": [{"name": "target", "position": [0.0, 0.0], "radius": 0.1}]},
        (Remove(time=0.3, body="target"),),
    ),
    "of age": ({"emitter": [{**STILL, "position": [0.0, 0.0], "count": 1, "lifetime": 0.3, "radius": 0.1}]}, ()),
    "out of bounds": (  # it leaves them at 0.3 s at the place that the bullet passes later
        {"ball": [{"name": "target", "position": [0.0, 0.31], "velocity": [0.0, 1.0], "radius": 0.1}]},
        (),
    ),
}
SPEED = 1.5
"""m in a step, so that the bullet of 0.1 m passes the target between two steps"""


@pytest.mark.parametrize("case", TARGETS)
@pytest.mark.parametrize("engine", [each for each in ENGINES if each != "exact"])
def test_removed_bodies_miss_no_contacts(engine: str, case: str) -> None:
    tables, actions = TARGETS[case]
    bounds = {"bounds": [[-90.0, -9.0], [90.0, 0.6]]} if case == "out of bounds" else {}
    height = 0.6 if bounds else 0.0
    bullet = {"name": "bullet", "position": [-3.75, height - 1e-3], "radius": 0.1, "mass": 1.0}
    scene = from_document(
        {
            "world": {"duration": 1.0, **bounds},
            "solver": {"dt": 0.02, "substeps": 1},
            **tables,
            "ball": [*tables.get("ball", []), bullet],
        }
    )
    shot = Impulse(time=0.5, body="bullet", impulse=(SPEED / 0.02, 0.0))
    done = run(scene, engine, actions=[*actions, shot])
    assert done.status == "ok"
    assert done.contact_time.tolist() == []
    assert done.missed_contacts == (case in ("present", "spawned"))
