"""Balls on a surface on pymunk: free rolling in closed form, collision laws, pockets, actions and energy ledger."""

import math
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import ActionError, Force, Impulse, Move, Remove, SetParameter, Spawn, Strike
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import Refusal, Simulation
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.surface import struck
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

MASS, RADIUS, G = 0.170097, 0.028575, 9.81
SLIDE, ROLL, SPIN = 0.2, 0.01, 0.0127
CLOTH = {"gravity": G, "sliding_friction": SLIDE, "rolling_friction": ROLL, "spinning_friction": SPIN}
FRICTION_MODELS = {"ball_ball": "frictional", "cushion": "han2005"}
NOSE = 0.64 * 2 * RADIUS
RAIL: dict[str, Any] = {"points": [[1, -3], [1, 3]], "height": NOSE, "restitution": 0.85, "friction": 0.2}
ROUNDING = 1e-12  # rounding of sums of up to a few thousand terms of order 1


def ball(name: str, x: float, y: float, vx: float = 0.0, vy: float = 0.0, **more: Any) -> dict[str, Any]:
    disc = {"name": name, "position": [x, y], "velocity": [vx, vy], "radius": RADIUS, "mass": MASS}
    return {**disc, "material": "resin", **more}


def table(*balls: dict[str, Any], dt: float = 0.001, **more: Any) -> Scene:
    document = {
        "world": {"duration": 20.0, **more.pop("world", {})},
        "solver": {"dt": dt, **more.pop("solver", {})},
        "surface": CLOTH,
        "contact_models": FRICTION_MODELS,
        "material": [{"name": "resin"}],
        "pair": [{"between": ["resin", "resin"], "restitution": 0.95}],
        "ball": list(balls),
        **more,
    }
    return from_document(document)


def rack(dt: float, seed: int = 0, gap: float = 1e-5, **more: Any) -> Scene:
    """Return a break of 16 balls in a box with rails."""
    offset = np.random.default_rng(seed).uniform(-1e-3, 1e-3)
    pitch = 2 * RADIUS + gap
    triangle = [
        ball(f"{row}-{k}", 0.635 + (k - row / 2) * pitch, 1.9 + row * pitch * math.sqrt(0.75))
        for row in range(5)
        for k in range(row + 1)
    ]
    rail = {**RAIL, "points": [[0, 0], [1.27, 0], [1.27, 2.54], [0, 2.54]], "closed": True}
    return table(ball("cue", 0.635, 0.635 + offset, 0.0, 6.0), *triangle, dt=dt, wall=[rail], **more)


def run_for(scene: Scene, time: float) -> Simulation:
    simulation = start(scene)
    advance(simulation, round(time / scene.solver.dt))
    return simulation


def motion_of(simulation: Simulation, index: int) -> tuple[float, ...]:
    frame = simulation.frame()
    assert frame.spin is not None
    return (*frame.velocity[index].tolist(), *frame.spin[index].tolist())


def test_non_colliding_ball_is_slowed_by_the_surface() -> None:
    single = run_for(table(ball("cue", 0, 0, 1.0, 0, collides="none")), 0.1).frame()
    assert single.velocity[0, 0] == pytest.approx(1.0 - SLIDE * G * 0.1, abs=ROUNDING)


def test_combination_shot_passes_through_touching_balls_within_one_step() -> None:
    row = [ball(f"{k}", 0.3 + 2 * RADIUS * k, 0.0) for k in range(3)]
    simulation = start(table(ball("cue", 0, 0, 2.0, 0), *row, dt=0.01))
    simulation.contacts()
    advance(simulation, 14)
    speeds = simulation.frame().velocity[:, 0]
    assert speeds[3] > 0.5 * 2.0  # after three hits of e = 0.95 the last ball has left
    assert len(simulation.contacts()) == 3


def test_ball_pressed_against_a_cushion_by_its_spin_stays_there() -> None:
    """A ball with follow, frozen to the rail, presses until its spin has stopped; it gains no energy and stays near."""
    frozen = table(ball("cue", 1 - RADIUS, 0, spin=[0, 40.0, 0]), wall=[RAIL])
    simulation = start(frozen)
    energy = total_energy(simulation)
    for _ in range(3000):
        simulation.step()
        energy, last = total_energy(simulation), energy
        assert energy <= last + 1e-12  # J, of 7e-2; rounding
    frame = simulation.frame()
    assert energy < 1e-3
    assert 1 - RADIUS - 0.25 < frame.position[0, 0] <= 1 - RADIUS + 0.01 * RADIUS


