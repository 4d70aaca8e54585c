"""Faults in single values and faults between elements are reported together."""

from collections.abc import Iterable

import pytest

from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import loads

BALL = "[[ball]]\nposition = [0, 0]\nradius = 1\n"
UNDECLARED = f"{BALL}material = 'lost'\n"


def fault_paths(text: str) -> list[str]:
    with pytest.raises(SceneError) as caught:
        loads(text)
    return [fault.path for fault in caught.value.faults]


def assert_fault_paths(text: str, expected: Iterable[str]) -> None:
    assert sorted(fault_paths(text)) == sorted(expected)


@pytest.mark.parametrize(
    ("broken", "path"),
    [
        ("[world]\nseed = -1\n", "world.seed"),
        ("[solver]\ndt = 0\n", "solver.dt"),
        ("[solver]\nzzz = 0\n", "solver.zzz"),
        ("[[post]]\nposition = [0, 'x']\nradius = 1\n", "post[0].position[1]"),
        ("[[plane]]\npoint = [0, 0]\nnormal = 3\n", "plane[0].normal"),
        ("[[plane]]\npoint = [0]\nnormal = [0, 1]\n", "plane[0].point"),
        ("[[wall]]\npoints = [[0, 0], [0, 'x']]\n", "wall[0].points[1][1]"),
        ("[[wall]]\npoints = [[0, 0]]\n", "wall[0].points"),
        ("[[ball]]\nposition = [5, 5]\nradius = -1\n", "ball[1].radius"),
        ("[[ball]]\nposition = [5, 5]\nradius = 1\nname = ''\n", "ball[1].name"),
        ("[[material]]\nname = 'm'\nrestitution = 2\n", "material.m.restitution"),
        ("[[grid]]\norigin = [0, 0]\ncolumns = 0\nspacing = [1, 1]\nradius = 0.1\n", "grid[0].columns"),
        ("[[scatter]]\ncount = 0\nlower = [0, 0]\nupper = [1, 1]\nradius = 0.1\n", "scatter[0].count"),
        (
            "[[emitter]]\nposition = [0, 0]\ncount = 1\nvelocity_min = [0, 0]\nvelocity_max = 0\n",
            "emitter[0].velocity_max",
        ),
        ("[[ball]]\nradius = 1\n", "ball[1].position"),
        ("[zzz]\nx = 1\n", "zzz"),
        ("[[bal]]\nx = 1\n", "bal"),
    ],
)
def test_faulty_value_does_not_hide_a_fault_elsewhere(broken: str, path: str) -> None:
    assert_fault_paths(UNDECLARED + broken, ["ball[0].material", path])


def test_faulty_top_level_value_does_not_hide_a_fault_elsewhere() -> None:
    assert_fault_paths(f"title = 3\nzzz = 1\n{UNDECLARED}", ["title", "zzz", "ball[0].material"])


def test_several_faulty_values_of_one_element_are_all_reported() -> None:
    text = "[[ball]]\nposition = 'x'\nradius = -1\nmass = -1\nname = ''\nzzz = 1\n"
    assert_fault_paths(
        UNDECLARED + text,
        ["ball[0].material", *(f"ball[1].{key}" for key in ("position", "radius", "mass", "name", "zzz"))],
    )


def test_faulty_value_causes_no_other_fault_of_its_element() -> None:
    assert_fault_paths(f"{BALL}material = 3\nmass = 1\ndensity = 'x'\nfixed = true\nvelocity = 'x'\n", [
        "ball[0].material", "ball[0].density", "ball[0].velocity",
    ])  # fmt: skip


@pytest.mark.parametrize(
    "broken",
    [
        "[[materal]]\nname = 'lost'\n",
        "[[materials]]\nname = 'lost'\n",
        "[[material]]\nnam = 'lost'\n",
        "[material]\nname='x'",
    ],
)
def test_misspelt_material_table_is_not_also_reported_as_missing(broken: str) -> None:
    assert "ball[0].material" not in fault_paths(UNDECLARED + broken)


@pytest.mark.parametrize(
    ("text", "path"),
    [
        (
            "[[plane]]\npoint = [0, 'x']\nnormal = [0, 1]\n[[ball]]\nposition = [0, -5000]\nradius = 1\n",
            "plane[0].point[1]",
        ),
        (
            "[[plane]]\npoint = [0, -9000]\nnormal = 'x'\n[[ball]]\nposition = [0, -9999]\nradius = 1\n",
            "plane[0].normal",
        ),
        ("[world]\nduration = -1\n[solver]\ndt = 1e-9\n", "world.duration"),
        ("[world]\nduration = 1e9\n[solver]\ndt = -1\n", "solver.dt"),
        ("[[wall]]\npoints = 3\nclosed = true\n", "wall[0].points"),
        ("[[scatter]]\ncount = 9\nlower = 'x'\nupper = [-5, -5]\nradius = 1\n", "scatter[0].lower"),
        ("[[grid]]\norigin = [0, 0]\ncolumns = 999\nspacing = 0\nradius = 99\n", "grid[0].spacing"),
    ],
)
def test_default_for_a_faulty_value_causes_no_other_fault(text: str, path: str) -> None:
    assert_fault_paths(text, [path])


def test_faulty_world_does_not_hide_too_many_steps() -> None:
    assert_fault_paths(f"{BALL}[world]\nseed = -1\nduration = 1e9\n[solver]\ndt = 0.01\n", ["world.seed", "solver.dt"])


def test_default_positions_of_faulty_balls_are_not_overlaps() -> None:
    grid = "[[grid]]\norigin = [0, 0]\ncolumns = 400\nspacing = [3, 0]\nradius = 1\n"
    assert_fault_paths(
        grid + "[[ball]]\nposition = 'x'\nradius = 1\n" * 400, [f"ball[{k}].position" for k in range(400)]
    )


def test_table_of_a_wrong_type_is_reported_alone() -> None:
    assert_fault_paths(f"world = 3\n{BALL}", ["world"])
    assert_fault_paths("[ball]\nposition = [0, 0]\nradius = 1\nmaterial = 'lost'\n", ["ball"])
