"""Configurations: which there are, and that their frames can be held against the truth."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.registry import ENGINES
from sandbox.measure.metrics.trajectory_error import common_frames
from sandbox.measure.run.runner import run
from sandbox.measure.tradeoff.configuration import MAX_REFINEMENT, MIN_REFINEMENT, MIN_STEPS, Configuration, SearchSpace
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import loads
from tests.runs_by_hand import BALLS, DROP, SWING, scene_of

FINER = st.sampled_from([Fraction(2) ** k for k in range(-4, 9)])
ENGINE = ("pymunk", "exact", "reference")


def space_of(text: str = DROP, **settings: object) -> SearchSpace:
    scene = scene_of(text)
    return SearchSpace(scene, scene.solver.replace(**settings), ENGINE)


def around(space: SearchSpace, engine: str, rounds: int = 2) -> set[Configuration]:
    """Return all configurations up to so many choices away."""
    found = {configuration for configuration in space.starts() if configuration.engine == engine}
    for _ in range(rounds):
        found |= {other for configuration in found for other in space.neighbours(configuration)}
    return found


@given(st.floats(1e-6, 0.03), FINER)
def test_step_is_that_part_of_the_base_to_the_last_bit(dt: float, finer: Fraction) -> None:
    settings = Configuration("pymunk", finer).settings(Settings(dt=dt))
    assert Fraction(settings.dt) * finer == Fraction(dt)


@given(st.floats(1e-6, 0.03), st.integers(1, 12), FINER)
def test_frames_are_kept_at_times_at_which_the_base_keeps_them(dt: float, every: int, finer: Fraction) -> None:
    base = Settings(dt=dt, record_every=every)
    settings = Configuration("pymunk", finer).settings(base)
    between = Fraction(settings.dt) * settings.record_every
    own = Fraction(dt) * every
    assert between / own == max(Fraction((between / own).numerator), Fraction(1))  # a whole number of the base's
    if (finer * every).denominator == 1:
        assert between == own


@pytest.mark.parametrize("engine", ["pymunk", "exact"])
@pytest.mark.parametrize("every", [1, 3])
def test_all_frames_of_a_run_are_found_in_the_truth(engine: str, every: int) -> None:
    space = space_of(record_every=every)
    base = run(space.scene, engine, audit=False, **space.base.model_dump())
    for finer in (Fraction(1, 4), Fraction(1, 2), Fraction(1), Fraction(4)):
        settings = space.settings(Configuration(engine, finer))
        mine, its = common_frames(run(space.scene, engine, audit=False, **settings.model_dump()), base)
        assert len(mine) >= 2
        steps = round(0.4 / settings.dt)
        assert len(mine) == 1 + steps // settings.record_every + (steps % settings.record_every > 0)
        assert np.all(np.diff(its) > 0)


@pytest.mark.parametrize(("text", "engine"), [(DROP, "pymunk"), (DROP, "exact"), (SWING, "reference")])
def test_engines_take_every_variant_that_is_near(text: str, engine: str) -> None:
    space = space_of(text)
    for configuration in around(space, engine, rounds=1) - set(space.starts()):
        assert space.is_valid(configuration)
        assert ENGINES[engine].missing(space.scene, space.settings(configuration)) == ()
        assert MIN_REFINEMENT <= configuration.refinement <= MAX_REFINEMENT
        assert 0.4 / space.settings(configuration).dt >= MIN_STEPS


@pytest.mark.parametrize(("text", "engine"), [(SWING, "pymunk"), (DROP, "reference")])
def test_no_two_variants_are_the_same(text: str, engine: str) -> None:
    space = space_of(text)
    found = around(space, engine)
    assert len(found) > 10
    assert len({space.resolved(configuration) for configuration in found}) == len(found)


def test_variant_is_not_near_itself_and_its_neighbours_lead_back() -> None:
    space = space_of()
    (start, *_) = space.starts()
    for other in space.neighbours(start):
        assert other != start
        assert start in space.neighbours(other)


def test_exact_has_but_its_frames() -> None:
    space = space_of(dt=0.002)
    found = around(space, "exact", rounds=8)
    assert found == {Configuration("exact", Fraction(1, 2**k)) for k in range(4)}  # up to 0.016 s, a frame of a game


def test_steps_last_two_frames_of_a_game_at_most() -> None:
    space = space_of(dt=0.01)
    assert max(space.settings(v).dt for v in around(space, "pymunk", rounds=3)) == 0.02  # 0.04 s is beyond 2/60 s
    assert max(v.dt for v in [space.settings(v) for v in around(space, "exact", rounds=3)]) == 0.01


def test_steps_of_a_scene_that_are_coarser_than_a_frame_stay() -> None:
    assert around(space_of(dt=0.05), "exact") == {Configuration("exact")}


def test_what_cannot_matter_is_not_turned() -> None:
    free = loads("[world]\nduration = 1.0\n[[ball]]\nname = 'a'\nposition = [0, 0]\nvelocity = [1, 0]\nradius = 1\n")
    space = SearchSpace(free, free.solver, ENGINE)
    turned = {key for configuration in around(space, "reference", rounds=1) for key, _ in configuration.options}
    assert turned == {"integrator"}  # no contact, no joint, no gravity
    assert {configuration.iterations for configuration in around(space, "reference", rounds=1)} == {10}
    single = space_of()
    assert not single.has_coupling  # one ball on one plane: the first pass is right
    assert space_of(SWING).has_coupling
    assert space_of(BALLS).has_coupling


def test_words_of_the_scene_are_left_out_for_those_who_lack_them() -> None:
    space = space_of(integrator="rk4", detection="swept", substeps=4)
    pymunk, exact, reference = (space.own_settings(name) for name in ENGINE)
    assert (reference.integrator, reference.detection) == ("rk4", "swept")
    for stripped in (pymunk, exact):
        assert (stripped.integrator, stripped.detection, stripped.dt, stripped.substeps) == (None, None, 0.02, 4)
    assert [configuration.substeps for configuration in space.starts()] == [4, 4, 4]


def test_bounds_hold() -> None:
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
    assert not tiny.is_valid(Configuration("pymunk", Fraction(16)))  # dt below its bound
