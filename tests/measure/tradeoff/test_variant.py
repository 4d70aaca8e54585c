"""Variants: which there are, and that their frames can be held against the truth."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from runs_by_hand import BALLS, DROP, SWING, scene_of

from sandbox.engines.registry import ENGINES
from sandbox.measure.compare.runs import common_frames
from sandbox.measure.run import run
from sandbox.measure.tradeoff.variant import COARSEST, FEWEST_STEPS, FINEST, Space, Variant
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import loads

FINER = st.sampled_from([Fraction(2) ** k for k in range(-4, 9)])
ENGINE = ("pymunk", "exact", "reference")


def space_of(text: str = DROP, **settings: object) -> Space:
    scene = scene_of(text)
    return Space(scene, scene.solver.replace(**settings), ENGINE)


def around(space: Space, engine: str, rounds: int = 2) -> set[Variant]:
    """Return all variants up to so many choices away."""
    found = {variant for variant in space.starts() if variant.engine == engine}
    for _ in range(rounds):
        found |= {other for variant in found for other in space.near(variant)}
    return found


@given(st.floats(1e-6, 0.03), FINER)
def test_step_is_that_part_of_the_base_to_the_last_bit(dt: float, finer: Fraction) -> None:
    settings = Variant("pymunk", finer).settings(Settings(dt=dt))
    assert Fraction(settings.dt) * finer == Fraction(dt)


@given(st.floats(1e-6, 0.03), st.integers(1, 12), FINER)
def test_frames_are_kept_at_times_at_which_the_base_keeps_them(dt: float, every: int, finer: Fraction) -> None:
    base = Settings(dt=dt, record_every=every)
    settings = Variant("pymunk", finer).settings(base)
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
        settings = space.settings(Variant(engine, finer))
        mine, its = common_frames(run(space.scene, engine, audit=False, **settings.model_dump()), base)
        assert len(mine) >= 2
        steps = round(0.4 / settings.dt)
        assert len(mine) == 1 + steps // settings.record_every + (steps % settings.record_every > 0)
        assert np.all(np.diff(its) > 0)


@pytest.mark.parametrize(("text", "engine"), [(DROP, "pymunk"), (DROP, "exact"), (SWING, "reference")])
def test_engines_take_every_variant_that_is_near(text: str, engine: str) -> None:
    space = space_of(text)
    for variant in around(space, engine, rounds=1) - set(space.starts()):
        assert space.sound(variant)
        assert ENGINES[engine].missing(space.scene, space.settings(variant)) == ()
        assert COARSEST <= variant.finer <= FINEST
        assert 0.4 / space.settings(variant).dt >= FEWEST_STEPS


@pytest.mark.parametrize(("text", "engine"), [(SWING, "pymunk"), (DROP, "reference")])
def test_no_two_variants_are_the_same(text: str, engine: str) -> None:
    space = space_of(text)
    found = around(space, engine)
    assert len(found) > 10
    assert len({space.filled(variant) for variant in found}) == len(found)


def test_variant_is_not_near_itself_and_its_neighbours_lead_back() -> None:
    space = space_of()
    (start, *_) = space.starts()
    for other in space.near(start):
        assert other != start
        assert start in space.near(other)


def test_exact_has_but_its_frames() -> None:
    space = space_of(dt=0.002)
    found = around(space, "exact", rounds=8)
    assert found == {Variant("exact", Fraction(1, 2**k)) for k in range(4)}  # up to 0.016 s, a frame of a game


def test_steps_last_two_frames_of_a_game_at_most() -> None:
    space = space_of(dt=0.01)
    assert max(space.settings(v).dt for v in around(space, "pymunk", rounds=3)) == 0.02  # 0.04 s is beyond 2/60 s
    assert max(v.dt for v in [space.settings(v) for v in around(space, "exact", rounds=3)]) == 0.01


def test_steps_of_a_scene_that_are_coarser_than_a_frame_stay() -> None:
    assert around(space_of(dt=0.05), "exact") == {Variant("exact")}


def test_what_cannot_matter_is_not_turned() -> None:
    free = loads("[world]\nduration = 1.0\n[[ball]]\nname = 'a'\nposition = [0, 0]\nvelocity = [1, 0]\nradius = 1\n")
    space = Space(free, free.solver, ENGINE)
    turned = {key for variant in around(space, "reference", rounds=1) for key, _ in variant.words}
    assert turned == {"integrator"}  # no contact, no joint, no gravity
    assert {variant.iterations for variant in around(space, "reference", rounds=1)} == {10}
    single = space_of()
    assert not single.iterates  # one ball on one plane: the first pass is right
    assert space_of(SWING).iterates
    assert space_of(BALLS).iterates


def test_words_of_the_scene_are_left_out_for_those_who_lack_them() -> None:
    space = space_of(integrator="rk4", detection="swept", substeps=4)
    pymunk, exact, reference = (space.own(name) for name in ENGINE)
    assert (reference.integrator, reference.detection) == ("rk4", "swept")
    for stripped in (pymunk, exact):
        assert (stripped.integrator, stripped.detection, stripped.dt, stripped.substeps) == (None, None, 0.02, 4)
    assert [variant.substeps for variant in space.starts()] == [4, 4, 4]


def test_bounds_hold() -> None:
    space = space_of()
    for variant in (
        Variant("pymunk", FINEST * 2),
        Variant("pymunk", COARSEST / 2),
        Variant("pymunk", substeps=513),
        Variant("pymunk", iterations=1001),
        Variant("pymunk", substeps=0),
        Variant("pymunk", Fraction(1, 8)),  # 2.5 steps
        Variant("pymunk", words=(("integrator", "rk4"),)),
    ):
        assert not space.sound(variant)
    tiny = space_of(dt=1e-8)
    assert not tiny.sound(Variant("pymunk", Fraction(16)))  # dt below its bound
