"""Drawing of drives: hinges, and stops in the overlay of joints."""

import math

import numpy as np
import pytest

from sandbox.window.render.palette import BACKGROUND
from tests.window.render.drawn import changed_pixels, colour_at, frame, render, scene, snapshot

pytestmark = pytest.mark.full  # every shipped scene

BAR = {"name": "bar", "position": [1.0, 0.0], "size": [2.0, 1.0]}
TORQUE = {"kind": "torque", "body": "bar", "pivot": [0.0, 0.0], "stops": [0.0, 1.0], "torque": 1.0}
PLUNGER = {"kind": "plunger", "body": "bar", "direction": [0.0, 1.0], "travel": 2.0, "speed": 1.0}


def differing_points(differ):
    """Return the positions of pixels that differ, m, (N, 2)."""
    columns, rows = np.nonzero(differ)
    return np.column_stack(((columns + 0.5) / 20.0 - 5.0, 3.0 - (rows + 0.5) / 20.0))


def test_hinge_is_drawn_as_a_pin_at_the_pivot():
    bare, driven = (render(snapshot(scene(box=[BAR], **more))) for more in ({}, {"drive": [TORQUE]}))
    found = differing_points(changed_pixels(bare, driven))
    assert np.hypot(*found.mean(axis=0)) < 0.05  # m, a pixel
    assert np.hypot(*found.T).max() < 6.0 / 20.0  # radius of 4 px, and antialiased edges
    assert sum(colour_at(driven, 0.0, 0.0)) > sum(BACKGROUND)


def test_plunger_has_no_hinge():
    bare, driven = (render(snapshot(scene(box=[BAR], **more))) for more in ({}, {"drive": [PLUNGER]}))
    assert not changed_pixels(bare, driven).any()


def test_stops_are_drawn_as_an_arc_about_the_hinge():
    model = scene(box=[BAR], drive=[TORQUE])
    found = differing_points(changed_pixels(render(snapshot(model)), render(snapshot(model, "joints"))))
    angle = np.arctan2(found[:, 1], found[:, 0])
    far = np.hypot(*found.T) > 1.35  # m: beyond the pointer of the bar; the arc has a radius of 1.5 m
    assert -0.1 < angle[far].min() < 0.05
    assert 0.95 < angle[far].max() < 1.1
    assert (np.histogram(angle[far], 8, (0.0, 1.0))[0] > 0).all()


def test_pointer_rotates_with_the_body_and_shows_the_level():
    model = scene(box=[BAR], drive=[TORQUE])
    state = {"angle": np.asarray([0.5]), "position": np.asarray([[math.cos(0.5), math.sin(0.5)]])}
    pictures = [
        render(snapshot(model, "joints", frame=frame(model, **state, drives=np.asarray([[level, 0.0, 0.0]]))))
        for level in (0.0, 1.0)
    ]
    found = differing_points(changed_pixels(*pictures))
    assert np.abs(np.arctan2(found[:, 1], found[:, 0]) - 0.5).max() < 0.2


def test_plunger_is_drawn_as_a_line_of_its_travel():
    model = scene(box=[BAR], drive=[PLUNGER])
    found = differing_points(changed_pixels(render(snapshot(model)), render(snapshot(model, "joints"))))
    assert np.abs(found[:, 0] - 1.0).max() < 0.5
    assert found[:, 1].max() < 0.2
    assert -2.2 < found[:, 1].min() < -1.95
    assert (np.histogram(found[:, 1], 20, (-2.0, 0.0))[0] > 0).all()  # from end to end
