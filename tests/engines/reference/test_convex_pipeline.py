"""ConvexPipeline: every broad phase finds the same contacts; a suitable one tests fewer candidates."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sandbox
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.reference.collision import ConvexPipeline
from sandbox.scene.compile.setup import Setup
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

BROAD_PHASES = ("all_pairs", "circles", "sweep", "grid", "oriented")

coordinates = st.floats(-3, 3)
sizes = st.floats(0.05, 2)
angles = st.floats(-10, 10)


@st.composite
def crowds(draw):
    """Draw a scene of bodies of every shape, possibly overlapping, among static shapes."""
    document = {"ball": [], "box": [], "capsule": [], "polygon": [], "body": []}
    for k in range(draw(st.integers(1, 8))):
        kind = draw(st.sampled_from(sorted(document)))
        position = [draw(coordinates), draw(coordinates)]
        common = {"name": f"{kind} {k}", "position": position, "angle": draw(angles), "fixed": draw(st.booleans())}
        a, b = draw(sizes), draw(sizes)
        document[kind].append(
            common
            | {
                "ball": {"radius": a},
                "box": {"size": [a, b]},
                "capsule": {"length": a, "radius": b},
                "polygon": {"points": [[0, 0], [a, 0], [a, b], [0.4 * a, 0.4 * b], [0, b]]},
                "body": {"ball": [{"radius": a}], "box": [{"size": [b, a], "position": [a, 0.0], "angle": 0.5}]},
            }[kind]
        )
    document = {kind: bodies for kind, bodies in document.items() if bodies}
    walls = [{"points": [[-2.0, -1.0], [2.0, -1.5]], "thickness": 0.1}]
    return from_document(
        document
        | {
            "wall": walls,
            "post": [{"position": [0.5, 1.0], "radius": 0.4}],
            "plane": [{"point": [0, -2], "normal": [0.1, 1]}],
        }
    )


def find_contacts(scene, broad_phase):
    store = BodyStore(Setup.of(scene), 0.01)
    finder = ConvexPipeline(store, broad_phase)
    contacts = finder.overlaps(np.column_stack((store.position, store.angle)))
    return [column.copy() for column in contacts], finder.work


@given(crowds())
def test_every_broad_phase_finds_the_same_contacts(scene):
    contacts, _ = find_contacts(scene, "all_pairs")
    for broad_phase in BROAD_PHASES[1:]:
        others, _ = find_contacts(scene, broad_phase)
        for ours, theirs in zip(contacts, others, strict=True):
            np.testing.assert_array_equal(ours, theirs)


@given(crowds())
def test_contacts_are_sorted_by_key_and_never_within_one_body(scene):
    (key, first, second, normal, separation, *_), _ = find_contacts(scene, "grid")
    assert (np.diff(key) > 0).all()  # keys identify impulses across steps: unique and ascending
    assert (first != second).all()
    assert np.hypot(*normal.T) == pytest.approx(1.0, abs=1e-12)  # a division and a root
    assert (separation < 0).all()
    assert not scene.bodies.fixed[first[second < 0]].any()


@given(crowds())
def test_lever_arms_end_on_both_surfaces(scene):
    """The contact points on the two bodies differ by the separation along the normal."""
    (_, first, second, normal, separation, point, arm, offset, *_), _ = find_contacts(scene, "all_pairs")
    two = second >= 0
    centre, left = scene.bodies.position, np.column_stack((-normal[:, 1], normal[:, 0]))
    ours = centre[first] + arm[:, :1] * normal + offset[:, :1] * left
    theirs = centre[second[two]] - arm[two, 1:] * normal[two] + offset[two, 1:] * left[two]
    np.testing.assert_allclose(theirs - ours[two], separation[two, None] * normal[two], atol=1e-13)  # sums of metres
    np.testing.assert_allclose(ours + 0.5 * separation[:, None] * normal, point, atol=1e-13)


def planks(count=40):
    """Return long parallel planks with small gaps between them."""
    boxes = [
        {"position": [0.13 * k, 0.0], "size": [0.1, 5.0], "angle": 0.0, "name": f"plank {k}"} for k in range(count)
    ]
    return from_document({"box": boxes})


def test_oriented_boxes_need_the_fewest_pair_tests_for_planks():
    """The tutorial's claim in counts: bounding circles of planks overlap 26 neighbours each, oriented boxes none."""
    pair_tests = {}
    for broad_phase in ("circles", "oriented"):
        store = BodyStore(Setup.of(planks()), 0.01)
        finder = ConvexPipeline(store, broad_phase)
        finder.overlaps(np.column_stack((store.position, store.angle)))
        pair_tests[broad_phase] = finder.work["pair_tests"]
    assert pair_tests["oriented"] == 0
    assert pair_tests["circles"] == sum(
        1 for i in range(40) for j in range(i) if 0.13 * (i - j) <= math.hypot(0.1, 5.0)
    )


