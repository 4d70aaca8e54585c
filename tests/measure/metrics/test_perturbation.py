"""Horizon: what a nudge is, and where it comes to matter."""

import math
from typing import Any

import numpy as np
import pytest

from sandbox.arrays import FloatArray
from sandbox.engines.registry import ENGINES
from sandbox.measure.compare.ground_truth import truth_of
from sandbox.measure.metrics.clearance import clearance
from sandbox.measure.metrics.perturbation import PERTURBATION, agreement_time, perturb, touching_pairs
from sandbox.scene.compile.contacts import pair_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find, shipped
from tests.runs_by_hand import run_of, scene_of

pytestmark = pytest.mark.full  # long runs and sweeps


def moved(scene: Scene, **options: Any) -> FloatArray:
    """Return by how much each body of a scene is moved, (N, 2) m; the scene itself stays as it was."""
    before = scene.bodies
    other = perturb(scene, **options)
    assert other is not None
    assert scene.bodies is before
    return other.bodies.position - before.position


def test_every_body_that_can_meet_something_is_moved_in_a_direction_of_its_own() -> None:
    scene = load(find("gas"))
    away = moved(scene)
    assert np.hypot(*away.T) == pytest.approx(
        np.full(len(away), PERTURBATION), rel=0.01
    )  # places of 10 m have 2e-15 m digits
    assert len(np.unique(np.round(np.arctan2(*away.T), 2))) > 100  # of 225, in a quarter of 628 steps of 0.01 rad each
    assert (moved(scene) == away).all()
    assert (moved(scene, seed=1) != away).any(axis=1).all()


def test_nudge_far_out_is_not_lost_in_rounding() -> None:
    scene = loads("[[ball]]\nposition = [1e9, 0]\nradius = 1\n[[ball]]\nposition = [2e9, 0]\nradius = 1\n")
    assert np.abs(moved(scene)[:, 0]).tolist() == [4 * np.spacing(1e9), 4 * np.spacing(2e9)]


RACK = "".join(
    f"[[ball]]\nname = 'r{row}-{k}'\nposition = [{row * math.sqrt(3.0) * 0.5!r}, {k - 0.5 * row!r}]\nradius = 0.5\n"
    for row in range(4)
    for k in range(row + 1)
)
FLOOR = "[[plane]]\nname = 'floor'\npoint = [0, 0]\nnormal = [0, 1]\n"
WALL = "[[plane]]\nname = 'side'\npoint = [-0.5, 0]\nnormal = [1, 0]\n"


def boxes(count: int) -> str:
    return "".join(f"[[box]]\nname = 'b{k}'\nposition = [0, {k + 0.5}]\nsize = [1, 1]\n" for k in range(count))


def test_a_rack_whose_balls_touch_moves_as_one() -> None:
    away = moved(loads(RACK + "[[ball]]\nname = 'cue'\nposition = [-5, 0]\nradius = 0.5\n"))
    assert (away[:-1] == away[0]).all()
    assert (away[-1] != away[0]).any()


def test_boxes_of_a_stack_move_along_their_contacts() -> None:
    scene = loads(FLOOR + boxes(5))
    away = moved(scene)
    assert (away[:, 1] == 0.0).all()
    assert np.abs(away[:, 0]) == pytest.approx(np.full(5, PERTURBATION), rel=1e-9)  # beside 0 there is room for digits
    assert len(set(away[:, 0].tolist())) == 2  # to either side, so some move against each other


def test_what_is_wedged_keeps_its_place_and_is_given_a_velocity() -> None:
    scene = loads(FLOOR + WALL + boxes(1))
    other = perturb(scene)
    assert other is not None
    assert (other.bodies.position == scene.bodies.position).all()
    assert np.hypot(*other.bodies.velocity.T) == pytest.approx([PERTURBATION], rel=1e-12)  # rounding
    assert (other.bodies.angle == scene.bodies.angle).all()


def test_a_polygon_that_touches_nothing_is_turned_too() -> None:
    scene = loads(FLOOR + "[[box]]\nposition = [0, 3]\nsize = [1, 1]\n")
    other = perturb(scene)
    assert other is not None
    assert abs(float(other.bodies.angle[0])) == pytest.approx(
        PERTURBATION / math.sqrt(0.5), rel=1e-9
    )  # half a diagonal


