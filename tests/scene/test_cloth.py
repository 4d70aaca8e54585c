"""Cloth: a grid of nodes joined by springs or rods."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.scene.compile.joint_arrays import JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import dumps, from_document, loads
from tests.scene.faults import assert_faults

CLOTH = {"corner": [1.0, 2.0], "columns": 4, "rows": 3, "spacing": [0.5, 0.25], "stiffness": 100.0, "damping": 0.1}


def scene_of(**cloth: Any) -> Scene:
    return from_document({"cloth": [document_of(**cloth)]})


def document_of(**cloth: Any) -> dict[str, Any]:
    return {key: value for key, value in {**CLOTH, **cloth}.items() if value is not None}


def test_nodes_are_numbered_along_rows_from_the_upper_left() -> None:
    bodies = scene_of(name="flag").bodies
    assert bodies.names == tuple(f"flag-{n}" for n in range(1, 13))
    assert bodies.position[[0, 3, 4, 11]].tolist() == [[1.0, 2.0], [2.5, 2.0], [1.0, 1.75], [2.5, 1.5]]
    assert bodies.round.all()
    assert bodies.mass.tolist() == [1.0] * 12


def test_springs_join_neighbours_at_their_rest_length() -> None:
    scene = scene_of(pins=[])
    bodies, links = scene.bodies, scene.joint_arrays
    assert links.kind.tolist() == [JointKind.SPRING] * 17
    pairs = {tuple(pair) for pair in np.column_stack((links.a, links.b)).tolist()}
    grid = np.arange(12).reshape(3, 4)
    across = set(zip(grid[:, :-1].ravel().tolist(), grid[:, 1:].ravel().tolist(), strict=True))
    down = set(zip(grid[:-1].ravel().tolist(), grid[1:].ravel().tolist(), strict=True))
    assert pairs == across | down
    length = np.hypot(*(bodies.position[links.a] - bodies.position[links.b]).T)
    assert links.figures[:, 0].tolist() == length.tolist()
    assert links.figures[:, 1:].tolist() == [[100.0, 0.1]] * 17


@given(
    columns=st.integers(1, 9), rows=st.integers(1, 9), shear=st.sampled_from([None, 3.0]),
    bend=st.sampled_from([None, 5.0]), kind=st.sampled_from(["springs", "rods"]),
    pins=st.sampled_from(["top", "left", "corners", []]), width=st.floats(0.01, 10.0), height=st.floats(0.01, 10.0),
)  # fmt: skip
def test_every_link_starts_at_rest_length_and_their_number_is_right(
    columns: int, rows: int, shear: float | None, bend: float | None, kind: str, pins: Any, width: float, height: float
) -> None:
    coefficients = {"stiffness": 100.0, "damping": 0.1} if kind == "springs" else {"stiffness": None, "damping": None}
    scene = scene_of(
        columns=columns,
        rows=rows,
        shear=shear,
        bend=bend,
        kind=kind,
        pins=pins,
        spacing=[width, height],
        **coefficients,
    )
    bodies, links = scene.bodies, scene.joint_arrays
    length = np.hypot(*(bodies.position[links.a] - bodies.position[links.b]).T)
    assert links.figures[:, 0] == pytest.approx(length, rel=1e-12)  # rounding of positions, 100 links from the corner
    assert not (bodies.fixed[links.a] & bodies.fixed[links.b]).any()
    pinned = {"top": columns, "left": rows, "corners": min(columns, 2)}[pins] if pins else 0
    assert bodies.fixed.sum() == pinned
    if not pins:
        c, r = columns, rows
        expected = (c - 1) * r + c * (r - 1)
        expected += 0 if shear is None else 2 * (c - 1) * (r - 1)
        expected += 0 if bend is None else max(c - 2, 0) * r + c * max(r - 2, 0)
        assert len(links) == expected
    assert (len(bodies.elements), len(set(links.names))) == (1, len(links))
    assert loads(dumps(scene)) == scene


def test_shear_and_bend_springs_have_their_own_stiffness() -> None:
    links = scene_of(pins=[], kind="rods", stiffness=None, shear=3.0, bend=5.0).joint_arrays
    assert np.unique(links.figures[links.kind == JointKind.ROD, 1]).tolist() == [0.0]
    springs = links.figures[links.kind == JointKind.SPRING]
    diagonal = springs[:, 1] == 3.0
    assert springs[diagonal, 0] == pytest.approx(math.hypot(0.5, 0.25), rel=1e-15)
    assert set(springs[~diagonal, 0].tolist()) == {1.0, 0.5}
    assert set(springs[~diagonal, 1].tolist()) == {5.0}


@pytest.mark.parametrize(
    ("pins", "fixed"),
    [("top", [0, 1, 2, 3]), ("left", [0, 4, 8]), ("corners", [0, 3]), ([[1, 2], [3, 0]], [3, 9]), ([], [])],
)
def test_pinned_nodes_are_fixed_and_have_no_links_to_each_other(pins: Any, fixed: list[int]) -> None:
    scene = scene_of(pins=pins, velocity=[1.0, 2.0])
    assert np.flatnonzero(scene.bodies.fixed).tolist() == fixed
    assert {tuple(v) for v in scene.bodies.velocity[fixed].tolist()} <= {(0.0, 0.0)}
    loose = np.delete(scene.bodies.velocity, fixed, axis=0)
    assert loose.tolist() == [[1.0, 2.0]] * len(loose)
    links = scene.joint_arrays
    assert not np.isin(links.a, fixed)[np.isin(links.b, fixed)].any()


@pytest.mark.parametrize(
    ("cloth", "key", "message"),
    [
        ({"pins": [[0, 0], [4, 0]]}, "pins[1]", "last node is [3, 2]"),
        ({"pins": [[0, 3]]}, "pins[0]", "outside the cloth"),
        ({"pins": "bottom"}, "pins", "'top', 'corners', 'left'"),
        ({"pins": [[0, -1]]}, "pins", "'top', 'corners', 'left'"),
        ({"stiffness": None}, "stiffness", "is missing"),
        ({"kind": "rods", "damping": None}, "stiffness", "is 'rods'"),
        ({"kind": "rods", "stiffness": None}, "damping", "is 'rods'"),
        ({"collides": "all", "radius": 0.2}, "radius", "at most 0.125 m"),
        ({"columns": 1001, "rows": 1000}, "", "the limit is 1,000,000"),
        ({"spacing": [0.0, 1.0]}, "spacing[0]", "must be greater than 0"),
    ],
)
def test_wrong_value_is_a_fault_with_a_hint(cloth: dict[str, Any], key: str, message: str) -> None:
    assert_faults({"cloth": [document_of(**cloth)]}, f"{f'cloth[0].{key}'.removesuffix('.')}: {message}")