def test_jointed_bodies_do_not_collide_unless_enabled():
    box = {"size": [1.0, 1.0]}
    document = {"box": [{**box, "name": "a", "position": [0, 0]}, {**box, "name": "b", "position": [0.8, 0]}]}
    joint = {"kind": "pivot", "between": ["a", "b"], "at": [0.4, 0.0]}
    assert not len(find_contacts(from_document(document | {"joint": [joint]}), "all_pairs")[0][0])
    assert len(find_contacts(from_document(document | {"joint": [{**joint, "collide": True}]}), "all_pairs")[0][0]) == 2


@pytest.mark.parametrize("broad_phase", BROAD_PHASES)
def test_heap_of_all_shapes_settles_identically_on_every_broad_phase(broad_phase):
    """The state hashes are equal: the broad phase affects speed only."""
    bodies = {
        "ball": [{"name": "ball", "position": [0.1, 0.4], "radius": 0.3}],
        "box": [{"name": "box", "position": [0.0, 1.3], "size": [0.8, 0.5], "angle": 0.3}],
        "capsule": [{"name": "capsule", "position": [0.2, 2.0], "length": 0.6, "radius": 0.2, "angle": 1.0}],
        "polygon": [
            {"name": "L", "position": [-0.6, 2.6], "points": [[0, 0], [1, 0], [1, 0.4], [0.4, 0.4], [0.4, 1], [0, 1]]}
        ],
    }
    scene = from_document(
        {
            "world": {"gravity": [0.0, -9.81], "duration": 2.0},
            "wall": [{"points": [[-2, 3], [-2, 0], [2, 0], [2, 3]], "friction": 0.5, "restitution": 0.2}],
            **bodies,
        }
    )
    run = sandbox.run(scene, "reference", dt=0.002, broad_phase=broad_phase, record_every=100)
    expected = sandbox.run(scene, "reference", dt=0.002, broad_phase="all_pairs", record_every=100)
    assert run.info["state_hash"] == expected.info["state_hash"]
    assert np.abs(run.velocity[-1]).max() < 0.5  # it has come down
    assert run.position[-1, :, 1].min() > 0.1  # and nothing fell through the floor


@pytest.mark.parametrize("broad_phase", BROAD_PHASES[:-1])
def test_jointed_balls_do_not_collide_on_any_broad_phase(broad_phase):
    """Three balls in a row from right to left, so that sorting changes their order; a rod joins the outer two."""
    balls = [{"name": f"{k}", "position": [-0.5 * k, 0.0], "radius": 0.6, "mass": 1.0 + k} for k in range(3)]
    joint = {"kind": "rod", "between": ["0", "2"]}
    scene = from_document({"world": {"duration": 0.1}, "ball": balls, "joint": [joint]})
    run = sandbox.run(scene, "reference", dt=0.01, broad_phase=broad_phase)
    assert {tuple(pair) for pair in run.contact_pair.tolist()} == {(0, 1), (1, 2)}
