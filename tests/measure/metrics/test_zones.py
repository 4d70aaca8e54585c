"""Clearance of zones is the distance of a centre outside of them; zone events are not counted as collisions."""

import numpy as np
import pytest

import sandbox
from sandbox.measure.compare.reductions import expand_generators
from sandbox.measure.metrics.clearance import clearance
from sandbox.measure.metrics.contacts import are_collisions, collisions, share_layer
from sandbox.measure.metrics.invariants import momentum_drift
from sandbox.scene.files.load import from_document


def test_gap_is_the_distance_of_the_centre_from_the_zone() -> None:
    zones = [
        {"position": [2, 0], "radius": 0.5},
        {"points": [[2, -1], [2, 1]], "thickness": 0.4},
        {"points": [[1, -1], [3, -1], [3, 1], [1, 1]]},
    ]
    pocket = {"position": [9, 9], "radius": 0.1}
    scene = from_document({"ball": [{"position": [0, 0], "radius": 0.1}], "zone": zones, "pocket": [pocket]})
    position = np.asarray([[[0.0, 0.0]], [[1.9, 0.0]], [[4.0, 0.0]]])
    for k, expected in enumerate(([1.5, -0.4, 1.5], [1.8, -0.1, 1.8], [1.0, -0.9, 1.0])):
        found = clearance(scene, scene.bodies, position, np.zeros((3, 1)), (0, -2 - k))
        assert found == pytest.approx(expected, abs=1e-12)  # rounding


def test_zone_events_are_not_collisions() -> None:
    ball = {"position": [0, 0], "velocity": [1, 0], "radius": 0.1, "restitution": 1.0}
    zones = [{"position": [0.5, 0], "radius": 0.2}, {"position": [0.8, 0], "radius": 0.2, "to_layer": "up"}]
    wall = {"points": [[2, -1], [2, 1]], "layers": ["up"]}
    scene = from_document({"world": {"duration": 2.5}, "ball": [ball], "zone": zones, "wall": [wall]})
    run = sandbox.run(scene)
    assert are_collisions(run).tolist() == [False, False, True]
    assert collisions(run) == 1
    assert momentum_drift(run, scene) == pytest.approx(
        0.0, abs=1e-12
    )  # the impulse of the wall explains the whole change
    shared = share_layer(run, scene, (0, -1))
    assert shared.tolist() == (run.layer[:, 0] == 1).tolist()


def test_scene_with_expanded_generators_keeps_layers_and_zones() -> None:
    grid = {"origin": [0, 0], "columns": 2, "spacing": [1, 1], "radius": 0.1, "layer": "up"}
    zone = {"position": [0.5, 0], "radius": 0.2, "layers": ["up"]}
    scene = from_document({"grid": [grid], "zone": [zone], "ball": [{"position": [0, 3], "radius": 0.1}]})
    expanded = from_document(expand_generators(scene).document)
    layers = dict(zip(expanded.bodies.names, expanded.bodies.layer.tolist(), strict=True))
    assert layers == dict(zip(scene.bodies.names, scene.bodies.layer.tolist(), strict=True))
    assert len(expanded.zones) == 1
