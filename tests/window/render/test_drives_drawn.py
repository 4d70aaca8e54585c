"""Drives: their hinges, and in the overlay of joints their stops."""

import math

import numpy as np
import pytest

from sandbox.window.render.palette import BACKGROUND
from tests.window.render.drawn import at, changed, drawn, frame, scene, sight

pytestmark = pytest.mark.full  # every shipped scene

BAR = {"name": "bar", "position": [1.0, 0.0], "size": [2.0, 1.0]}
TORQUE = {"kind": "torque", "body": "bar", "pivot": [0.0, 0.0], "stops": [0.0, 1.0], "torque": 1.0}
PLUNGER = {"kind": "plunger", "body": "bar", "direction": [0.0, 1.0], "travel": 2.0, "speed": 1.0}


def places(differ):
    """Return where pixels differ, m."""
    columns, rows = np.nonzero(differ)
    return np.column_stack(((columns + 0.5) / 20.0 - 5.0, 3.0 - (rows + 0.5) / 20.0))


def test_hinge_is_a_pin_where_the_drive_says():
    bare, driven = (drawn(sight(scene(box=[BAR], **more))) for more in ({}, {"drive": [TORQUE]}))
    found = places(changed(bare, driven))
    assert np.hypot(*found.mean(axis=0)) < 0.05  # m, a pixel
    assert np.hypot(*found.T).max() < 6.0 / 20.0  # its 4 px, and their edges
    assert sum(at(driven, 0.0, 0.0)) > sum(BACKGROUND)


def test_plunger_has_no_hinge():
    bare, driven = (drawn(sight(scene(box=[BAR], **more))) for more in ({}, {"drive": [PLUNGER]}))
    assert not changed(bare, driven).any()


def test_stops_are_an_arc_about_the_hinge_from_one_to_the_other():
    which = scene(box=[BAR], drive=[TORQUE])
    found = places(changed(drawn(sight(which)), drawn(sight(which, "joints"))))
    angle = np.arctan2(found[:, 1], found[:, 0])
    far = np.hypot(*found.T) > 1.35  # m, beyond the hand that shows where the bar is: the arc, 1.5 m out
    assert -0.1 < angle[far].min() < 0.05
    assert 0.95 < angle[far].max() < 1.1
    assert (np.histogram(angle[far], 8, (0.0, 1.0))[0] > 0).all()


def test_hand_turns_with_the_body_and_tells_the_level():
    which = scene(box=[BAR], drive=[TORQUE])
    state = {"angle": np.asarray([0.5]), "position": np.asarray([[math.cos(0.5), math.sin(0.5)]])}
    pictures = [
        drawn(sight(which, "joints", frame=frame(which, **state, drives=np.asarray([[level, 0.0, 0.0]]))))
        for level in (0.0, 1.0)
    ]
    found = places(changed(*pictures))
    assert np.abs(np.arctan2(found[:, 1], found[:, 0]) - 0.5).max() < 0.2


def test_plunger_has_a_line_as_long_as_its_travel():
    which = scene(box=[BAR], drive=[PLUNGER])
    found = places(changed(drawn(sight(which)), drawn(sight(which, "joints"))))
    assert np.abs(found[:, 0] - 1.0).max() < 0.5
    assert found[:, 1].max() < 0.2
    assert -2.2 < found[:, 1].min() < -1.95
    assert (np.histogram(found[:, 1], 20, (-2.0, 0.0))[0] > 0).all()  # from end to end