@pytest.mark.parametrize("name", [each.name for each in shipped() if "100k" not in each.name])
def test_no_perturbation_brings_an_overlap_or_takes_a_contact(name: str) -> None:
    """Law, for every shipped scene: gaps between things that touch change by rounding and no more."""
    scene = load(find(name))
    other = perturb(scene)
    if other is None:
        return
    old, new = scene.bodies, other.bodies
    for pair, _ in touching_pairs(scene):
        gaps = clearance(scene, old, np.stack((old.position, new.position)), np.stack((old.angle, new.angle)), pair)
        assert abs(gaps[1] - gaps[0]) <= 1e-14 * max(1.0, np.abs(old.position[pair[0]]).max())  # some 50 last digits
    if not ENGINES["exact"].missing(scene, scene.solver):
        assert ENGINES["exact"].missing(other, scene.solver) == ()


CROWD = """
[world]
duration = 6.0
seed = 3
[solver]
dt = 0.005
[[scatter]]
name = "crowd"
count = 40
lower = [-1.7, -1.7]
upper = [1.7, 1.7]
radius = 0.1
restitution = 1.0
velocity_jitter = 2.0
[[wall]]
points = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]
closed = true
restitution = 1.0
"""
APART = {
    "far": "[[ball]]\nname = 'far'\nposition = [30, 0.1]\nradius = 0.2\nvelocity = [1, 0.3]\n",
    "caged": "[[ball]]\nname = 'caged'\nposition = [10, 0.1]\nradius = 0.2\nvelocity = [1, 0.3]\nrestitution = 1.0\n"
    "[[wall]]\npoints = [[9, -1], [11, -1], [11, 1], [9, 1]]\nclosed = true\nrestitution = 1.0\n",
}


@pytest.mark.parametrize("apart", APART)
def test_a_ball_that_meets_nothing_changes_no_horizon(apart: str) -> None:
    """Law: what another ball does in a place of its own says nothing of a crowd."""
    crowd, more = loads(CROWD), loads(CROWD + APART[apart])
    assert more.bodies.names[0] == apart  # balls stand before a scatter
    alone, beside = (truth_of(scene, scene.solver, 1e-3) for scene in (crowd, more))
    assert alone is not None
    assert beside is not None
    assert alone.kind == beside.kind == "exact"
    assert 0.5 < alone.trusted_until < 5.0
    assert beside.trusted_until == alone.trusted_until  # the crowd is perturbed alike, and `exact` moves each by itself


def test_scene_in_which_nothing_can_meet_has_no_nudge() -> None:
    assert perturb(loads("[[ball]]\nposition = [0, 0]\nradius = 1\n")) is None


def test_perturbation_changes_places_and_nothing_else() -> None:
    scene = load(find("gas"))
    other = perturb(scene)
    assert other is not None
    old, new = scene.bodies, other.bodies
    assert new.names == old.names
    for key in ("velocity", "angle", "angular_velocity", "radius", "mass", "fixed"):
        assert np.array_equal(getattr(new, key), getattr(old, key))
    mine, its = pair_table(scene, old), pair_table(other.scene, new)
    assert np.array_equal(mine.restitution, its.restitution)


def test_runs_agree_until_the_last_frame_before_they_part() -> None:
    scene = scene_of()
    truth = run_of(scene)
    position = truth.position.copy()
    position[7:, 0, 0] += 0.2
    assert agreement_time(truth, run_of(scene, position), scene, 0.1) == truth.time[6]
    assert agreement_time(truth, run_of(scene, position), scene, 0.3) == 2.0
    position[0, 0, 0] += 0.2
    assert agreement_time(truth, run_of(scene, position), scene, 0.1) == 0.0


def test_chaos_ends_the_trust_before_the_end() -> None:
    """A ball among pegs: each bounce multiplies 1e-12 m by some ten, so that twenty are beyond knowing."""
    pegs = "".join(
        f"[[post]]\nposition = [{x + 0.5 * (y % 2)}, {y}]\nradius = 0.35\nrestitution = 1.0\n"
        for x in range(-3, 4)
        for y in range(-3, 4)
    )
    ball = "[[ball]]\nname = 'a'\nposition = [0.5, 0.13]\nvelocity = [2.0, 1.1]\nradius = 0.1\n"
    scene = loads(f"[world]\nduration = 6.0\n[solver]\ndt = 0.01\n{ball}{pegs}")
    truth = truth_of(scene, scene.solver, 1e-3)
    assert truth is not None
    assert 0.1 < truth.trusted_until < 6.0
    assert truth.kind != "closed_form"
