"""Perturbation of a scene, and the predictability horizon that it yields."""

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
from sandbox.scene.files.load import from_document, load, loads
from sandbox.scene.files.shipped_scenes import find
from tests.runs_by_hand import run_of, scene_of
from tests.samples import each_shipped_scene

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


def displacements(scene: Scene, **options: Any) -> FloatArray:
    """Return the displacement of each body by the perturbation, (N, 2) m; the scene itself must not change."""
    before = scene.bodies
    other = perturb(scene, **options)
    assert scene.bodies is before
    return other.bodies.position - before.position


def test_bodies_that_can_collide_are_displaced_in_individual_directions() -> None:
    scene = load(find("gas"))
    offset = displacements(scene)
    # positions of 10 m have a resolution of 2e-15 m
    assert np.hypot(*offset.T) == pytest.approx(np.full(len(offset), PERTURBATION), rel=0.01)
    assert len(np.unique(np.round(np.arctan2(*offset.T), 2))) > 100  # of 225 bodies, in 349 bins of 0.01 rad
    assert (displacements(scene) == offset).all()
    assert (displacements(scene, seed=1) != offset).any(axis=1).all()
    other = perturb(scene)
    assert other.bodies.names == scene.bodies.names
    for key in ("velocity", "angle", "angular_velocity", "radius", "mass", "fixed"):
        assert np.array_equal(getattr(other.bodies, key), getattr(scene.bodies, key))
    mine, its = pair_table(scene, scene.bodies), pair_table(other.scene, other.bodies)
    assert np.array_equal(mine.restitution, its.restitution)


def test_perturbation_far_from_the_origin_is_not_lost_in_rounding() -> None:
    scene = loads("[[ball]]\nposition = [1e9, 0]\nradius = 1\n[[ball]]\nposition = [2e9, 0]\nradius = 1\n")
    assert np.abs(displacements(scene)[:, 0]).tolist() == [4 * np.spacing(1e9), 4 * np.spacing(2e9)]


RACK = "".join(
    f"[[ball]]\nname = 'r{row}-{k}'\nposition = [{row * math.sqrt(3.0) * 0.5!r}, {k - 0.5 * row!r}]\nradius = 0.5\n"
    for row in range(4)
    for k in range(row + 1)
)
FLOOR = "[[plane]]\nname = 'floor'\npoint = [0, 0]\nnormal = [0, 1]\n"
WALL = "[[plane]]\nname = 'side'\npoint = [-0.5, 0]\nnormal = [1, 0]\n"


def boxes(count: int) -> str:
    return "".join(f"[[box]]\nname = 'b{k}'\nposition = [0, {k + 0.5}]\nsize = [1, 1]\n" for k in range(count))


@pytest.mark.parametrize("reverse", [False, True])
def test_touching_balls_of_a_rack_part_by_different_gaps(reverse: bool) -> None:
    scene = loads(RACK)
    other = perturb(scene, reverse=reverse)
    pairs = [pair for pair, _ in touching_pairs(scene)]
    assert len(pairs) == 18
    positions = np.stack((scene.bodies.position, other.bodies.position))
    gaps = [np.diff(clearance(scene, scene.bodies, positions, np.zeros((2, 10)), pair))[0] for pair in pairs]
    assert min(gaps) > 0.09 * PERTURBATION  # 0.1 and rounding
    assert max(gaps) < 2.0 * PERTURBATION
    assert len(np.unique(np.round(np.divide(gaps, PERTURBATION), 2))) > 9  # rounding is 0.001 of it


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("seed", range(20))
def test_parting_discs_of_a_pyramid_on_a_floor_do_not_overlap(seed: int, reverse: bool) -> None:
    rows = [(row, k) for row in range(4) for k in range(4 - row)]
    positions = [[k + 0.5 * row, 0.5 + row * math.sqrt(0.75)] for row, k in rows]
    scene = from_document(
        {
            "plane": [{"point": [0, 0], "normal": [0, 1]}],
            "ball": [{"position": position, "radius": 0.5} for position in positions],
        }
    )
    other = perturb(scene, seed=seed, reverse=reverse)
    poses = np.stack((scene.bodies.position, other.bodies.position))
    parted = 0
    for pair, _ in touching_pairs(scene):
        gap = np.diff(clearance(scene, scene.bodies, poses, np.zeros((2, len(rows))), pair))[0]
        assert gap >= -1e-15  # rounding of positions up to 4 m
        parted += gap > 0.01 * PERTURBATION
    assert parted == 18  # all but the four contacts with the floor


