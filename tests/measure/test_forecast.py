"""Forecasts: odds of a miss, the largest safe step, and what else is warned of."""

import math

import numpy as np
import pytest
import strategies
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.measure.forecast import at_most, largest_safe_dt, passages, top_speeds, warnings
from sandbox.measure.run import run
from sandbox.scene.file import loads
from sandbox.scene.meetings import meetings
from sandbox.scene.model import Scene


def bullet(speed: float, radius: float, thickness: float, solver: str = "") -> Scene:
    return loads(
        f'[solver]\n{solver}\n[[wall]]\nname = "w"\npoints = [[1, -1], [1, 1]]\nthickness = {thickness!r}\n'
        f'[[ball]]\nname = "b"\nposition = [0, 0]\nvelocity = [{speed!r}, 0]\nradius = {radius!r}\n'
    )


@given(st.floats(1.0, 1e6), st.floats(1e-3, 1.0), st.floats(0.0, 1.0), st.floats(1e-6, 10.0), st.integers(1, 9))
def test_odds_of_a_bullet_are_the_formula(v: float, r: float, w: float, dt: float, substeps: int) -> None:
    scene = bullet(v, r, w, f"dt = {dt!r}\nsubsteps = {substeps}")
    (passage,) = passages(scene)
    h = dt / substeps
    assert passage.odds(h) == max(0.0, 1.0 - (r + w / 2) / (v * h))
    assert largest_safe_dt(scene) == (r + w / 2) / v * substeps
    told = [w for w in warnings(scene) if w.kind == "tunnelling"]
    assert len(told) == (passage.odds(h) > 1e-9)  # less is rounding
    for warning in told:
        assert warning.figures == {
            "ball": "b", "thing": "w", "speed": v, "odds": passage.odds(h), "safe_dt": largest_safe_dt(scene),
        }  # fmt: skip


# `COUNT` bullets fly side by side at a wall, each from a place of its own: random phases.
COUNT = 200


def volley(seed: int, thing: str, dt: float) -> tuple[int, int]:
    """Return how many of the bullets the audit calls missed, and how many the engine saw to touch."""
    scene = loads(
        f"[world]\nduration = 0.5\nseed = {seed}\n[solver]\ndt = {dt!r}\n{thing}\n"
        f'[[grid]]\nname = "b"\norigin = [-6.0, 0.0]\ncolumns = 1\nrows = {COUNT}\nspacing = [1.0, 1.0]\njitter = 0.3\n'
        'velocity = [20.0, 0.0]\nradius = 0.05\ncollides = "fixed"\n'
    )
    result = run(scene)
    return len(np.unique(result.missed_pair[:, 0])), len(np.unique(result.contact_pair[:, 0]))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("thickness", [0.0, 0.1])
def test_below_the_safe_step_no_bullet_misses_and_above_it_some_do(seed: int, thickness: float) -> None:
    wall = f"[[wall]]\npoints = [[0, -5], [0, {COUNT + 5}]]\nthickness = {thickness}\n"
    safe = largest_safe_dt(bullet(20.0, 0.05, thickness))
    assert volley(seed, wall, 0.99 * safe) == (0, COUNT)
    for factor in (1.2, 2.0):
        missed, touched = volley(seed, wall, factor * safe)
        assert missed + touched >= COUNT
        odds = 1 - 1 / factor
        # Five standard deviations of a binomial count: one seed in a million fails, and these are fixed.
        assert missed == pytest.approx(COUNT * odds, abs=5 * math.sqrt(COUNT * odds * (1 - odds)))


