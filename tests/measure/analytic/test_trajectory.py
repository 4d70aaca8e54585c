"""Closed-form runs of whole scenes: which scenes have one, and its contacts, frames and retirements."""

import numpy as np
import pytest

from sandbox.measure.analytic.trajectory import frame_times, solved_run
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads

GROUND = "[[plane]]\nname = 'ground'\npoint = [0, 0]\nnormal = [0, 1]\n"


def drop_scene(extra: str = "", ground: str = GROUND, world: str = "", solver: str = "dt = 0.01") -> Scene:
    ball = "[[ball]]\nname = 'a'\nposition = [0, 5.5]\nradius = 0.5\nmass = 2.0\n"
    head = f"[world]\ngravity = [0.0, -10.0]\nduration = 6.0\n{world}\n[solver]\n{solver}\n"
    return loads(f"{head}{ground}{ball}{extra}")


def test_bounces_have_the_times_and_impulses_of_the_formula() -> None:
    scene = drop_scene("restitution = 0.5")
    form = solved_run(scene, scene.solver)
    # From 5 m at g = 10: at 1 s with 10 m/s, then flights of 1, ½, ¼ … s; over at 3 s.
    expected = [1.0, 2.0, 2.5, 2.75, 2.875, 2.9375, 2.96875, 2.984375]
    assert form.contact_time == pytest.approx(expected, rel=1e-14)  # a sum of eight numbers, exact except for the root
    impulses = [2.0 * 1.5 * 10.0 / 2**n for n in range(7)]
    # The last row includes the rest: the remaining impact speed of 10/128 m/s, and the weight from then on.
    impulses.append(2.0 * (10.0 / 128.0 + 10.0 * (6.0 - 2.984375)))
    assert form.contact_impulse[:, 1] == pytest.approx([-j for j in impulses], rel=1e-12)  # likewise
    assert form.contact_impulse[:, 0].tolist() == [0.0] * 8
    assert form.contact_point.tolist() == [[0.0, 0.0]] * 8
    assert form.contact_pair.tolist() == [[0, -1]] * 8


@pytest.mark.parametrize(
    "solver", ["dt = 0.01", "dt = 0.07", "dt = 0.07\nrecord_every = 4", "dt = 0.5\nrecord_every = 5"]
)
def test_frame_times_are_those_of_an_engine(solver: str) -> None:
    scene = drop_scene("restitution = 0.5", solver=solver)
    assert np.array_equal(frame_times(scene, scene.solver), run(scene, "reference", audit=False).time)


@pytest.mark.parametrize(
    "scene",
    [
        drop_scene(world="quadratic_drag = 0.1"),
        drop_scene(world="linear_drag = 0.1"),
        drop_scene("[[ball]]\nname = 'b'\nposition = [9, 9]\nradius = 0.1"),
        drop_scene(ground=GROUND + "[[post]]\nname = 'peg'\nposition = [50, 0]\nradius = 0.1\n"),
        drop_scene(ground="[[plane]]\npoint = [0, 0]\nnormal = [0.1, 1]\n"),
        drop_scene("velocity = [1, 0]\nfriction = 0.5"),
    ],
    ids=["quadratic drag", "drag and a plane", "two balls", "a post", "a slope", "rubbing"],
)
def test_scene_not_covered_by_formulas_has_no_closed_form(scene: Scene) -> None:
    assert solved_run(scene, scene.solver) is None


def test_body_leaving_the_bounds_is_retired_when_an_engine_retires_it() -> None:
    scene = drop_scene(
        "collides = 'none'", world="bounds = [[-1.0, 0.0], [1.0, 10.0]]", solver="dt = 0.01\nhalf_kick = true"
    )
    form, found = solved_run(scene, scene.solver), run(scene, "pymunk", audit=False)
    # first frame with ½·10·t² > 5.5
    assert form.retired_time.tolist() == found.retired_time.tolist() == [pytest.approx(1.05)]
    assert form.position[-1, 0] == pytest.approx(found.position[-1, 0], abs=1e-12)  # 105 roundings
    assert form.velocity[-1].tolist() == [[0.0, 0.0]]
