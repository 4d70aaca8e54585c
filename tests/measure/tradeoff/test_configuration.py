"""Configurations: their neighbours and limits, and frames at times of the truth."""

from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.registry import ENGINES
from sandbox.measure.tradeoff.configuration import (
    MAX_REFINEMENT,
    MIN_REFINEMENT,
    MIN_STEPS,
    Configuration,
    Evaluation,
    SearchSpace,
    with_estimated_costs,
)
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import loads
from tests.measure.tradeoff.evaluations_by_hand import point_of
from tests.runs_by_hand import BALLS, DROP, SWING, scene_of

REFINEMENTS = st.sampled_from([Fraction(2) ** k for k in range(-4, 9)])
ENGINE = ("pymunk", "exact", "reference")


def space_of(text: str = DROP, **settings: object) -> SearchSpace:
    scene = scene_of(text)
    return SearchSpace(scene, scene.solver.replace(**settings), ENGINE)


def around(space: SearchSpace, engine: str, rounds: int = 2) -> set[Configuration]:
    """Return all configurations within a number of changes from the start."""
    found = {configuration for configuration in space.starts() if configuration.engine == engine}
    for _ in range(rounds):
        found |= {other for configuration in found for other in space.neighbours(configuration)}
    return found


@given(st.floats(1e-6, 0.03), st.integers(1, 12), REFINEMENTS)
def test_frames_are_recorded_at_times_of_frames_of_the_base(dt: float, every: int, refinement: Fraction) -> None:
    base = Settings(dt=dt, record_every=every)
    settings = Configuration("pymunk", refinement).settings(base)
    assert Fraction(settings.dt) * refinement == Fraction(dt)  # exactly
    interval = Fraction(settings.dt) * settings.record_every
    base_interval = Fraction(dt) * every
    # a multiple of the base interval
    assert interval / base_interval == max(Fraction((interval / base_interval).numerator), Fraction(1))
    if (refinement * every).denominator == 1:
        assert interval == base_interval


@pytest.mark.parametrize(("text", "engine"), [(DROP, "pymunk"), (DROP, "exact"), (SWING, "reference")])
def test_engines_support_every_neighbour(text: str, engine: str) -> None:
    space = space_of(text)
    for configuration in around(space, engine, rounds=1) - set(space.starts()):
        assert space.is_valid(configuration)
        assert ENGINES[engine].missing(space.scene, space.settings(configuration)) == ()
        assert MIN_REFINEMENT <= configuration.refinement <= MAX_REFINEMENT
        assert 0.4 / space.settings(configuration).dt >= MIN_STEPS


@pytest.mark.parametrize(("text", "engine"), [(SWING, "pymunk"), (DROP, "reference")])
def test_all_configurations_have_distinct_settings(text: str, engine: str) -> None:
    space = space_of(text)
    found = around(space, engine)
    assert len(found) > 10
    assert len({space.resolved(configuration) for configuration in found}) == len(found)


def test_neighbour_relation_is_symmetric_and_excludes_itself() -> None:
    space = space_of()
    (start, *_) = space.starts()
    for other in space.neighbours(start):
        assert other != start
        assert start in space.neighbours(other)


def test_configurations_of_exact_differ_only_in_the_frame_interval() -> None:
    space = space_of(dt=0.002)
    found = around(space, "exact", rounds=8)
    assert found == {Configuration("exact", Fraction(1, 2**k)) for k in range(4)}  # up to 0.016 s, a frame of a game
    assert around(space_of(dt=0.05), "exact") == {Configuration("exact")}  # which is coarser than a frame


def test_steps_are_at_most_two_frames_of_a_game() -> None:
    space = space_of(dt=0.01)
    assert max(space.settings(v).dt for v in around(space, "pymunk", rounds=3)) == 0.02  # 0.04 s is beyond 2/60 s
    assert max(v.dt for v in [space.settings(v) for v in around(space, "exact", rounds=3)]) == 0.01


def test_options_without_effect_are_not_varied() -> None:
    free = loads("[world]\nduration = 1.0\n[[ball]]\nname = 'a'\nposition = [0, 0]\nvelocity = [1, 0]\nradius = 1\n")
    space = SearchSpace(free, free.solver, ENGINE)
    varied = {key for configuration in around(space, "reference", rounds=1) for key, _ in configuration.options}
    assert varied == {"integrator"}  # no contact, no joint, no gravity
    assert {configuration.iterations for configuration in around(space, "reference", rounds=1)} == {10}
    single = space_of()
    assert not single.has_coupling  # one ball on one plane: one iteration is exact
    assert space_of(SWING).has_coupling
    assert space_of(BALLS).has_coupling


def test_unsupported_settings_of_the_scene_are_omitted_per_engine() -> None:
    space = space_of(integrator="rk4", detection="swept", substeps=4)
    pymunk, exact, reference = (space.own_settings(name) for name in ENGINE)
    assert (reference.integrator, reference.detection) == ("rk4", "swept")
    for stripped in (pymunk, exact):
        assert (stripped.integrator, stripped.detection, stripped.dt, stripped.substeps) == (None, None, 0.02, 4)
    assert [configuration.substeps for configuration in space.starts()] == [4, 4, 4]


def test_configurations_out_of_range_are_invalid() -> None:
    space = space_of()
    for configuration in (
        Configuration("pymunk", MAX_REFINEMENT * 2),
        Configuration("pymunk", MIN_REFINEMENT / 2),
        Configuration("pymunk", substeps=513),
        Configuration("pymunk", iterations=1001),
        Configuration("pymunk", substeps=0),
        Configuration("pymunk", Fraction(1, 8)),  # 2.5 steps
        Configuration("pymunk", options=(("integrator", "rk4"),)),
    ):
        assert not space.is_valid(configuration)
    tiny = space_of(dt=1e-8)
    assert not tiny.is_valid(Configuration("pymunk", Fraction(16)))  # dt below its minimum


def test_setting_that_was_not_timed_costs_as_much_for_its_work_as_the_nearest_timed_one() -> None:
    def point(cost: float, counted: float, repeats: int, engine: str = "reference") -> Evaluation:
        return replace(point_of(cost, 0.1, engine, counted, repeats), counted_seconds=1e-3 * counted)

    timed = [point(30.0, 10.0, 5), point(200.0, 100.0, 5), point(1.0, 50.0, 5, "pymunk")]
    recorded = [point(0.4, 20.0, 0), point(0.4, 80.0, 0), point(0.4, 20.0, 0, "box2d")]
    found = with_estimated_costs([*timed, *recorded])
    assert found[:3] == timed
    assert [each.cost for each in found[3:5]] == pytest.approx([60.0, 160.0], rel=1e-12)  # rounding
    assert [each.cost_median for each in found[3:5]] == pytest.approx([60.0, 160.0], rel=1e-12)
    assert found[5].cost == 0.4  # no setting of its engine was timed
