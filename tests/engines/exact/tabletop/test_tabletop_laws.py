"""Laws of balls on a surface that hold for every shot and contact model."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.exact.tabletop.shots import Table
from sandbox.engines.registry import start
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.surface import Stroke
from tests.engines.exact.tabletop.small_tables import LENGTH, WIDTH, G, R, ball, rack, table
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

MAX_HOP_ENERGY = 5e-8  # J: bound of the energy that one hop of balls pressed together adds
WITH_FRICTION = [True, False]

offsets = st.floats(-0.35, 0.35)
strokes = st.builds(Stroke, aim=st.floats(0.0, 2.0 * math.pi), speed=st.floats(0.1, 8.0), side=offsets, height=offsets)


def cluster(**more: Any) -> Scene:
    return table(ball("cue", 0.5, 0.5), *rack(3, 0.48, 1.3, 1e-5), ball("far", 0.2, 0.9), **more)


@pytest.mark.parametrize("friction", WITH_FRICTION)
@given(stroke=strokes)
def test_energy_never_rises_and_its_ledger_closes(friction: bool, stroke: Stroke) -> None:
    shot = {"aim": stroke.aim, "speed": stroke.speed, "side": stroke.side, "height": stroke.height}
    trajectory = run(cluster(friction=friction, shot=[shot], dt=0.05), "exact", account=True)
    assert trajectory.status == "ok"
    energy = trajectory.energy
    assert np.diff(energy).max() <= MAX_HOP_ENERGY  # within a frame friction removes more than hops add
    residual = energy - energy[0] - trajectory.account.sum(axis=1)
    assert np.abs(residual).max() <= 1e-13 * energy[0]  # rounding of some hundreds of entries


@given(stroke=strokes)
def test_mirrored_shots_stay_mirrored_until_chaos(stroke: Stroke) -> None:
    left = Table(table(ball("cue", 0.3, 0.5), ball("1", 0.5, 1.1)))
    right = Table(table(ball("cue", WIDTH - 0.3, 0.5), ball("1", WIDTH - 0.5, 1.1)))
    a = left.shoot(stroke, until=2.0)
    b = right.shoot(stroke.model_copy(update={"aim": math.pi - stroke.aim, "side": -stroke.side}), until=2.0)
    assert [(e.kind, e.ball, e.partner) for e in a.events] == [(e.kind, e.ball, e.partner) for e in b.events]
    mirrored = np.column_stack((WIDTH - b.position[:, 0], b.position[:, 1]))
    np.testing.assert_allclose(a.position, mirrored, atol=1e-9)  # m: rounding, amplified by a few collisions


@given(stroke=strokes)
def test_balls_stay_on_the_table_without_overlap(stroke: Stroke) -> None:
    shot = Table(cluster()).shoot(stroke, record_paths=True)
    for name in shot.names:
        path = shot.path_of(name, 0.002)
        assert path.min() >= R - 1e-9  # m: contact tolerance
        assert (path <= np.asarray([WIDTH, LENGTH]) - R + 1e-9).all()
    distance = np.hypot(*(shot.position[:, None] - shot.position[None]).transpose(2, 0, 1))
    assert (distance + 1.0 * np.eye(len(distance)) >= 2.0 * R - 1e-9).all()
    assert shot.complete


def test_positions_do_not_depend_on_the_frame_times() -> None:
    coarse, fine = (
        run(cluster(shot=[{"aim": 1.6, "speed": 5.0}], dt=dt), "exact").position[-1] for dt in (0.1, 0.0025)
    )
    assert (coarse == fine).all()


def test_frozen_balls_at_rest_stay_at_rest() -> None:
    """A frozen pack and balls frozen to cushions produce no events."""
    pack = [*rack(5, 0.5, 1.0), ball("side", R, 0.3), ball("corner", R, R)]
    outcome = Table(table(ball("cue", 0.5, 0.5), *pack)).shoot()
    assert not len(outcome.log)
    assert outcome.complete


@pytest.mark.parametrize("gap", [0.0, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("height", [-0.3, 0.0, 0.35])
def test_balls_in_a_row_pass_their_motion_on(gap: float, height: float) -> None:
    """Frozen or up to 1 mm apart: no ball leaves the line, and only neighbours collide."""
    pitch = 2.0 * R + gap
    row = [ball(str(k), 0.5, 0.8 + k * pitch) for k in range(5)]
    outcome = Table(table(ball("cue", 0.5, 0.4), *row, cushions=False)).shoot(
        Stroke(aim=math.pi / 2.0, speed=3.0, height=height)
    )
    assert outcome.complete
    x, y = outcome.position.T
    assert np.abs(x - 0.5).max() < 1e-9  # m: aim π/2 in doubles is off by 6e-17 rad
    assert (np.diff(y) >= 2.0 * R - 1e-9).all()
    names = outcome.names
    hits = [(e.ball, e.partner) for e in outcome.events if e.kind == "ball"]
    assert set(hits) <= set(pairwise(names))
    assert len(outcome.log) < 20_000  # hops of the cue ball, which its spin presses on the row for 0.7 s


@pytest.mark.parametrize("height", [0.0, 0.4])
def test_ball_pressed_onto_a_frozen_pack_comes_to_rest(height: float) -> None:
    outcome = Table(table(ball("cue", 0.5, 0.9), *rack(5, 0.5, 0.9 + 2.0 * R))).shoot(
        Stroke(aim=math.pi / 2.0, speed=2.0, height=height)
    )
    assert outcome.complete
    assert len(outcome.log) < 20_000


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_full_hit_obeys_restitution_and_conserves_momentum(e: float) -> None:
    outcome = Table(table(ball("a", 0.5, 0.5), ball("b", 0.5, 0.5 + 2.0 * R), friction=False, e=e)).send(
        (0.0, 1.0), (0.0, 0.0, 0.0), "a", until=0.0
    )
    velocity = outcome.state[:, 4]
    assert velocity.sum() == pytest.approx(1.0, abs=1e-15)
    assert velocity[1] - velocity[0] == pytest.approx(e, abs=1e-15)


def test_ball_never_stops_sliding_without_sliding_friction() -> None:
    scene = table(ball("a", 0.5, 0.5, velocity=[0.0, 1.0]), cushions=False, surface={"rolling_friction": 0.01})
    trajectory = run(scene, "exact")
    assert trajectory.velocity[-1, 0].tolist() == [0.0, 1.0]


@pytest.mark.parametrize("turn", [0.5 * math.pi, 2.0, -1.0])
def test_shots_are_invariant_under_rotation(turn: float) -> None:
    def shot(angle: float) -> np.ndarray[Any, Any]:
        cos, sin = math.cos(angle), math.sin(angle)
        positions = [(cos * x - sin * y, sin * x + cos * y) for x, y in ((0.0, 0.0), (0.01, 0.5), (-0.02, 0.9))]
        scene = table(
            *(ball(name, *position) for name, position in zip(("cue", "1", "2"), positions, strict=True)),
            cushions=False,
        )
        return Table(scene).shoot(Stroke(aim=math.pi / 2.0 + angle, speed=3.0, side=0.2, height=0.1)).position

    rotated_back = shot(turn) @ np.asarray([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    np.testing.assert_allclose(rotated_back, shot(0.0), atol=1e-11)  # m: rounding over metres


def test_shots_scale_with_gravity() -> None:
    """If gravity and squared speeds scale by s, paths stay the same and times scale by 1/√s."""
    small, large = (
        Table(
            table(
                ball("cue", 0.5, 0.5),
                ball("1", 0.51, 0.9),
                friction=False,
                surface={"gravity": G * s, "sliding_friction": 0.2, "rolling_friction": 0.01},
            )
        ).shoot(Stroke(aim=1.6, speed=2.0 * math.sqrt(s), height=0.2))
        for s in (1.0, 4.0)
    )
    np.testing.assert_allclose(small.position, large.position, atol=1e-9)  # m: the threshold of 1 mm/s does not scale
    assert small.duration == pytest.approx(2.0 * large.duration, rel=1e-9)


def test_simulation_and_table_give_the_same_result() -> None:
    scene = cluster(shot=[{"aim": 1.6, "speed": 5.0, "side": 0.1}])
    simulation = start(scene, "exact")
    simulation.contacts()
    advance(simulation, 2000)
    outcome = Table(scene).shoot()
    assert (simulation.frame().position == outcome.position).all()
    simulated, expected = simulation.contacts(), outcome.contacts
    assert (simulated.time == expected.time).all()
    assert (simulated.pair == expected.pair).all()
    assert (simulated.impulse == expected.impulse).all()
