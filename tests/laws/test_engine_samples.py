"""Behaviours that engines are known for, as scenes with closed forms: the figures of docs/results/box2d.md."""

import math

import numpy as np
import pytest

import sandbox
from sandbox.engines.registry import able
from sandbox.trajectory import Trajectory

G = 9.81


def run(name: str, engine: str, *overrides: str, **settings: float | str) -> Trajectory:
    result = sandbox.run(sandbox.load(name, overrides), engine, audit=False, **settings)
    assert result.status == "ok", result.reason
    return result


@pytest.mark.parametrize(
    ("engine", "error"),
    # relative error of the height of the first rebound, for e from 0.2 on; see the page for its cause
    [("pymunk", 0.06), ("reference", 0.06), ("box2d", 0.06), ("exact", 2e-3)],
)
def test_rebound_has_the_height_of_its_restitution(engine: str, error: float) -> None:
    result = run("restitution_row", engine)
    fall = math.sqrt(2.0 * 2.0 / G)
    for k in range(2, 11):
        e = k / 10.0
        rebound = (result.time > fall) & (result.time < fall * (1.0 + 2.0 * e))
        assert result.position[rebound, k, 1].max() - 0.4 == pytest.approx(2.0 * e * e, rel=error)


@pytest.mark.parametrize(
    ("engine", "least", "most"), [("pymunk", 0.999, 1.001), ("reference", 0.999, 1.001), ("box2d", 0.1, 0.4)]
)
def test_elastic_ball_keeps_its_height_but_not_on_box2d(engine: str, least: float, most: float) -> None:
    result = run("elastic_ball", engine, "world.duration=20.0")
    height = float(result.position[result.time > 18.0, 0, 1].max()) - 0.5
    assert least < height < most


@pytest.mark.parametrize("engine", ["pymunk", "box2d", "reference"])
def test_boxes_on_a_ramp_slide_below_the_friction_of_its_slope(engine: str) -> None:
    result = run("friction_ramp", engine)
    down = np.asarray([math.cos(0.25), -math.sin(0.25)])
    moved = (result.position[-1] - result.position[0]) @ down
    assert np.abs(moved[:3]).max() < 1e-3  # creep of those that stay, m
    for k, friction in ((3, 0.1), (4, 0.0)):
        expected = 0.5 * G * (math.sin(0.25) - friction * math.cos(0.25)) * 9.0
        assert moved[k] == pytest.approx(expected, abs=0.017)  # a·t·h/2 with substeps of 4.2 ms


@pytest.mark.parametrize(
    ("engine", "settings", "stops"),
    [
        ("pymunk", {}, False),
        ("reference", {}, False),
        ("reference", {"detection": "swept"}, True),
        ("box2d", {}, True),
        ("box2d", {"continuous": False}, False),
        ("exact", {}, True),
    ],
)
def test_bullet_passes_a_thin_wall_without_continuous_collision(
    engine: str, settings: dict[str, float | str], stops: bool
) -> None:
    assert (run("bullet", engine, **settings).position[-1, 0, 0] < 1.0) == stops


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("engine", able(sandbox.load("far_pyramid")))
def test_pyramid_far_from_the_origin_stands_as_near_it(engine: str) -> None:
    near, far = (run(name, engine) for name in ("pyramid", "far_pyramid"))
    moved = [np.abs(result.position[-1] - result.position[0]).max() for result in (near, far)]
    assert max(moved) < 0.01  # m, of boxes of 0.4 m; ten rows of Box2D's slop are 25 mm
    assert moved[1] == pytest.approx(moved[0], abs=2e-4)  # a few times the spacing of 32-bit numbers, 6e-5 m
