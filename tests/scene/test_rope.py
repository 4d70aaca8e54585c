"""Ropes made of rods, springs or planks."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sandbox.arrays import FloatArray
from sandbox.engines.registry import start
from sandbox.scene.compile.joint_arrays import WORLD, JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import dumps, from_document, load, loads
from sandbox.scene.files.shipped_scenes import find
from tests.scene.faults import assert_faults

ROPE = {"start": [0.0, 0.0], "end": [3.0, 4.0], "links": 5}
SPRINGS = {"kind": "springs", "stiffness": 200.0}
PLANKS = {"kind": "planks", "radius": 0.05}
BALLS = [
    {"name": "a", "position": [0.0, 0.5], "radius": 0.5, "angle": 1.0},
    {"name": "b", "position": [3.0, 4.0], "radius": 0.1},
]


def scene_of(more: dict[str, Any] | None = None, **rope: Any) -> Scene:
    return from_document({**(more or {}), "rope": [{**ROPE, **rope}]})


def gaps(scene: Scene) -> FloatArray:
    """Return the vector between the two ends of each link in the initial state, (L, 2) m."""
    first, second = scene.joint_arrays.ends(scene.bodies.position, scene.bodies.angle)
    return second - first


def test_rope_without_slack_is_straight_with_equal_links() -> None:
    scene = scene_of(name="line")
    assert scene.bodies.names == tuple(f"line-{n}" for n in range(1, 7))
    assert scene.joint_arrays.names == tuple(f"line-joint-{n}" for n in range(1, 6))
    expected = np.arange(6)[:, None] / 5 * np.array([3.0, 4.0])
    assert scene.bodies.position == pytest.approx(expected, abs=1e-15)  # rounding
    assert scene.bodies.fixed.tolist() == [True, False, False, False, False, True]
    assert scene.joint_arrays.kind.tolist() == [JointKind.ROD] * 5
    assert scene.joint_arrays.figures[:, 0].tolist() == [1.0] * 5
    assert not scene.joint_arrays.collide.any()


def test_nodes_have_the_given_mass_and_do_not_collide() -> None:
    bodies = scene_of(mass=0.25, radius=0.1, colour="#ff0000").bodies
    assert bodies.mass.tolist() == [0.25] * 6
    assert bodies.round.all()
    assert bodies.moment == pytest.approx(0.5 * 0.25 * 0.01, rel=1e-15)
    assert {element.collides for element in bodies.elements} == {"none"}
    assert {element.colour for element in bodies.elements} == {"#ff0000"}
    dense = scene_of(density=2.0, radius=0.1).bodies
    assert dense.mass == pytest.approx(2.0 * math.pi * 0.01, rel=1e-15)


@given(
    links=st.integers(2, 60), slack=st.floats(0.0, 20.0), x=st.floats(-3.0, 3.0), y=st.floats(-3.0, 3.0),
    gravity=st.sampled_from([[0.0, 0.0], [0.0, -9.81], [3.0, 1.0]]), kind=st.sampled_from(["rods", "planks"]),
)  # fmt: skip
# subnormal: too few digits for a direction
@example(links=7, slack=0.5, x=2e-313, y=2e-313, gravity=[0.0, -9.81], kind="rods")
def test_slack_rope_has_the_given_link_length_and_ends(links, slack, x, y, gravity, kind):
    length = max(math.hypot(x, y), 0.1) * (1.0 + slack)
    scene = scene_of(
        {"world": {"gravity": gravity}},
        end=[x, y],
        links=links,
        length=length,
        kind=kind,
        radius=0.001 * length / links,
    )
    bodies, pitch = scene.bodies, length / links
    rounding = 1e-13 * length  # rounding of sums of up to 60 links
    if kind == "rods":
        assert np.hypot(*gaps(scene).T) == pytest.approx(pitch, abs=rounding)
        nodes = bodies.position
    else:
        assert np.hypot(*gaps(scene).T) == pytest.approx(0.0, abs=rounding)
        turn = np.column_stack((np.cos(bodies.angle), np.sin(bodies.angle)))
        nodes = np.vstack((bodies.position - 0.5 * pitch * turn, bodies.position[-1:] + 0.5 * pitch * turn[-1:]))
    assert nodes[0] == pytest.approx(np.zeros(2), abs=rounding)
    assert nodes[-1] == pytest.approx(np.array([x, y]), abs=rounding)
    middle = nodes.mean(axis=0) - 0.5 * np.array([x, y])
    down = np.array(gravity) if any(gravity) else np.array([0.0, -1.0])
    assert middle @ down >= -rounding * math.hypot(*down)  # it hangs in the direction of gravity
    assert loads(dumps(scene)) == scene


def test_rope_with_equal_ends_is_a_regular_polygon() -> None:
    position = scene_of(end=[0.0, 0.0], links=6, length=6.0).bodies.position
    assert position[3] == pytest.approx(np.array([0.0, -2.0]), abs=1e-14)  # rounding
    assert position[[0, 6]] == pytest.approx(np.zeros((2, 2)), abs=1e-14)  # rounding


def test_springs_have_rest_lengths_of_the_rope_length_and_may_start_stretched() -> None:
    scene = scene_of(length=2.5, damping=0.3, **SPRINGS)
    assert scene.joint_arrays.kind.tolist() == [JointKind.SPRING] * 5
    assert scene.joint_arrays.figures.tolist() == [[0.5, 200.0, 0.3]] * 5
    assert np.hypot(*gaps(scene).T) == pytest.approx(1.0, abs=1e-15)  # rounding


def test_planks_are_joined_end_to_end_and_to_the_world() -> None:
    scene = scene_of(mass=2.0, **PLANKS)
    bodies, links = scene.bodies, scene.joint_arrays
    assert len(bodies) == 5
    assert not bodies.fixed.any()
    assert not bodies.round.any()
    assert bodies.angle == pytest.approx(math.atan2(4.0, 3.0), abs=1e-15)  # rounding
    assert bodies.radius == pytest.approx(0.5 + 0.05, abs=1e-15)  # half a link, and the half disc at its end
    assert links.kind.tolist() == [JointKind.PIVOT] * 6
    assert links.a.tolist() == [0, 1, 2, 3, WORLD, WORLD]
    assert links.b.tolist() == [1, 2, 3, 4, 0, 4]
    assert np.abs(gaps(scene)).max() < 1e-14  # rounding
    assert links.apart().tolist() == [[0, 1], [1, 2], [2, 3], [3, 4]]


@pytest.mark.parametrize(("fix", "fixed"), [([], []), (["start"], [0]), (["end"], [5]), (["end", "start"], [0, 5])])
def test_fix_selects_the_fixed_ends(fix: list[str], fixed: list[int]) -> None:
    assert np.flatnonzero(scene_of(fix=fix).bodies.fixed).tolist() == fixed
    assert len(scene_of(fix=fix, **PLANKS).joint_arrays) == 4 + len(fixed)


@pytest.mark.parametrize("kind", [{}, SPRINGS, PLANKS], ids=["rods", "springs", "planks"])
def test_tied_rope_is_anchored_to_bodies_at_its_ends(kind: dict[str, Any]) -> None:
    scene = scene_of({"ball": BALLS}, tie={"start": "a", "end": "b"}, **kind)
    bodies, links = scene.bodies, scene.joint_arrays
    assert not bodies.fixed.any()
    assert len(bodies) == 2 + (5 if kind is PLANKS else 4)
    first, second = links.ends(bodies.position, bodies.angle)
    ends = {body: anchor for bodies_of, anchors in ((links.a, first), (links.b, second))
            for body, anchor in zip(bodies_of.tolist(), anchors.tolist(), strict=True) if body < 2}  # fmt: skip
    assert ends[0] == pytest.approx([0.0, 0.0], abs=1e-15)  # rounding
    assert ends[1] == pytest.approx([3.0, 4.0], abs=1e-15)  # rounding
    assert np.hypot(*gaps(scene).T) == pytest.approx(0.0 if kind is PLANKS else 1.0, abs=1e-14)  # rounding


def test_single_link_between_two_bodies_has_no_nodes() -> None:
    scene = scene_of({"ball": BALLS}, links=1, tie={"start": "a", "end": "b"})
    assert scene.bodies.names == ("a", "b")
    assert scene.joint_arrays.a.tolist() == [0]
    assert scene.joint_arrays.b.tolist() == [1]
    assert scene.joint_arrays.figures[0, 0] == 5.0


def test_links_between_fixed_bodies_are_left_out() -> None:
    assert len(scene_of(links=1).joint_arrays) == 0
    fixed = [{**BALLS[0], "fixed": True}]
    assert len(scene_of({"ball": fixed}, links=1, tie={"start": "a"}).joint_arrays) == 0


def test_joints_of_the_file_precede_those_of_ropes() -> None:
    joint = {"kind": "rod", "between": ["a", "rope-1-2"], "name": "mine"}
    scene = scene_of({"ball": BALLS, "joint": [joint]})
    assert scene.joint_arrays.names == ("mine", *(f"rope-1-joint-{n}" for n in range(1, 6)))


@pytest.mark.parametrize(
    ("rope", "key", "message"),
    [
        ({"length": 4.9}, "length", "at least the distance from start to end, 5.0 m"),
        ({"length": 4.9, **PLANKS}, "length", "planks do not stretch"),
        ({"end": [0.0, 0.0]}, "end", "1e-09 to 1e+09 m"),
        ({"links": 1, "length": 6.0}, "links", "2 or more"),
        ({"kind": "springs"}, "stiffness", "is missing"),
        ({"stiffness": 3.0}, "stiffness", "is 'rods'"),
        ({"damping": 3.0, **PLANKS}, "damping", "is 'planks'"),
        ({"angle": 1.0, **PLANKS}, "angle", "remove it"),
        ({"collides": "all", **PLANKS, "radius": 0.5}, "radius", "overlap"),
        ({"collides": "all", "radius": 1.0}, "radius", "overlap"),
        ({"tie": {"end": "c"}}, "tie.end", "no body is named 'c'"),
        ({"tie": {"end": "rope-1-2"}}, "tie.end", "of the rope itself"),
        ({"tie": {"end": "b"}, "fix": ["end"]}, "fix", "not both"),
        ({"tie": {"end": "b", "start": "b"}, "links": 1}, "tie", "names one body twice"),
        ({"links": 0}, "links", "must be at least 1"),
        ({"links": 2_000_000}, "links", "must be at most 1e+06"),
        ({"kind": "wire"}, "kind", "'rods', 'springs' or 'planks'"),
        ({"fix": ["middle"]}, "fix[0]", "'start' or 'end'"),
    ],
)
def test_wrong_value_is_a_fault_with_a_hint(rope: dict[str, Any], key: str, message: str) -> None:
    assert_faults({"ball": BALLS, "rope": [{**ROPE, **rope}]}, f"rope[0].{key}: {message}")


def test_chain_comes_to_rest_with_the_sag_stated_in_its_scene() -> None:
    scene = load(find("hanging_chain"), ["solver.substeps=2", "solver.dt=0.01", "world.linear_drag=4.0"])
    simulation = start(scene, "pymunk", scene.solver)
    for _ in range(400):
        simulation.step()
    frame = simulation.frame()
    simulation.close()
    assert -frame.position[:, 1].min() == pytest.approx(0.43854, abs=2e-4)  # amplitude of the swing left after 4 s