@pytest.mark.parametrize("dt", [0.01, 0.002])
def test_break_gains_no_energy_and_its_ledger_closes(dt: float) -> None:
    simulation = start(rack(dt, gap=0.0))
    simulation.account()
    initial = energy = total_energy(simulation)
    for _ in range(round(1.5 / dt)):
        simulation.step()
        energy, last = total_energy(simulation), energy
        assert energy <= last + 1e-12  # J, of 3; rounding
    account = simulation.account()
    assert initial + sum(account.values()) == pytest.approx(energy, abs=1e-12)  # rounding of thousands of sums
    assert account[Cause.RESTITUTION] < 0 > account[Cause.FRICTION]
    assert account[Cause.PHANTOM] == account[Cause.INTEGRATOR] == account[Cause.CORRECTION] == 0.0
    position = simulation.frame().position
    distance = np.hypot(*(position[:, None] - position[None]).transpose(2, 0, 1)) + np.eye(16)
    assert distance.min() > 2 * RADIUS * 0.99  # slop


def test_collisions_of_balls_conserve_momentum() -> None:
    simulation = run_for(rack(0.002, surface={"gravity": G}, contact_models=FRICTION_MODELS), 0.24)
    momentum = MASS * simulation.frame().velocity.sum(axis=0)
    assert momentum == pytest.approx([0.0, MASS * 6.0], abs=1e-12)  # rounding; no ball has reached a rail yet


HOLE = {"position": [0.5, 0.0], "radius": 0.06}


def test_pocket_captures_a_ball_whose_centre_enters_it() -> None:
    simulation = start(table(ball("cue", 0, 0, 3.0, 0.0), ball("far", -2, 0), pocket=[HOLE], wall=[RAIL]))
    simulation.account()
    simulation.contacts()
    initial = total_energy(simulation)
    frame = advance(simulation, 300).frame()
    assert frame.position[0].tolist() == [0.5, 0.0]
    assert not any(motion_of(simulation, 0))
    assert frame.present.all()
    (row,) = simulation.contacts()
    assert row.pair == (0, -2)  # the pocket is numbered after the wall
    assert row.impulse[0] > 0.0 == row.impulse[1]
    account = simulation.account()
    assert account[Cause.RETIRED] < 0.0
    assert initial + sum(account.values()) == pytest.approx(total_energy(simulation), abs=ROUNDING)


def test_pocketed_ball_collides_with_nothing_and_can_be_moved_back() -> None:
    scene = table(ball("in", 0.5, 0.01), ball("cue", 0.5, -0.5, 0, 3.0), pocket=[{**HOLE, "radius": 0.02}])
    simulation = start(scene)
    assert simulation.frame().position[0].tolist() == [0.5, 0.0]  # captured at the start
    (row,) = simulation.contacts()
    assert (row.pair, row.time) == ((0, -1), 0.0)
    for action in (
        Impulse(time=0, body="in", impulse=(1.0, 0.0)),
        Force(time=0, body="in", force=(1.0, 0.0)),
        Strike(time=0, ball="in", aim=0.0, speed=1.0),
    ):
        with pytest.raises(ActionError, match="pocket"):
            simulation.apply(action)
    simulation.apply(Move(time=0, body="in", position=(0.0, 1.0), velocity=(1.0, 0.0)))
    simulation.step()
    frame = simulation.frame()
    assert frame.position[0, 0] > 0.0
    assert frame.velocity[0, 0] == pytest.approx(1.0 - SLIDE * G * 0.001, abs=ROUNDING)
    advance(simulation, 400)
    assert simulation.frame().position[1].tolist() == [0.5, 0.0]  # it hit nothing
    simulation.apply(Move(time=0, body="in", position=(0.51, 0.0)))
    assert simulation.frame().position[0].tolist() == [0.5, 0.0]


def test_ball_that_a_zone_holds_stays_when_it_is_hit_and_leaves_when_it_is_pushed() -> None:
    hole = {"position": [0.5, 0.0], "radius": 0.03, "holds": True}
    balls = ball("cue", 0, 0, 1.5, 0.0), ball("next", -0.2, 0, 1.5, 0.0)
    far = {**HOLE, "position": [5, 5]}  # of which zones are supported in a scene without a surface
    simulation = start(table(*balls, zone=[hole], pocket=[far], surface=None, contact_models={}))
    advance(simulation, 500)
    frame = simulation.frame()
    assert frame.position[0].tolist() == [0.5, 0.0]
    assert frame.velocity[0].tolist() == [0.0, 0.0]
    assert frame.position[1, 0] < 0.5 - 2 * RADIUS
    assert frame.velocity[1, 0] < 0.0  # it has come back
    simulation.apply(Impulse(time=0, body="cue", impulse=(0.0, MASS)))
    assert advance(simulation, 100).frame().position[0, 1] > 0.05