def test_balls_among_themselves_pass_by_their_closing_speed_and_both_radii() -> None:
    scene = loads(
        '[[ball]]\nname = "a"\nposition = [0, 0]\nvelocity = [30, 0]\nradius = 0.1\n'
        '[[ball]]\nname = "b"\nposition = [9, 0]\nvelocity = [-10, 0]\nradius = 0.3\n'
    )
    (passage,) = passages(scene)
    # Equal masses: either may come to fly at 30 m/s, so they close at 60 m/s at most.
    assert (passage.speed, passage.reach) == (60.0, 0.2)
    (warning,) = warnings(scene, scene.solver.replace(dt=0.02))
    assert warning.kind == "tunnelling"
    assert warning.message.startswith("'a' can close on another ball at up to 60 m/s, 1.2 m a substep, ")
    assert warning.message.endswith("odds up to 83.3 %; dt <= 0.00333 s would be safe")


def test_posts_planes_and_fixed_balls_have_their_own_depth() -> None:
    scene = loads(
        '[[plane]]\nname = "p"\npoint = [0, -9]\nnormal = [0, 1]\n'
        '[[post]]\nname = "q"\nposition = [5, 0]\nradius = 0.25\n'
        '[[ball]]\nname = "f"\nposition = [9, 0]\nradius = 0.75\nfixed = true\n'
        '[[ball]]\nname = "b"\nposition = [0, 0]\nvelocity = [10, 0]\nradius = 0.5\n'
    )
    assert {p.thing: p.reach for p in passages(scene)} == {"p": 1000.5, "q": 0.75, "f": 1.25}
    assert largest_safe_dt(scene) == 0.075


@settings(max_examples=30)  # a run each
@given(st.floats(0.0, 50.0), st.floats(-10.0, 10.0), st.floats(0.1, 20.0), st.floats(0.0, 1.0))
def test_over_a_level_floor_speed_is_bounded_by_the_drop(height: float, up: float, g: float, e: float) -> None:
    scene = loads(
        f"[world]\ngravity = [0.0, -{g!r}]\nduration = 2.0\n[solver]\ndt = 0.01\n"
        f"[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\nrestitution = {e!r}\n"
        f"[[ball]]\nposition = [0, {height + 0.5!r}]\nvelocity = [1.0, {up!r}]\nradius = 0.5\n"
    )
    bound = float(top_speeds(scene, meetings(scene))[0])
    start = math.hypot(1.0, up)
    assert bound == pytest.approx(min(start + 2 * g, math.sqrt(start**2 + 2 * g * height)), rel=1e-12)  # roundings
    speed = np.hypot(*run(scene, audit=False).velocity[:, 0].T).max()
    # A step late at the floor is a step's gravity more, and the floor then lifts what is deep by as much again.
    assert speed <= bound + 3 * g * 0.01


@pytest.mark.parametrize("normal", ["[0.1, 1.0]", "[0.0, -1.0]", "[1.0, 0.0]"])
def test_what_is_no_level_floor_bounds_nothing(normal: str) -> None:
    scene = loads(
        "[world]\ngravity = [0.0, -10.0]\nduration = 3.0\n"
        f"[[plane]]\npoint = [0, 0]\nnormal = {normal}\n[[ball]]\nposition = [1, 1]\nradius = 0.5\n"
    )
    assert top_speeds(scene, meetings(scene)).tolist() == [30.0]


def test_lighter_ball_gets_up_to_twice_the_speed_of_a_heavy_one() -> None:
    scene = loads(
        "[[ball]]\nposition = [0, 0]\nvelocity = [10, 0]\nradius = 1\nmass = 3\n"
        "[[ball]]\nposition = [5, 0]\nradius = 1\nmass = 1\n"
    )
    assert top_speeds(scene, meetings(scene)).tolist() == [10.0, 15.0]


PAIR = (
    "[solver]\niterations = {iterations}\n"
    "[[ball]]\nposition = [0, 0]\nradius = 1\nrestitution = {e}\n[[ball]]\nposition = [{x}, 0]\nradius = 1\n"
)


def kinds(text: str) -> list[str]:
    return [warning.kind for warning in warnings(loads(text))]


