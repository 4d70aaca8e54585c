"""Clearances of shapes, and of bodies from zones."""

import math

import numpy as np
import pytest

import sandbox
from sandbox.measure.compare.reductions import expand_generators
from sandbox.measure.metrics.clearance import clearance, plane_clearance
from sandbox.measure.metrics.contacts import are_collisions, collisions, share_layer
from sandbox.measure.metrics.invariants import momentum_drift
from sandbox.scene.files.load import from_document, loads
from sandbox.scene.geometry.hulls import hull_distance

SCENE = loads(
    '[[box]]\nname = "box"\nposition = [0, 0]\nsize = [2.0, 1.0]\n'
    '[[capsule]]\nname = "rod"\nposition = [0, 0]\nlength = 2.0\nradius = 0.25\n'
    '[[ball]]\nname = "ball"\nposition = [0, 0]\nradius = 0.5\n'
)
ANGLES = np.linspace(0.0, math.pi, 9)


@pytest.mark.parametrize(
    ("name", "reach"),
    [
        ("ball", np.full(9, 0.5)),
        ("box", np.abs(np.sin(ANGLES)) + 0.5 * np.abs(np.cos(ANGLES))),
        ("rod", np.abs(np.sin(ANGLES)) + 0.25),
    ],
)
def test_gap_above_a_plane_is_the_height_of_the_lowest_point(name: str, reach: np.ndarray) -> None:
    index = SCENE.bodies.names.index(name)
    position = np.tile((7.0, 3.0), (9, 1))
    gap = plane_clearance(SCENE.bodies, index, position, ANGLES, np.array([-5.0, 1.0]), np.array([0.0, 1.0]))
    assert gap == pytest.approx(2.0 - reach, abs=1e-15)  # sines and their sums


def hull(rng: np.random.Generator, corners: int) -> np.ndarray:
    angle = np.sort(rng.uniform(0.0, 2.0 * math.pi, corners))
    return np.column_stack((np.cos(angle), np.sin(angle))) * rng.uniform(0.2, 1.5) + rng.uniform(-2.0, 2.0, 2)


def sampled(shape: np.ndarray, count: int = 200) -> np.ndarray:
    """Return points along the border of a hull."""
    fraction = np.linspace(0.0, 1.0, count)[:, None]
    return np.concatenate([a + fraction * (b - a) for a, b in zip(shape, np.roll(shape, -1, axis=0), strict=True)])


@pytest.mark.parametrize("seed", range(40))
def test_distance_of_hulls_agrees_with_points_sampled_along_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = hull(rng, 1 + seed % 5), hull(rng, 1 + seed // 5 % 6)
    found = float(hull_distance(a[None], b[None])[0])
    assert found == pytest.approx(float(hull_distance(b[None], a[None])[0]), abs=1e-12)  # rounding, in another order
    nearest = np.hypot(*(sampled(a)[:, None] - sampled(b)).reshape(-1, 2).T).min()
    if found > 0.0:
        # No sampled point is nearer; the nearest is off by half a sample's length at most, 1.5 % of 3 m.
        assert found - 1e-12 <= nearest <= found + 0.025
        return
    # They overlap: the depth is the smallest displacement along any direction after which they only touch.
    directions = np.linspace(0.0, 2.0 * math.pi, 721)
    axes = np.column_stack((np.cos(directions), np.sin(directions)))
    least = min(float((a @ axis).max() - (b @ axis).min()) for axis in axes)
    assert -found <= least + 1e-12
    assert least <= -found + 0.03  # at most half a degree of direction, of 3 m


def test_touching_hulls_have_distance_zero_and_crossing_ones_a_negative_one() -> None:
    square = np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]])
    assert hull_distance(square, square + np.array([1.0, 0.0])).tolist() == [0.0]
    assert hull_distance(square, square + np.array([0.75, 0.0])).tolist() == [-0.25]
    cross = np.array([[[0.5, -1.0], [0.5, 2.0]]])
    assert hull_distance(square, cross).tolist() == [-0.5]
    assert hull_distance(cross, np.array([[[0.0, 0.0], [1.0, 0.0]]])).tolist() == [-0.5]
    assert hull_distance(np.array([[[0.5, 0.25]]]), square).tolist() == [-0.25]
    assert hull_distance(np.array([[[2.0, 0.0]]]), np.array([[[0.0, 0.0], [1.0, 0.0]]])).tolist() == [1.0]


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
    # the impulse of the wall explains the whole change
    assert momentum_drift(run, scene) == pytest.approx(0.0, abs=1e-12)
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
