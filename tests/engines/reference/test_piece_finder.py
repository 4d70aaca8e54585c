"""PieceFinder: the same contacts whichever broad phase, found among fewer candidates by the one that fits."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sandbox
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.reference.collision import ConvexPipeline
from sandbox.scene.compile.setup import Setup
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.full  # property tests with many examples

BROAD = ("all_pairs", "circles", "sweep", "grid", "oriented")

coordinates = st.floats(-3, 3)
sizes = st.floats(0.05, 2)
turned = st.floats(-10, 10)


@st.composite
def crowds(draw):
    """Return a scene of some bodies of every shape, overlapping as they will, among fixed things."""
    document = {"ball": [], "box": [], "capsule": [], "polygon": [], "body": []}
    for k in range(draw(st.integers(1, 8))):
        kind = draw(st.sampled_from(sorted(document)))
        place = [draw(coordinates), draw(coordinates)]
        common = {"name": f"{kind} {k}", "position": place, "angle": draw(turned), "fixed": draw(st.booleans())}
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
    document = {kind: those for kind, those in document.items() if those}
    walls = [{"points": [[-2.0, -1.0], [2.0, -1.5]], "thickness": 0.1}]
    return from_document(
        document
        | {
            "wall": walls,
            "post": [{"position": [0.5, 1.0], "radius": 0.4}],
            "plane": [{"point": [0, -2], "normal": [0.1, 1]}],
        }
    )


def found(scene, broad_phase):
    store = BodyStore(Setup.of(scene), 0.01)
    finder = ConvexPipeline(store, broad_phase)
    contacts = finder.overlaps(np.column_stack((store.position, store.angle)))
    return [column.copy() for column in contacts], finder.work


@settings(deadline=None, max_examples=60)
@given(crowds())
def test_every_broad_phase_finds_the_same_contacts(scene):
    contacts, _ = found(scene, "all_pairs")
    for broad_phase in BROAD[1:]:
        others, _ = found(scene, broad_phase)
        for ours, theirs in zip(contacts, others, strict=True):
            np.testing.assert_array_equal(ours, theirs)


@settings(deadline=None, max_examples=60)
@given(crowds())
def test_contacts_are_in_the_order_of_keys_and_never_of_a_body_with_itself(scene):
    (key, first, second, normal, separation, *_), _ = found(scene, "grid")
    assert (np.diff(key) > 0).all()  # what impulses are remembered by: each its own, ascending
    assert (first != second).all()
    assert np.hypot(*normal.T) == pytest.approx(1.0, abs=1e-12)  # a division and a root
    assert (separation < 0).all()
    assert not scene.bodies.fixed[first[second < 0]].any()


@settings(deadline=None, max_examples=60)
@given(crowds())
def test_levers_end_on_both_surfaces(scene):
    """A contact as two bodies see it: their points lie apart by the separation, along the normal."""
    (_, first, second, normal, separation, point, arm, offset, *_), _ = found(scene, "all_pairs")
    two = second >= 0
    centre, left = scene.bodies.position, np.column_stack((-normal[:, 1], normal[:, 0]))
    ours = centre[first] + arm[:, :1] * normal + offset[:, :1] * left
    theirs = centre[second[two]] - arm[two, 1:] * normal[two] + offset[two, 1:] * left[two]
    np.testing.assert_allclose(theirs - ours[two], separation[two, None] * normal[two], atol=1e-13)  # sums of metres
    np.testing.assert_allclose(ours + 0.5 * separation[:, None] * normal, point, atol=1e-13)


def planks(count=40):
    """Return long planks side by side, like the sheets of a book, a hair apart."""
    boxes = [
        {"position": [0.13 * k, 0.0], "size": [0.1, 5.0], "angle": 0.0, "name": f"plank {k}"} for k in range(count)
    ]
    return from_document({"box": boxes})


def test_the_test_that_fits_looks_at_least():
    """The tutorial's claim, by counts: discs around planks hold 26 neighbours each, boxes along them none."""
    looked = {}
    for broad_phase in ("circles", "oriented"):
        store = BodyStore(Setup.of(planks()), 0.01)
        finder = ConvexPipeline(store, broad_phase)
        finder.overlaps(np.column_stack((store.position, store.angle)))
        looked[broad_phase] = finder.work["pair_tests"]
    assert looked["oriented"] == 0
    assert looked["circles"] == sum(1 for i in range(40) for j in range(i) if 0.13 * (i - j) <= math.hypot(0.1, 5.0))


def test_joined_bodies_do_not_meet_unless_they_collide():
    box = {"size": [1.0, 1.0]}
    document = {"box": [{**box, "name": "a", "position": [0, 0]}, {**box, "name": "b", "position": [0.8, 0]}]}
    joint = {"kind": "pivot", "between": ["a", "b"], "at": [0.4, 0.0]}
    assert not len(found(from_document(document | {"joint": [joint]}), "all_pairs")[0][0])
    assert len(found(from_document(document | {"joint": [{**joint, "collide": True}]}), "all_pairs")[0][0]) == 2


@pytest.mark.parametrize("broad_phase", BROAD)
def test_a_heap_of_all_shapes_settles_alike(broad_phase):
    """State for state: the broad phase is a matter of speed alone."""
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
    done = sandbox.run(scene, "reference", dt=0.002, broad_phase=broad_phase, record_every=100)
    plain = sandbox.run(scene, "reference", dt=0.002, broad_phase="all_pairs", record_every=100)
    assert done.info["state_hash"] == plain.info["state_hash"]
    assert np.abs(done.velocity[-1]).max() < 0.5  # it has come down
    assert done.position[-1, :, 1].min() > 0.1  # and nothing fell through the floor


@pytest.mark.parametrize("broad_phase", BROAD[:-1])
def test_joined_balls_do_not_meet_whatever_the_broad_phase(broad_phase):
    """Three balls in a row from right to left, so that sorting them changes their order; the outer two are joined."""
    balls = [{"name": f"{k}", "position": [-0.5 * k, 0.0], "radius": 0.6, "mass": 1.0 + k} for k in range(3)]
    joint = {"kind": "rod", "between": ["0", "2"]}
    scene = from_document({"world": {"duration": 0.1}, "ball": balls, "joint": [joint]})
    done = sandbox.run(scene, "reference", dt=0.01, broad_phase=broad_phase)
    assert {tuple(pair) for pair in done.contact_pair.tolist()} == {(0, 1), (1, 2)}
