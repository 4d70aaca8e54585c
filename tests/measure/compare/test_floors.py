"""Comparisons of engines on floors: the exact engine is the truth, and pockets count as contacts."""

from typing import Any

import pytest

from sandbox.measure.analytic import solution
from sandbox.measure.compare import compare
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact`

R = 0.028575
BALL: dict[str, Any] = {"name": "a", "position": [0.0, 0.0], "velocity": [0.4, 1.0], "radius": R, "mass": 0.17}
SCENE: dict[str, Any] = {
    "world": {"duration": 4.0},
    "solver": {"dt": 0.01, "substeps": 10},
    "surface": {"sliding_friction": 0.2, "rolling_friction": 0.01},
    "wall": [{"points": [[0.5, -1.0], [0.5, 3.0]], "restitution": 0.8}],
    "post": [{"position": [9.0, k], "radius": 0.1} for k in range(5)],
    "pocket": [{"name": "hole", "position": [0.4, 1.4], "radius": 0.2}],
    "ball": [BALL],
}


def test_engines_agree_on_a_ball_that_falls_into_a_pocket() -> None:
    comparison = compare(from_document(SCENE), engines=("pymunk", "exact"))
    assert comparison.truth == "exact"
    for row in comparison.rows:
        assert row.status == "ok"
        assert row.score.max_position < 1e-9  # m: both use closed-form paths
        assert row.count("missed") == row.count("phantom") == 0
        assert row.count("matched") == 2  # the wall, and the pocket


def test_ball_on_a_floor_has_no_closed_form_solution() -> None:
    assert solution(from_document({**SCENE, "wall": [], "post": [], "pocket": []})) is None
