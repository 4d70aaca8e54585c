"""Statistics of the end of chaotic scenes: measures by hand, and settings that end differently from the truth."""

import math

import numpy as np
import pytest

import sandbox
from sandbox.measure.compare.end_measures import END_MEASURES
from sandbox.measure.compare.end_statistics import MIN_END_STARTS, EndEnsemble, end_ensemble
from sandbox.measure.compare.ground_truth import truth_of
from sandbox.measure.compare.metrics import EvaluationContext
from sandbox.measure.run.runner import run
from sandbox.measure.starts import Starts
from sandbox.scene.compile.scene import Scene
from tests.runs_by_hand import scene_of

GAS = """
[world]
duration = 6.0
[solver]
dt = 0.005
[[plane]]
point = [0.0, 0.0]
normal = [0.0, 1.0]
restitution = 1.0
[[plane]]
point = [0.0, 2.0]
normal = [0.0, -1.0]
restitution = 1.0
[[plane]]
point = [0.0, 0.0]
normal = [1.0, 0.0]
restitution = 1.0
[[plane]]
point = [2.0, 0.0]
normal = [-1.0, 0.0]
restitution = 1.0
"""
"""Elastic balls in a box: positions are unpredictable after some collisions, the kinetic energy is constant."""


def gas() -> Scene:
    random = np.random.default_rng(1)
    cells = [(0.25 + 0.5 * i, 0.25 + 0.5 * j) for i in range(4) for j in range(4)]
    balls = [
        f"[[ball]]\nradius = 0.08\nrestitution = 1.0\nposition = [{x}, {y}]\nvelocity = [{vx:.3f}, {vy:.3f}]\n"
        for (x, y), (vx, vy) in zip(cells, random.uniform(-2.0, 2.0, (16, 2)), strict=True)
    ]
    return scene_of(GAS + "".join(balls))


def ensemble_of(scene: Scene, count: int, effort: float = 1e6) -> EndEnsemble:
    context = EvaluationContext(scene, truth_of(scene, scene.solver, 1e-3))
    found = end_ensemble(context, Starts(scene), scene.solver, count, effort, 1e-3)
    assert found is not None
    return found


def end_of(scene: Scene, engine: str = "pymunk") -> dict[str, float]:
    context = EvaluationContext(scene, None)
    found = run(scene, engine)
    return {each.name: each.measure(found, context) for each in END_MEASURES if each.applies(context)}


@pytest.mark.fail_slow(60)  # 72 runs, and the first use of a compiled engine
def test_engine_that_loses_energy_ends_slower_than_the_truth_and_another_one_does_not() -> None:
    scene = gas()
    ensemble, count = ensemble_of(scene, 24), 24
    assert ensemble.engine == "exact"
    alike = ensemble.compare("pymunk", scene.solver, range(1, count + 1))
    assert alike is not None
    assert alike.is_alike
    slower = ensemble.compare("box2d", scene.solver, range(1, count + 1))
    assert slower is not None
    # Box2D cannot return the whole speed of an elastic bounce; the energy of all balls together is only lost.
    assert [each.name for each in slower.differing] == ["speed"]
    assert slower.differing[0].compared.high < 0.0
    assert str(slower).startswith("its ends differ from the truth's over 24 starts: speed −")
    itself = ensemble.compare("exact", ensemble.settings, range(1, count + 1))
    assert itself is not None
    assert all(each.compared.is_constant or each.compared.difference == 0.0 for each in itself.statistics)


@pytest.mark.fail_slow(120)  # two searches, and runs from other starts
def test_setting_whose_ends_differ_is_not_recommended() -> None:
    scene = gas()
    # Within a loss of half the energy, so that only the ends decide.
    found = sandbox.tradeoff(scene, ("pymunk", "box2d"), tolerance=0.5, effort=5.0, repeats=1, starts=24)
    assert found.end_starts == 24
    slower = found.cheapest_by_engine["box2d"]
    least = min(p.counted_seconds for p in found.points if p.engine == "box2d" and p.meets(0.5))
    # Its ends are known to differ; a dearer setting may be recommended whose ends the effort does not let it compare.
    assert slower is None or slower.point.counted_seconds > 1.05 * least
    best = found.cheapest_by_engine["pymunk"]
    assert best is not None
    assert best.point.end_statistics is not None
    assert best.point.end_statistics.is_alike
    own = next(point for point in found.points if point.engine == "box2d" and point.is_own)
    assert own.end_statistics is not None
    assert "speed" in [each.name for each in own.end_statistics.differing]
    assert found.differing_ends > 0
    assert f"those of {found.differing_ends} settings within the tolerance differ" in str(found.ends_about)
    for pick in filter(None, found.cheapest_by_engine.values()):  # compared, or said not to be
        known = pick.point.end_statistics
        assert pick.sentence.count("its ends") == 1
        assert (known is None) == ("its ends were not compared" in pick.sentence)