GROUNDS = [
    ("plane", {"point": [0.0, 0.0], "normal": [0.0, 1.0]}, 0.0),
    ("plane", {"point": [0.0, 0.0], "normal": [0.0, 1.0]}, 3e7),
    ("wall", {"points": [[-1.0, 0.0], [1.0, 0.0]]}, 0.0),
    ("post", {"position": [0.0, -0.05], "radius": 0.05}, 0.0),
]


@pytest.mark.parametrize(("kind", "ground", "along"), GROUNDS)
@pytest.mark.parametrize(("collides", "speed"), [("all", 0.8), ("fixed", 0.8), ("none", -1.0)])
def test_balls_bounce_off_static_objects_unless_they_collide_with_nothing(
    kind: str, ground: dict[str, Any], along: float, collides: str, speed: float
) -> None:
    balls = [ball("far", along, 0.1, 0.0, -1.0, collides=collides), ball("near", 0, 5)]
    bare = {"surface": {"gravity": G}, "contact_models": {"ball_ball": "frictional"}}
    simulation = start(table(*balls, **{kind: [{**ground, "restitution": 0.8}]}, **bare))
    velocity = advance(simulation, 200).frame().velocity[0, 1]
    assert velocity == pytest.approx(speed, abs=1e-6)  # coordinates of 3e7 m are rounded to 4e-9 m


def test_snapshot_continues_a_break() -> None:
    """Pymunk has no part in the impulses on a surface, so that its state can be copied."""
    simulation = start(rack(0.002))
    simulation.contacts()
    advance(simulation, 130)
    resumed = simulation.snapshot().resumed()
    assert advance(resumed, 200).state_hash() == advance(simulation, 200).state_hash()


def test_strike_sets_the_motion_of_the_cue_model() -> None:
    simulation = start(table(ball("cue", 0, 0, -1.0, 0), ball("other", 1, 1)))
    strike = Strike(time=0, ball="cue", aim=0.3, speed=2.0, side=0.2, height=-0.3)
    simulation.apply(strike)
    velocity, spin = struck(strike, MASS, RADIUS)
    assert motion_of(simulation, 0) == (*velocity, *spin)


def test_constant_forces_act_on_a_surface_and_are_booked() -> None:
    simulation = start(table(ball("cue", 0, 0), surface={"gravity": G}, contact_models={"ball_ball": "frictional"}))
    simulation.account()
    simulation.apply(Force(time=0, body="cue", force=(0.5, 0.0), torque=1e-4))
    advance(simulation, 100)
    vx, _, _, _, wz = motion_of(simulation, 0)
    assert vx == pytest.approx(0.5 / MASS * 0.1, rel=1e-12)
    assert wz == pytest.approx(1e-4 / (0.4 * MASS * RADIUS**2) * 0.1, rel=1e-12)
    assert simulation.account()[Cause.DRIVES] == pytest.approx(total_energy(simulation), rel=1e-12)


def test_spawns_and_removals_do_not_disturb_rolling_balls() -> None:
    scene = table(ball("cue", 0, 0, 1.0, 0), ball("gone", 0.3, 0), pocket=[{**HOLE, "position": [5, 5]}])
    simulation = start(scene)
    new = {"position": (0.1, 0.5), "radius": RADIUS, "mass": MASS, "material": "resin"}
    simulation.apply(Spawn(time=0, ball=Ball(**new, velocity=(0, 1.0), spin=(1.0, 2.0, 3.0))))
    assert motion_of(simulation, 2) == (0, 1.0, 1.0, 2.0, 3.0)
    simulation.apply(Remove(time=0, body="gone"))
    simulation.apply(Spawn(time=0, ball=Ball(position=(5, 5.01), radius=RADIUS)))
    frame = advance(simulation, 300).frame()
    assert frame.present.tolist() == [True, False, True, True]
    assert frame.position[3].tolist() == [5, 5]
    alone = run_for(table(ball("cue", 0, 0, 1.0, 0)), 0.3).frame()
    assert frame.position[0].tolist() == alone.position[0].tolist()
    with pytest.raises(ActionError, match="radii"):
        simulation.apply(Spawn(time=0, ball=Ball(position=(1, 1), radius=0.1)))
    with pytest.raises(ActionError, match="other than balls"):
        simulation.apply(Spawn(time=0, box=Box(position=(1, 1), size=(0.1, 0.1))))
    with pytest.raises(ActionError, match="gravity"):
        simulation.apply(SetParameter(time=0, path="world.gravity", value=[0, -1.0]))
    simulation.apply(SetParameter(time=0, path="pair.0.restitution", value=0.5))
    assert simulation.frame().position[3].tolist() == [5, 5]


