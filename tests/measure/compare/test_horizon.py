"""Horizon: what a nudge is, and where it comes to matter."""

import numpy as np
import pytest
from runs_by_hand import run_of, scene_of

from sandbox.measure.compare.horizon import NUDGE, agree_until, nudged
from sandbox.measure.compare.truth import truth_of
from sandbox.scene.file import load, loads
from sandbox.scene.shipped import find
from sandbox.scene.surfaces import surfaces_of


def test_nudge_moves_the_first_ball_that_can_meet_something() -> None:
    scene = scene_of()
    other = nudged(scene)
    assert other is not None
    away = other.bodies.position - scene.bodies.position
    assert np.hypot(*away[0]) == pytest.approx(NUDGE, rel=1e-3)  # y is 5 m, of which 1e-12 has three digits
    assert not away[1:].any()


def test_nudge_far_out_is_not_lost_in_rounding() -> None:
    scene = loads("[[ball]]\nposition = [1e9, 0]\nradius = 1\n[[ball]]\nposition = [2e9, 0]\nradius = 1\n")
    other = nudged(scene)
    assert other is not None
    assert other.bodies.position[0, 0] == 1e9 + 4 * np.spacing(1e9)


def test_scene_in_which_nothing_can_meet_has_no_nudge() -> None:
    assert nudged(loads("[[ball]]\nposition = [0, 0]\nradius = 1\n")) is None


def test_nudge_moves_a_ball_of_a_generator_and_nothing_else() -> None:
    scene = load(find("gas"))
    other = nudged(scene)
    assert other is not None
    old, new = scene.bodies, other.bodies
    assert scene.bodies is old  # the scene itself is as it was
    assert new.names == old.names
    assert np.count_nonzero((new.position != old.position).any(axis=1)) == 1
    for key in ("velocity", "angle", "angular_velocity", "radius", "mass", "fixed"):
        assert np.array_equal(getattr(new, key), getattr(old, key))
    mine, its = surfaces_of(scene, old), surfaces_of(other, new)
    assert np.array_equal(mine.restitution, its.restitution)


def test_runs_agree_until_the_last_frame_before_they_part() -> None:
    scene = scene_of()
    truth = run_of(scene)
    position = truth.position.copy()
    position[7:, 0, 0] += 0.2
    assert agree_until(truth, run_of(scene, position), scene, 0.1) == truth.time[6]
    assert agree_until(truth, run_of(scene, position), scene, 0.3) == 2.0
    position[0, 0, 0] += 0.2
    assert agree_until(truth, run_of(scene, position), scene, 0.1) == 0.0


def test_chaos_ends_the_trust_before_the_end() -> None:
    """A ball among pegs: each bounce multiplies 1e-12 m by some ten, so that twenty are beyond knowing."""
    pegs = "".join(
        f"[[post]]\nposition = [{x + 0.5 * (y % 2)}, {y}]\nradius = 0.35\nrestitution = 1.0\n"
        for x in range(-3, 4)
        for y in range(-3, 4)
    )
    ball = "[[ball]]\nname = 'a'\nposition = [0.5, 0.13]\nvelocity = [2.0, 1.1]\nradius = 0.1\n"
    scene = loads(f"[world]\nduration = 6.0\n[solver]\ndt = 0.01\n{ball}{pegs}")
    truth = truth_of(scene, scene.solver, 1e-3)
    assert truth is not None
    assert 0.1 < truth.trusted_until < 6.0
    assert truth.kind != "closed_form"
