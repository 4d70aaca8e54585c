"""Faults in single values and faults between elements are reported together."""

from collections.abc import Iterable

import pytest

from tests.scene.faults import fault_paths

BALL = "[[ball]]\nposition = [0, 0]\nradius = 1\n"
UNDECLARED = f"{BALL}material = 'lost'\n"


def assert_fault_paths(text: str, expected: Iterable[str]) -> None:
    assert sorted(fault_paths(text)) == sorted(expected)


@pytest.mark.parametrize(
    ("broken", "paths"),
    [
        ("[world]\nseed = -1\n", "world.seed"),
        ("[solver]\ndt = 0\n", "solver.dt"),
        ("[solver]\nzzz = 0\n", "solver.zzz"),
        ("[[post]]\nposition = [0, 'x']\nradius = 1\n", "post[0].position[1]"),
        ("[[plane]]\npoint = [0]\nnormal = [0, 1]\n", "plane[0].point"),
        ("[[wall]]\npoints = [[0, 0], [0, 'x']]\n", "wall[0].points[1][1]"),
        ("[[ball]]\nposition = [5, 5]\nradius = 1\nname = ''\n", "ball[1].name"),
        ("[[material]]\nname = 'm'\nrestitution = 2\n", "material.m.restitution"),
        ("[[grid]]\norigin = [0, 0]\ncolumns = 0\nspacing = [1, 1]\nradius = 0.1\n", "grid[0].columns"),
        ("[[ball]]\nradius = 1\n", "ball[1].position"),
        ("[zzz]\nx = 1\n", "zzz"),
        ("[[bal]]\nx = 1\n", "bal"),
        ("[world]\nseed = -1\nduration = 1e9\n[solver]\ndt = 0.01\n", "world.seed solver.dt"),
        (
            "[[ball]]\nposition = 'x'\nradius = -1\nmass = -1\nname = ''\nzzz = 1\n",
            "ball[1].position ball[1].radius ball[1].mass ball[1].name ball[1].zzz",
        ),
        ("[grid]\norigin = [0, 0]\nradius = 1\ncolumns = 0\n", "grid grid.columns grid.spacing"),
        ("[post]\nposition = [5, 5]\nradius = 1\nmaterial = 'lost too'\n", "post post.material"),
        ("[solver]\nzzz = 1\n[[world]]\n", "solver.zzz world"),
        # faults behind another one of the same table
        ("[[plane]]\npoint = 'x'\nnormal = [0, 0]\n", "plane[0].point plane[0].normal"),
        ("[[wall]]\npoints = [[0, 0], [0, 0]]\nthickness = -1\n", "wall[0].thickness wall[0].points[0]"),
        ("[[wall]]\npoints = [[0, 0], [1, 0]]\nclosed = true\nzzz = 1\n", "wall[0].zzz wall[0].closed"),
        (
            "[[ball]]\nposition = [9, 9]\nradius = -1\nfixed = true\nvelocity = [1, 0]\n",
            "ball[1].radius ball[1].velocity",
        ),
        (  # a faulty value causes no other fault of its element
            f"{BALL}mass = 1\ndensity = 'x'\nfixed = true\nvelocity = 'x'\n",
            "ball[1].density ball[1].velocity",
        ),
    ],
)
def test_faulty_value_does_not_hide_a_fault_elsewhere(broken: str, paths: str) -> None:
    assert_fault_paths(UNDECLARED + broken, ["ball[0].material", *paths.split()])


@pytest.mark.parametrize(
    "broken", ["[[materal]]\nname = 'lost'\n", "[[material]]\nnam = 'lost'\n", "[material]\nname='lost'"]
)
def test_misspelt_material_table_is_not_also_reported_as_missing(broken: str) -> None:
    assert "ball[0].material" not in fault_paths(UNDECLARED + broken)


@pytest.mark.parametrize(
    ("text", "path"),
    [
        (f"[[plane]]\npoint = [0, 'x']\nnormal = [0, 1]\n{BALL.replace('[0, 0]', '[0, -5000]')}", "plane[0].point[1]"),
        (f"[[plane]]\npoint = [0, -9000]\nnormal = 'x'\n{BALL.replace('[0, 0]', '[0, -9999]')}", "plane[0].normal"),
        ("[world]\nduration = -1\n[solver]\ndt = 1e-9\n", "world.duration"),
        ("[world]\nduration = 1e9\n[solver]\ndt = -1\n", "solver.dt"),
        ("[[wall]]\npoints = 3\nclosed = true\n", "wall[0].points"),
        ("[[scatter]]\ncount = 9\nlower = 'x'\nupper = [-5, -5]\nradius = 1\n", "scatter[0].lower"),
        ("[[grid]]\norigin = [0, 0]\ncolumns = 999\nspacing = 0\nradius = 99\n", "grid[0].spacing"),
        (f"world = 3\n{BALL}", "world"),
    ],
)
def test_default_for_a_faulty_value_causes_no_other_fault(text: str, path: str) -> None:
    assert_fault_paths(text, [path])


def test_default_positions_of_faulty_balls_are_not_overlaps() -> None:
    grid = "[[grid]]\norigin = [0, 0]\ncolumns = 400\nspacing = [3, 0]\nradius = 1\n"
    assert_fault_paths(
        grid + "[[ball]]\nposition = 'x'\nradius = 1\n" * 400, [f"ball[{k}].position" for k in range(400)]
    )
