"""Joint errors against hand-computed distances, and joint errors of engines."""

import math

import numpy as np
import pytest

from sandbox.measure.compare.metrics import METRICS, EvaluationContext
from sandbox.measure.metrics.invariants import joint_error, joint_errors, joint_scales
from sandbox.measure.run.runner import run
from sandbox.scene.files.load import from_document, loads
from tests.measure.metrics.test_energy import resting_run

TWO = """
box = [
  { name = "a", position = [0.0, 0.0], size = [2.0, 0.2] },
  { name = "b", position = [3.0, 0.0], size = [2.0, 0.2] },
]
"""


def error_at(joint: str, position: tuple[float, float] = (3.0, 0.0), angle: float = 0.0) -> float:
    """Return the error of one joint with the second box at another pose than its initial one."""
    scene = loads(f'{TWO}[[joint]]\nbetween = ["a", "b"]\n{joint}\n')
    moved, turned = resting_run(scene).position, resting_run(scene).angle
    moved[:, 1], turned[:, 1] = position, angle
    (error,) = joint_errors(resting_run(scene, position=moved, angle=turned), scene)[-1]
    return float(error)


GROOVE = 'kind = "groove"\ngroove = [[0.0, 0.0], [0.0, 4.0]]'


@pytest.mark.parametrize(
    ("joint", "position", "angle", "error"),
    [
        ('kind = "rod"', (3.0, 0.0), 0.0, 0.0),
        ('kind = "rod"', (3.0, 4.0), 0.0, 2.0),
        ('kind = "rod"', (1.0, 0.0), 0.0, 2.0),
        ('kind = "pivot"\nanchors = [[1.5, 0.0], [-1.5, 0.0]]', (3.0, 0.5), 0.0, 0.5),
        ('kind = "pivot"\nanchors = [[1.5, 0.0], [-1.5, 0.0]]', (1.5, 1.5), math.pi / 2, 0.0),
        ('kind = "slide"\nleast = 1.0\nmost = 4.0', (2.0, 0.0), 0.0, 0.0),
        ('kind = "slide"\nleast = 1.0\nmost = 4.0', (4.5, 0.0), 0.0, 0.5),
        ('kind = "slide"\nleast = 1.0\nmost = 4.0', (0.25, 0.0), 0.0, 0.75),
        (GROOVE, (0.0, 3.0), 0.0, 0.0),
        (GROOVE, (0.5, 3.0), 0.0, 0.5),
        (GROOVE, (3.0, 8.0), 0.0, 5.0),
        ('kind = "rotary_limit"\nleast = -0.5\nmost = 0.5', (9.0, 9.0), 0.75, 0.25),
        ('kind = "rotary_limit"\nleast = -0.5\nmost = 0.5', (9.0, 9.0), -0.25, 0.0),
        ('kind = "gear"\nratio = 2.0', (9.0, 9.0), 0.5, 1.0),
    ],
)
def test_joint_error_is_the_distance_from_its_constraint(joint, position, angle, error):
    assert error_at(joint, position, angle) == pytest.approx(error, abs=1e-15)  # rounding of sines of right angles


@pytest.mark.parametrize(
    "joint",
    [
        'kind = "spring"\nstiffness = 1.0', 'kind = "motor"\nrate = 1.0', 'kind = "ratchet"\nratchet = 1.0',
        'kind = "pivot"\nat = [1.5, 0.0]\nmax_force = 5.0', 'kind = "pivot"\nat = [1.5, 0.0]\nmax_bias = 0.0',
    ],
)  # fmt: skip
def test_springs_motors_and_joints_that_give_way_have_no_joint_error(joint: str) -> None:
    assert math.isnan(error_at(joint, (9.0, 9.0)))
    scene = loads(f'{TWO}[[joint]]\nbetween = ["a", "b"]\n{joint}\n')
    assert joint_error(resting_run(scene), scene) is None


def test_joint_of_a_retired_body_has_no_error() -> None:
    scene = loads(f'{TWO}[[joint]]\nkind = "rod"\nbetween = ["a", "b"]\n')
    retired = resting_run(scene, retired_time=np.array([np.nan, 2.0]))
    assert np.isnan(joint_errors(retired, scene)[:, 0]).tolist() == [False, False, True, True]


