"""Static stacks of boxes: which ones have a closed form, and which loads their contacts carry."""

import math

import numpy as np
import pytest

from sandbox.measure.analytic import solution
from sandbox.measure.analytic.trajectory import solved_run
from sandbox.scene.compile.scene import Scene
from tests.measure.analytic.oracle import scene_of, solution_of

FLOOR = "[[plane]]\npoint = [0.0, 0.0]\nnormal = [0.0, 1.0]\n"
WORLD = "gravity = [0.0, -10.0]\nduration = 2.0"


def box(x: float, y: float, width: float = 1.0, height: float = 1.0, extra: str = "") -> str:
    return f"[[box]]\nposition = [{x!r}, {y!r}]\nsize = [{width!r}, {height!r}]\n{extra}"


def static_scene(*boxes: str, world: str = WORLD, floor: str = FLOOR) -> Scene:
    return scene_of(floor, *boxes, world=world)


def stack(columns: int, rows: int, fewer: int, extra: str = "") -> str:
    return (
        f"[[stack]]\nbase = [0.3, 0.0]\nsize = [0.4, 0.2]\ncolumns = {columns}\nrows = {rows}\nfewer = {fewer}\n{extra}"
    )


@pytest.mark.parametrize(("columns", "rows", "fewer"), [(1, 20, 0), (10, 10, 1), (6, 4, 1), (4, 3, 0), (9, 4, 2)])
def test_stack_at_rest_keeps_its_positions(columns: int, rows: int, fewer: int) -> None:
    scene = static_scene(stack(columns, rows, fewer))
    form = solved_run(scene, scene.solver)
    assert (form.position == scene.bodies.position).all()
    assert not form.velocity.any()


def test_tower_carries_its_weight_from_row_to_row() -> None:
    scene = static_scene(stack(1, 20, 0, "mass = 3.0\n"))
    form = solved_run(scene, scene.solver)
    assert form.contact_pair[0].tolist() == [0, -1]
    assert form.contact_impulse[0] == pytest.approx([0.0, -20 * 3.0 * 10.0 * 2.0], rel=1e-14)  # a sum of 20
    above = dict(zip(map(tuple, form.contact_pair.tolist()), form.contact_impulse, strict=True))
    assert above[18, 19] == pytest.approx([0.0, 60.0], rel=1e-14)  # box 18 pushes up box 19, the top one


def test_statically_indeterminate_contact_impulses_are_nan() -> None:
    scene = static_scene(stack(2, 2, 1))
    form = solved_run(scene, scene.solver)
    assert {tuple(pair) for pair in form.contact_pair.tolist()} == {(0, -1), (1, -1), (0, 1), (0, 2), (1, 2)}
    assert np.isnan(form.contact_impulse).any(axis=1).all()


def test_overhang_is_stable_while_its_centre_of_mass_is_above_its_support() -> None:
    assert solution(static_scene(box(0.0, 0.5), box(0.49, 1.5))) is not None
    assert solution(static_scene(box(0.0, 0.5), box(0.51, 1.5))) is None
    assert solution(static_scene(box(0.0, 0.5), box(0.5, 1.5))) is None  # on the edge
    # Each overhang is stable alone, but the common centre of mass at 0.6 is past the edge.
    assert solution(static_scene(box(0.0, 0.5), box(0.4, 1.5), box(0.8, 2.5))) is None
    # A counterweight at the back balances it.
    weight = box(0.0, 2.5, 0.4, extra="mass = 9.0\n")
    assert solution(static_scene(box(0.0, 0.5), box(0.4, 1.5), box(0.8, 2.5), weight)) is not None


def test_beam_rests_on_two_supports() -> None:
    scene = static_scene(box(-2.0, 0.5), box(2.0, 0.5), box(0.5, 1.1, 5.0, 0.2))
    assert solution_of(scene).about == "boxes that stand"
    assert solution(static_scene(box(-2.0, 0.5), box(2.0, 0.5), box(2.6, 1.1, 5.0, 0.2))) is None


def test_slope_perpendicular_to_gravity_counts_as_level() -> None:
    sin, cos = math.sin(0.3), math.cos(0.3)
    tilted_stack = "[[stack]]\nbase = [0.0, 0.0]\nsize = [0.4, 0.2]\ncolumns = 1\nrows = 5\nangle = 0.3\n"
    floor = f"[[plane]]\npoint = [0.0, 0.0]\nnormal = [{-sin!r}, {cos!r}]\n"
    world = f"gravity = [{10 * sin!r}, {-10 * cos!r}]\nduration = 2.0"
    assert solution(static_scene(tilted_stack, world=world, floor=floor)) is not None
    assert solution(static_scene(tilted_stack, floor=floor)) is None


@pytest.mark.parametrize(
    "scene",
    [
        static_scene(box(0.0, 0.5), box(0.0, 1.501)),
        static_scene(box(0.0, 0.5), box(0.0, 1.499)),
        static_scene(box(0.0, 0.5), box(0.0, 1.5, extra="angle = 0.001\n")),
        static_scene(box(0.0, 0.5), box(0.0, 1.5, extra="velocity = [0.0, 0.001]\n")),
        static_scene(box(0.0, 0.5), box(0.0, 1.5), "[[ball]]\nposition = [3.0, 0.5]\nradius = 0.5\n"),
        static_scene(box(0.0, 0.5), box(0.0, 1.5), "[[post]]\nposition = [5.0, 0.5]\nradius = 0.5\n"),
        static_scene(box(0.0, 0.5), box(0.0, 1.5), world=WORLD + "\nlinear_drag = 0.1\nwind = [1.0, 0.0]"),
        static_scene(box(0.0, 0.5), box(0.0, 1.5, extra="collides = 'fixed'\n")),
        static_scene(box(0.0, 0.5), box(0.0, 1.5), "[[joint]]\nkind = 'rod'\nbetween = ['box-1', 'box-2']\n"),
        static_scene(box(0.0, 0.5), box(0.0, 1.5), "[[thrust]]\nbody = 'box-2'\nforce = [1.0, 0.0]\n"),
        static_scene(box(0.0, 0.5), box(0.9, 0.5)),
        static_scene(box(0.0, 0.5), box(0.0, 1.5), world="gravity = [0.1, -10.0]"),
    ],
    ids=["hovering", "overlapping", "tilted", "moving", "a ball", "a post", "wind", "through the other", "a rod",
         "a thrust", "side by side in each other", "gravity aslant"],
)  # fmt: skip
def test_scene_with_boxes_that_may_move_has_no_closed_form(scene: Scene) -> None:
    assert solution(scene) is None