@pytest.mark.parametrize(
    ("iterations", "e", "x", "expected"),
    [
        (10, 0.5, 3.0, []),
        (10, 0.5, 2.0, []),
        (10, 0.5, 1.99, ["overlap"]),
        (5, 0.5, 3.0, []),
        (4, 0.5, 3.0, ["iterations"]),
        (4, 0.0, 3.0, []),
        (1, 0.5, 1.0, ["overlap", "iterations"]),
    ],
)
def test_overlap_and_iterations_are_warned_of(iterations: int, e: float, x: float, expected: list[str]) -> None:
    assert kinds(PAIR.format(iterations=iterations, e=e, x=x)) == expected


def test_overlap_is_counted_in_pairs_of_what_can_meet() -> None:
    ball = "[[ball]]\nposition = [0, 0]\nradius = 1\n"
    (warning,) = warnings(loads(ball * 3))
    assert (warning.kind, warning.figures) == ("overlap", {"pairs": 3})
    assert kinds((ball + 'collides = "none"\n') * 3) == []
    passing = (ball + 'collides = "fixed"\n') * 3
    assert kinds(passing) == []
    assert kinds(passing + ball + ball.replace("[0, 0]", "[2, 0]")) == []  # two that meet are no reason either


@pytest.mark.parametrize(("place", "told"), [(1e12, False), (1e13, True), (1e15, True)])
def test_rounding_far_from_the_origin_is_warned_of(place: float, told: bool) -> None:
    far = loads(
        f'[[post]]\nposition = [0, 0]\nradius = 1\n[[ball]]\nname = "b"\nposition = [{place!r}, 0]\nradius = 0.5\n'
    )
    found = warnings(far)
    assert [w.kind for w in found] == ["rounding"] * told
    for warning in found:
        assert warning.figures == {"ball": "b", "share": np.spacing(place) / 0.5}


def test_particles_that_meet_nothing_are_warned_of_nothing() -> None:
    scene = loads(
        "[world]\nduration = 9.0\ngravity = [0, -10]\n[solver]\niterations = 1\n"
        "[[emitter]]\nposition = [1e15, 0]\ncount = 50\nvelocity_min = [-1e9, 0]\nvelocity_max = [1e9, 1]\n"
    )
    assert warnings(scene) == []
    assert largest_safe_dt(scene) == math.inf


@given(strategies.scenes())
def test_any_scene_is_forecast_with_numbers(scene: Scene) -> None:
    safe = largest_safe_dt(scene)
    assert safe > 0.0
    for warning in warnings(scene):
        assert "nan" not in warning.message
        assert all(isinstance(v, str) or math.isfinite(v) for v in warning.figures.values())
        if warning.kind == "tunnelling":
            assert 0.0 < float(warning.figures["odds"]) <= 1.0
            assert float(warning.figures["safe_dt"]) < scene.solver.dt
    if safe < math.inf and 1e-9 <= (below := 0.999 * safe) <= 10.0:
        assert "tunnelling" not in [w.kind for w in warnings(scene, scene.solver.replace(dt=below))]


@given(st.floats(1e-300, 1e300))
def test_limit_is_written_short_and_not_above_itself(limit: float) -> None:
    text = at_most(limit)
    assert float(text) <= limit * (1 + 1e-9)  # as much counts as rounding
    assert float(text) >= limit * 0.99  # three digits
    assert len(text) <= 10


def test_limit_that_is_short_stays_as_it_is() -> None:
    assert [at_most(x) for x in (0.0002, 0.1 + 0.2, 0.00019999999999999998, 101.0, 1e-9)] == [
        "0.0002", "0.3", "0.0002", "101", "1e-09",
    ]  # fmt: skip


@pytest.mark.parametrize(("dt", "warned"), [(1.0, False), (1.1, True)])
def test_step_longer_than_the_run_is_warned_of(dt: float, warned: bool) -> None:
    text = f"[world]\nduration = 1.0\n[solver]\ndt = {dt}\n[[ball]]\nposition = [0.0, 0.0]\nradius = 1.0\n"
    assert ["duration" in w.kind for w in warnings(loads(text))] == [True] * warned