def test_partial_step_ends_on_the_path() -> None:
    simulation = start(table(ball("cue", 0, 0, 2.0, 0), ball("object", 0.1, 0.01), dt=0.01, solver={"substeps": 3}))
    advance(simulation, 2)
    simulation.finish(0.7)
    expected = run_for(table(ball("cue", 0, 0, 2.0, 0), ball("object", 0.1, 0.01), dt=0.001), 0.027).frame()
    frame = simulation.frame()
    assert frame.position == pytest.approx(expected.position, abs=1e-9)  # between two hits, with another step size
    assert frame.spin == pytest.approx(expected.spin, abs=1e-6)  # likewise, divided by a radius of 3 cm


def test_audit_reports_no_missed_contacts() -> None:
    holes = [{"position": [x, y], "radius": 0.07} for x in (0, 1.27) for y in (0, 2.54)]
    run = sandbox.run(rack(0.002, seed=1, pocket=holes, world={"duration": 2.0}))
    assert run.status == "ok"
    assert run.missed_contacts == 0
    assert run.spin.shape == (*run.angle.shape, 3)


@pytest.mark.parametrize(
    ("more", "reason"),
    [
        ({"world": {"gravity": [0, -1]}}, "gravity"),
        ({"world": {"linear_drag": 0.1}}, "drag"),
        ({"ball": [ball("a", 0, 0), ball("b", 1, 0, radius=0.05)]}, "radii"),
        ({"box": [{"position": [1, 1], "size": [0.1, 0.1]}]}, "other than balls"),
        ({"joint": [{"kind": "rod", "between": ["cue"], "anchors": [[0, 0], [1, 1]]}]}, "joints"),
    ],
)
def test_unsupported_features_on_a_surface_are_refused(more: dict[str, Any], reason: str) -> None:
    with pytest.raises(Refusal, match=reason):
        start(table(ball("cue", 0, 0), **more))


def test_surface_without_friction_or_models_is_ignored() -> None:
    """Balls on a frictionless surface are discs, and non-colliding ones are particles."""
    balls = [ball("a", 0, 0, 1.0, 0.0), ball("b", 0.5, 0.01), ball("c", 0, 1.0, 1.0, 0.0, collides="none")]
    bare = {"surface": {}, "contact_models": {}, "dt": 0.01}
    with_surface, without = (
        run_for(table(*balls, **bare), 1.0),
        run_for(table(*balls, **{**bare, "surface": None}), 1.0),
    )
    assert with_surface.flying == without.flying == 1
    assert with_surface.frame().roll is None
    assert with_surface.frame().position.tolist() == without.frame().position.tolist()


def test_pockets_work_without_a_surface() -> None:
    simulation = run_for(table(ball("cue", 0, 0, 1.0, 0.0), surface=None, contact_models={}, pocket=[HOLE]), 0.6)
    assert simulation.frame().position[0].tolist() == [0.5, 0.0]


@pytest.mark.parametrize("spin", [1e-200, 5e-324, 1e12])
@pytest.mark.parametrize("speed", [0.0, 1e-300, 1e11])
def test_extreme_spins_and_speeds_stay_finite_and_are_reproducible(spin: float, speed: float) -> None:
    scene = table(ball("cue", 0, 0, speed, 0.0, spin=[spin, -spin, spin]), ball("b", 0.057, 0), wall=[RAIL])
    one, two = run_for(scene, 0.05), run_for(scene, 0.05)
    assert np.isfinite(one.frame().position).all()
    assert one.frame().spin is not None
    assert np.isfinite(one.frame().spin).all()
    assert one.state_hash() == two.state_hash()


def test_coincident_balls_and_a_ball_inside_a_cushion_separate() -> None:
    heap = [ball(f"{k}", 0.0, 0.0) for k in range(3)]
    simulation = run_for(table(*heap, ball("deep", 1.0, 0.0), wall=[RAIL]), 3.0)
    position = simulation.frame().position
    distance = np.hypot(*(position[:, None] - position[None]).transpose(2, 0, 1)) + np.eye(4)
    assert distance.min() > 1.9 * RADIUS
    assert abs(position[3, 0] - 1.0) > 0.9 * RADIUS
    assert total_energy(simulation) == 0.0
