"""Single collisions of two balls, and impacts along a row, against published formulas and 40-digit arithmetic."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.analytic import solution
from sandbox.measure.analytic.trajectory import solved_run
from sandbox.scene.compile.scene import Scene
from tests.measure.analytic.oracle import scene_of, solution_of


def balls(
    *starts: tuple[float, float, float, float],
    mass: tuple[float, ...] = (),
    e: float = 1.0,
    friction: float = 0.0,
    world: str = "duration = 4.0",
    extra: str = "",
) -> Scene:
    """Return balls of 0.5 m radius, each given by position and velocity."""
    head = f"[[material]]\nname = 'm'\n[[pair]]\nbetween = ['m', 'm']\nrestitution = {e!r}\nfriction = {friction}\n"
    rows = [
        f"[[ball]]\nposition = [{x!r}, {y!r}]\nvelocity = [{vx!r}, {vy!r}]\nradius = 0.5\nmaterial = 'm'\n"
        f"mass = {(mass or (1.0,) * len(starts))[k]!r}\n"
        for k, (x, y, vx, vy) in enumerate(starts)
    ]
    return scene_of(head, *rows, extra, world=world)


@pytest.mark.parametrize("e", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("masses", [(1.0, 1.0), (3.0, 1.0), (1e12, 1.0), (1.0, 1e12)])
def test_two_balls_separate_by_the_published_formula(masses: tuple[float, float], e: float) -> None:
    (m1, m2), v = masses, 4.0
    scene = balls((-3.0, 0.0, v, 0.0), (0.0, 0.0, 0.0, 0.0), mass=masses, e=e)
    expected = [(m1 - e * m2) * v / (m1 + m2), (1.0 + e) * m1 * v / (m1 + m2)]
    found = solution_of(scene).at(np.array([0.25, 0.5, 2.5]))
    # a rounding
    assert found.velocity[:, :, 0] == pytest.approx(np.array([[v, 0.0], expected, expected]), abs=1e-15 * v)
    assert found.position[2, :, 0] == pytest.approx([-1.0 + 2.0 * expected[0], 2.0 * expected[1]], abs=4e-15)  # of 16 m
    trajectory = solved_run(scene, scene.solver)
    assert trajectory.contact_time.tolist() == [0.5]
    assert trajectory.contact_normal.tolist() == [[1.0, 0.0]]
    # The impulse on the second ball is the momentum that it gains.
    assert trajectory.contact_impulse[0, 0] == pytest.approx(m2 * expected[1], rel=1e-15)


@given(
    offset=st.floats(-0.999, 0.999),
    e=st.floats(0.0, 1.0),
    ratio=st.floats(1e-3, 1e3),
    speed=st.floats(0.5, 50.0),
    drift=st.floats(-3.0, 3.0),
)
def test_oblique_impact_conserves_momentum_and_obeys_restitution(offset, e, ratio, speed, drift):
    scene = balls((-3.0, offset, speed, drift), (0.0, 0.0, 0.0, drift), mass=(ratio, 1.0), e=e, world="duration = 20.0")
    ((row,),) = [solution_of(scene).together.contacts(20.0)]
    before, after = solution_of(scene).at(np.array([0.0, 20.0])).velocity
    n = np.asarray(row.normal)
    size = speed * max(ratio, 1.0)
    momentum = ratio * (after[0] - before[0]) + after[1] - before[1]
    assert momentum == pytest.approx([0.0, 0.0], abs=1e-14 * size)  # roundings
    assert (after[1] - after[0]) @ n == pytest.approx(-e * float((before[1] - before[0]) @ n), abs=1e-14 * size)
    # With 40 digits the time of a grazing impact is exact; a naive root in doubles loses half of its digits.
    with mpmath.workdps(40):
        x = mpmath.mpf(3) - mpmath.sqrt(1 - mpmath.mpf(offset) ** 2)
        expected = float(x / mpmath.mpf(speed))
    # the condition number of the root
    assert row.time == pytest.approx(expected, rel=1e-13 / math.sqrt(1.0 - offset * offset))


def test_balls_that_miss_continue_in_straight_lines() -> None:
    scene = balls((-3.0, 1.01, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0))
    assert solution_of(scene).at(np.array([4.0])).position[0].tolist() == [[1.0, 1.01], [0.0, 0.0]]


def test_uniform_gravity_does_not_affect_a_collision() -> None:
    starts = (-3.0, 0.6, 1.0, 0.5), (0.0, 0.0, 0.0, 0.5)
    time = np.linspace(0.0, 4.0, 9)
    free, falling = (solution_of(balls(*starts, e=0.7, world=f"gravity = {g}\nduration = 4.0")).at(time)
                     for g in ([0.0, 0.0], [0.3, -9.81]))  # fmt: skip
    fallen = 0.5 * time[:, None, None] ** 2 * np.array([0.3, -9.81])
    assert falling.position == pytest.approx(free.position + fallen, abs=1e-14)  # one rounding of 80 m


@pytest.mark.parametrize("gap", [0.0, 1e-4])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_cradle_ejects_as_many_balls_as_arrive(count: int, gap: float) -> None:
    row = [(k * (1.0 + gap), 0.0, 0.0, 0.0) for k in range(5 - count)]
    incoming = [(-1.0 - (1.0 + gap) * k, 0.0, 2.0, 0.0) for k in range(1, count + 1)][::-1]
    scene = balls(*incoming, *row)
    after = solution_of(scene).at(np.array([4.0])).velocity[0, :, 0]
    assert after == pytest.approx([0.0] * (5 - count) + [2.0] * count, abs=1e-15)  # one rounding per impact
    events = solution_of(scene).together.contacts(4.0)
    assert len(events) == count * (5 - count)  # in effect, each incoming ball hits each standing one


@pytest.mark.parametrize(
    "scene",
    [
        balls((-3.0, 0.6, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0), friction=0.2),
        balls((-3.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0), (9.0, 1.0, 0.0, 0.0)),
        balls((-3.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0), (3.0, 0.0, -1.0, 0.0), e=0.5),
        balls((-3.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), mass=(1.0, 2.0, 3.0)),
        balls((-3.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0), world="linear_drag = 0.1\nduration = 4.0"),
        balls((-0.9, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0)),
        balls((-3.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0), world="bounds = [[-9.0, -9.0], [9.0, 9.0]]"),
        balls((-3.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0), extra="[[post]]\nposition = [9.0, 0.0]\nradius = 0.1\n"),
        balls((-3.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0), extra="[[box]]\nposition = [9.0, 0.0]\nsize = [1.0, 1.0]\n"),
    ],
    ids=["rubbing", "a third aside", "both sides at once", "through three at once", "drag", "overlap", "bounds",
         "a post", "a box"],
)  # fmt: skip
def test_collision_of_uncertain_outcome_has_no_closed_form(scene: Scene) -> None:
    assert solution(scene) is None


def test_simultaneous_impact_from_both_sides_is_solved_for_equal_elastic_balls() -> None:
    scene = balls((-3.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 0.0), (3.0, 0.0, -2.0, 0.0))
    assert solution_of(scene).at(np.array([4.0])).velocity[0, :, 0] == pytest.approx([-2.0, 0.0, 1.0], abs=1e-15)