@pytest.mark.parametrize(
    ("joint", "fraction", "size"),
    [
        ('kind = "rod"', 1.0 / 3.0, 1.0),
        ('kind = "slide"\nmost = 2.0', 1.0, 2.0),
        ('kind = "pivot"\nanchors = [[1.5, 0.0], [-1.5, 0.0]]', 1.0 / math.hypot(2.0, 0.2), 1.0),
    ],
)
def test_largest_error_is_a_length_and_a_fraction_of_one(joint: str, fraction: float, size: float) -> None:
    scene = loads(f'{TWO}[[joint]]\nname = "j"\nbetween = ["a", "b"]\n{joint}\n')
    moved = resting_run(scene).position
    moved[2, 1] = (4.0, 0.0)
    found = joint_error(resting_run(scene, position=moved), scene)
    assert found is not None
    assert (found.relative, found.error) == pytest.approx((fraction, size), rel=1e-14)  # a few roundings
    assert (found.name, found.unit) == ("j", "m")


def test_largest_error_of_an_angle_is_in_rad_beside_a_smaller_length() -> None:
    joints = """[[joint]]
name = "hinge"
kind = "rotary_limit"
between = ["a", "b"]
least = -0.1
most = 0.1
[[joint]]
name = "rod"
kind = "rod"
between = ["a", "b"]
"""
    scene = loads(TWO + joints)
    turned, moved = resting_run(scene).angle, resting_run(scene).position
    turned[1, 1], moved[1, 1] = 0.5, (3.01, 0.0)
    run_ = resting_run(scene, angle=turned, position=moved)
    found = joint_error(run_, scene)
    assert found is not None
    assert (found.name, found.unit) == ("hinge", "rad")
    assert found.error == found.relative == pytest.approx(0.4, rel=1e-14)
    context = EvaluationContext(scene, None, 1.0)
    assert METRICS["joint_distance"].measure(run_, context) == pytest.approx(0.01, rel=1e-12)


def test_diverged_joint_has_infinite_error() -> None:
    scene = loads(f'{TWO}[[joint]]\nkind = "rod"\nbetween = ["a", "b"]\n')
    position = resting_run(scene).position
    position[3, 1] = np.nan
    found = joint_error(resting_run(scene, position=position), scene)
    assert found is not None
    assert (found.relative, found.error) == (math.inf, math.inf)


def test_scene_without_joints_has_no_joint_error() -> None:
    scene = loads(TWO)
    assert run(scene, audit=False).info["joint_error"] is None


@pytest.mark.parametrize("kind", ["pivot", "rod"])
def test_scale_of_an_error_does_not_depend_on_the_order_of_the_bodies_or_on_points(kind: str) -> None:
    """A plank of 0.4 m hangs by its end from the world, from a static point, or from one that moves."""
    plank = {"name": "plank", "position": [0.2, 0.0], "size": [0.4, 0.05]}
    point = {"name": "point", "position": [0.0, 0.0], "radius": 1e-9, "mass": 1.0}
    anchors, found = [[-0.2, 0.0], [0.0, 0.0]], []
    for ball in ([], [{**point, "fixed": True}], [point]):
        between = ["plank", "point"] if ball else ["plank"]
        for names, ends in ((between, anchors), (between[::-1], anchors[::-1])) if ball else ((between, anchors),):
            joint = {"kind": kind, "between": names, "anchors": ends, **({"length": 0.0} if kind == "rod" else {})}
            scene = from_document({"box": [plank], "ball": ball, "joint": [joint]})
            found += joint_scales(scene.joint_arrays, scene.bodies).tolist()
    assert found == pytest.approx([math.hypot(0.4, 0.05)] * len(found), rel=1e-12)  # rounding


def test_scale_of_an_error_of_points_is_the_longer_arm_of_their_joint() -> None:
    points = [{"name": name, "position": [x, 0.0], "radius": 1e-9} for name, x in (("a", 0.0), ("b", 2.57))]
    scene = from_document({"ball": points, "joint": [{"kind": "pivot", "between": ["a", "b"], "at": [2.57, 0.0]}]})
    assert joint_scales(scene.joint_arrays, scene.bodies).tolist() == [2.57]