def test_reversed_perturbation_of_free_bodies_is_opposite() -> None:
    scene = load(find("gas"))
    # positions of 10 m have a resolution of 2e-15 m
    assert displacements(scene, reverse=True) == pytest.approx(-displacements(scene), abs=4e-15)


def test_boxes_of_a_stack_are_displaced_along_their_contacts() -> None:
    scene = loads(FLOOR + boxes(5))
    offset = displacements(scene)
    assert (offset[:, 1] == 0.0).all()
    assert np.abs(offset[:, 0]) == pytest.approx(np.full(5, PERTURBATION), rel=1e-9)  # near 0 the resolution suffices
    assert len(set(offset[:, 0].tolist())) == 2  # to both sides, so some move relative to each other


def test_wedged_body_keeps_its_position_and_is_given_a_velocity() -> None:
    scene = loads(FLOOR + WALL + boxes(1))
    other = perturb(scene)
    assert (other.bodies.position == scene.bodies.position).all()
    assert np.hypot(*other.bodies.velocity.T) == pytest.approx([PERTURBATION], rel=1e-12)  # rounding
    assert (other.bodies.angle == scene.bodies.angle).all()


def test_polygon_without_contacts_is_rotated_too() -> None:
    scene = loads(FLOOR + "[[box]]\nposition = [0, 3]\nsize = [1, 1]\n")
    other = perturb(scene)
    # half a diagonal
    assert abs(float(other.bodies.angle[0])) == pytest.approx(PERTURBATION / math.sqrt(0.5), rel=1e-9)


STILL = ("benchmark/lift", "benchmark/projectile", "particles/smoke", "tutorial/ball", "tutorial/fireworks")
"""Shipped scenes in which nothing can collide."""
CROWDED = [each for each in each_shipped_scene() if "100k" not in each.values[0] and each.values[0] not in STILL]


@pytest.mark.parametrize("name", CROWDED)
def test_perturbation_neither_creates_overlaps_nor_breaks_contacts(name: str) -> None:
    """For every shipped scene, the clearance of touching pairs changes by rounding only."""
    scene = load(find(name))
    other = perturb(scene)
    old, new = scene.bodies, other.bodies
    for pair, _ in touching_pairs(scene):
        gaps = clearance(scene, old, np.stack((old.position, new.position)), np.stack((old.angle, new.angle)), pair)
        # about 50 units in the last place
        assert abs(gaps[1] - gaps[0]) <= 1e-14 * max(1.0, np.abs(old.position[pair[0]]).max())
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
CAGED = (
    "[[ball]]\nname = 'caged'\nposition = [10, 0.1]\nradius = 0.2\nvelocity = [1, 0.3]\nrestitution = 1.0\n"
    "[[wall]]\npoints = [[9, -1], [11, -1], [11, 1], [9, 1]]\nclosed = true\nrestitution = 1.0\n"
)


def test_isolated_ball_does_not_change_the_horizon() -> None:
    """A ball that cannot reach the crowd does not affect the horizon of the crowd."""
    crowd, more = loads(CROWD), loads(CROWD + CAGED)
    assert more.bodies.names[0] == "caged"  # balls precede a scatter
    alone, beside = (truth_of(scene, scene.solver, 1e-3) for scene in (crowd, more))
    assert alone.kind == beside.kind == "exact"
    assert 0.5 < alone.trusted_until < 5.0
    # same perturbation of the crowd; `exact` moves bodies separately
    assert beside.trusted_until == alone.trusted_until


def test_scene_without_possible_contacts_has_no_perturbation() -> None:
    assert perturb(loads("[[ball]]\nposition = [0, 0]\nradius = 1\n")) is None
    assert [perturb(load(find(name))) for name in STILL] == [None] * len(STILL)


def test_agreement_time_is_the_last_frame_before_divergence() -> None:
    scene = scene_of()
    truth = run_of(scene)
    position = truth.position.copy()
    position[7:, 0, 0] += 0.2
    assert agreement_time(truth, run_of(scene, position), scene, 0.1) == truth.time[6]
    assert agreement_time(truth, run_of(scene, position), scene, 0.3) == 2.0
    position[0, 0, 0] += 0.2
    assert agreement_time(truth, run_of(scene, position), scene, 0.1) == 0.0
