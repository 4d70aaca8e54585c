"""Orientation of whole scenes: runs of rotated scenes are the rotated runs; which starts are rotated."""

import math

import numpy as np
import pytest

from sandbox.engines.registry import ENGINES
from sandbox.measure.extremes.orientation import orientation, rotated, rotated_run
from sandbox.measure.extremes.outcome import Task
from sandbox.measure.extremes.scenarios import SCENARIOS
from sandbox.measure.extremes.worker import evaluate_task
from sandbox.measure.run.runner import run
from sandbox.scene.files.load import from_document

SINGLE_CONTACTS = {
    "world": {"gravity": [0.0, -9.81], "duration": 0.5},
    "plane": [{"point": [0.0, 0.0], "normal": [0.0, 1.0], "friction": 1.0}],
    "wall": [{"points": [[-2.0, 3.0], [2.0, 3.0]], "thickness": 0.1}],
    "box": [{"position": [5.0, 9.0], "velocity": [2.0, 0.0], "angular_velocity": 3.0, "size": [0.4, 0.2]}],
    "ball": [
        {"position": [0.0, 2.0], "velocity": [0.0, 6.0], "radius": 0.1, "restitution": 0.8},
        {"position": [0.0, 0.12], "velocity": [2.0, 0.0], "radius": 0.1, "friction": 0.3},
    ],
}
"""A ball at a wall, one that falls onto a plane and slides, and a box in flight. No box on the plane: solvers treat its
corners one after the other, in an order that depends on the orientation."""


@pytest.mark.parametrize("engine", [name for name in ENGINES if name != "exact"])
@pytest.mark.fail_slow(60)  # may compile kernels
def test_run_of_a_rotated_scene_is_the_rotated_run(engine):
    scene, angle = from_document(SINGLE_CONTACTS, "the scene"), 1.0
    straight, turned = run(scene, engine), run(rotated(scene, angle), engine)
    back = rotated_run(turned, scene, -angle)
    assert np.abs(turned.position[-1] - straight.position[-1]).max() > 0.5  # m: the scene has been rotated
    # Roundings of 1e-16 in 60 steps; contacts of Box2D are soft springs in single precision, with a slop of 5 mm.
    tolerance = 1e-3 if ENGINES[engine].epsilon > 1e-10 else 1e-9
    assert back.position == pytest.approx(straight.position, abs=tolerance)
    assert back.velocity == pytest.approx(straight.velocity, abs=10.0 * tolerance)  # 1/s: changes within 0.1 s
    assert back.angle == pytest.approx(straight.angle, abs=tolerance)
    assert back.contact_normal == pytest.approx(straight.contact_normal, abs=tolerance)


def test_every_other_start_of_boxes_is_rotated_and_none_of_balls():
    tower = from_document(SCENARIOS["tower"].document({}), "tower")
    angles = np.array([orientation(tower, number) for number in range(21)])
    assert not angles[[0, *range(1, 21, 2)]].any()
    gaps = np.diff(np.sort(angles[2::2]))
    assert gaps.max() < 3.0 * 2.0 * math.pi / 10.0  # three-gap theorem: few are longer than 2π/10
    drop = from_document(SCENARIOS["drop"].document({}), "drop")
    assert [orientation(drop, number) for number in range(21)] == [0.0] * 21


def test_scene_with_anything_that_has_a_direction_of_its_own_is_not_rotated():
    for override in ("world.wind=[1.0, 0.0]", "world.bounds=[[-50.0, -50.0], [50.0, 50.0]]"):
        scene = from_document(SCENARIOS["tower"].document({}), "tower", (override,))
        assert orientation(scene, 2) == 0.0


@pytest.mark.fail_slow(60)  # may compile kernels
def test_boxes_that_stand_upright_stand_rotated():
    for number in (1, 2):
        found = evaluate_task(Task("two boxes", {}, "pymunk", start=number, spread=0.01))
        assert found.verdict in ("exact", "degraded")
        assert found.error is not None
        assert found.error < 0.01  # of the width: the boxes rest where they started