@pytest.mark.fail_slow(60)  # 24 runs, and the truth of a chaotic scene
def test_comparison_says_over_how_many_starts_it_is_or_why_there_are_none() -> None:
    scene = gas()
    few = sandbox.compare(scene, ("pymunk",), starts=5)
    assert few.rows[0].end_statistics is None
    assert few.starts_about == f"ends from other starts were not compared: that takes {MIN_END_STARTS} of them"
    found = sandbox.compare(scene, ("pymunk", "exact"), starts=12)
    assert [row.end_statistics is None for row in found.rows] == [False, True]  # exact is the truth itself
    assert str(found.starts_about).startswith("ends compared over 12 perturbed starts, with positions ±")
    drop = sandbox.compare("bounce", ("pymunk",), starts=4, dt=0.01)
    assert drop.rows[0].start_errors is not None
    assert drop.rows[0].start_errors.held.trials == 4
    assert str(drop.starts_about).startswith("errors over 4 perturbed starts")
    assert sandbox.compare(scene, ("exact",), starts=12).starts_about is None


def test_predictable_scene_needs_no_statistics() -> None:
    scene = sandbox.load("bounce")
    context = EvaluationContext(scene, truth_of(scene, scene.solver, 1e-3))
    assert end_ensemble(context, Starts(scene), scene.solver, 30, 1e6, 1e-3) is None


@pytest.mark.fail_slow(60)  # truth of a chaotic scene
def test_effort_bounds_the_number_of_starts() -> None:
    scene = gas()
    ensemble = ensemble_of(scene, 30)
    assert ensemble_of(scene, 30, 12.5 * ensemble.cost).count == 12
    context = EvaluationContext(scene, ensemble.truth)
    too_little = (MIN_END_STARTS - 0.5) * ensemble.cost
    assert end_ensemble(context, Starts(scene), scene.solver, 30, too_little, 1e-3) is None


def test_setting_whose_runs_fail_is_not_alike() -> None:
    scene = gas()
    ensemble = ensemble_of(scene, 10)
    found = ensemble.compare("pymunk", scene.solver, range(1, 11), cost=1e-9)  # each run is stopped
    assert found is not None
    assert found.failed == 10
    assert not found.is_alike


def test_bodies_that_fell_off_count_as_fallen_and_not_in_the_height() -> None:
    scene = scene_of(
        """
        [world]
        gravity = [0.0, -10.0]
        duration = 2.0
        [[wall]]
        points = [[-1.0, 0.0], [1.0, 0.0]]
        [[ball]]
        position = [0.0, 0.1]
        radius = 0.1
        [[ball]]
        position = [3.0, 0.1]
        radius = 0.1
        """
    )
    end = end_of(scene)
    assert end["fallen"] == 1.0
    assert end["at_rest"] == 1.0
    # pymunk lets a resting ball sink by its slop of 1 % of the radius, 1 mm, at most.
    assert end["height"] == pytest.approx(0.1, abs=1.1e-3)
    assert end["extent"] == 0.0


def test_extent_and_speed_of_two_free_balls() -> None:
    scene = scene_of(
        """
        [world]
        duration = 1.0
        [[ball]]
        position = [0.0, 0.0]
        velocity = [3.0, 0.0]
        radius = 0.1
        [[ball]]
        position = [0.0, 1.0]
        velocity = [0.0, 4.0]
        radius = 0.1
        """
    )
    end = end_of(scene, "exact")
    assert "height" not in end  # no gravity
    # At (3, 0) and (0, 5): half the distance √34 from the middle. Rounding only.
    assert end["extent"] == pytest.approx(math.sqrt(34.0) / 2.0, rel=1e-12)
    assert end["speed"] == pytest.approx(math.sqrt(12.5), rel=1e-12)
