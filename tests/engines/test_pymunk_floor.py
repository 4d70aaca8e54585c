"""Balls on a floor, played by pymunk: free rolling in closed form, the law of each hit, pockets, actions, accounts."""

import math
from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import ActionError, Force, Impulse, Move, Remove, SetParameter, Spawn, Strike, Switch
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import Refusal, Simulation
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import start
from sandbox.engines.switching import SwitchableSimulation
from sandbox.engines.tabletop.collisions import CUSHION, ELASTIC, FRICTIONAL, collide_balls, collide_cushion
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.surface import struck
from sandbox.scene.files.load import from_document

pytestmark = pytest.mark.full  # long runs and sweeps

MASS, RADIUS, G = 0.170097, 0.028575, 9.81
SLIDE, ROLL, SPIN = 0.2, 0.01, 0.0127
CLOTH = {"gravity": G, "sliding_friction": SLIDE, "rolling_friction": ROLL, "spinning_friction": SPIN}
ROUGH = {"ball_ball": "frictional", "cushion": "han2005"}
NOSE = 0.64 * 2 * RADIUS
BUMPER: dict[str, Any] = {"points": [[1, -3], [1, 3]], "height": NOSE, "restitution": 0.85, "friction": 0.2}
ROUNDING = 1e-12  # of sums of up to a few thousand terms of order 1


def ball(name: str, x: float, y: float, vx: float = 0.0, vy: float = 0.0, **more: Any) -> dict[str, Any]:
    disc = {"name": name, "position": [x, y], "velocity": [vx, vy], "radius": RADIUS, "mass": MASS}
    return {**disc, "material": "resin", **more}


def table(*balls: dict[str, Any], dt: float = 0.001, **more: Any) -> Scene:
    document = {
        "world": {"duration": 20.0, **more.pop("world", {})},
        "solver": {"dt": dt, **more.pop("solver", {})},
        "surface": CLOTH,
        "contact_models": ROUGH,
        "material": [{"name": "resin"}],
        "pair": [{"between": ["resin", "resin"], "restitution": 0.95}],
        "ball": list(balls),
        **more,
    }
    return from_document(document)


def rack(dt: float, seed: int = 0, gap: float = 1e-5, **more: Any) -> Scene:
    """A break of 16 balls in a box with rails."""
    off = np.random.default_rng(seed).uniform(-1e-3, 1e-3)
    pitch = 2 * RADIUS + gap
    triangle = [
        ball(f"{row}-{k}", 0.635 + (k - row / 2) * pitch, 1.9 + row * pitch * math.sqrt(0.75))
        for row in range(5)
        for k in range(row + 1)
    ]
    rail = {**BUMPER, "points": [[0, 0], [1.27, 0], [1.27, 2.54], [0, 2.54]], "closed": True}
    return table(ball("cue", 0.635, 0.635 + off, 0.0, 6.0), *triangle, dt=dt, wall=[rail], **more)


def after(scene: Scene, time: float) -> Simulation:
    simulation = start(scene)
    for _ in range(round(time / scene.solver.dt)):
        simulation.step()
    return simulation


def five(simulation: Simulation, number: int) -> tuple[float, ...]:
    frame = simulation.frame()
    assert frame.spin is not None
    return (*frame.velocity[number].tolist(), *frame.spin[number].tolist())


@pytest.mark.parametrize("dt", [0.001, 0.013, 0.1])
def test_a_stun_shot_goes_as_far_as_theory_says(dt: float) -> None:
    speed = 2.0
    lone = table(ball("cue", 0, 0, 0.6 * speed, 0.8 * speed), dt=dt)
    way = 12 * speed**2 / (49 * SLIDE * G) + (5 * speed / 7) ** 2 / (2 * ROLL * G)
    simulation = after(lone, 16.0)
    frame = simulation.frame()
    # phases end within steps: paths are exact whatever the step is
    assert frame.position[0] == pytest.approx([0.6 * way, 0.8 * way], abs=100 * ROUNDING)
    assert not any(five(simulation, 0))


def test_a_slide_ends_when_theory_says_and_rolls_at_five_sevenths() -> None:
    speed = 2.0
    ends = 2 * speed / (7 * SLIDE * G)
    lone = table(ball("cue", 0, 0, speed, 0), dt=ends / 100)
    vx, _, _, wy, _ = five(after(lone, ends), 0)
    assert vx == pytest.approx(5 / 7 * speed, abs=ROUNDING)
    assert wy * RADIUS == pytest.approx(vx, abs=ROUNDING)
    before = five(after(lone, 0.97 * ends), 0)
    slip = before[0] - RADIUS * before[3]
    assert slip == pytest.approx(0.03 * speed, abs=ROUNDING)  # it falls at 7/2·μ_s·g


@pytest.mark.parametrize("back", [1.0, -1.0])
def test_draw_and_follow_end_with_the_momentum_about_the_point_of_contact(back: float) -> None:
    speed, rate = 1.0, back * 60.0
    lone = table(ball("cue", 0, 0, speed, 0, spin=[0.0, rate, 0.0]))
    rolls = (speed + 0.4 * RADIUS * rate) / 1.4
    lasts = 2 * abs(speed - RADIUS * rate) / (7 * SLIDE * G)
    simulation = after(lone, 0.5)
    assert five(simulation, 0)[0] == pytest.approx(rolls - math.copysign(ROLL * G * (0.5 - lasts), rolls), abs=ROUNDING)


def test_side_spin_falls_at_its_own_rate_and_turns_the_ball() -> None:
    rate, fall = 30.0, 5 * SPIN * G / (2 * RADIUS)
    lone = after(table(ball("cue", 0, 0, spin=[0, 0, rate])), 0.5)
    assert five(lone, 0) == (0, 0, 0, 0, pytest.approx(rate - fall * 0.5, abs=ROUNDING))
    later = after(table(ball("cue", 0, 0, spin=[0, 0, rate])), 3.0).frame()
    assert later.angle[0] == pytest.approx(rate**2 / (2 * fall), rel=1e-11)  # of thousands of sums
    assert later.angular_velocity[0] == 0.0


def test_a_ball_without_a_partner_feels_the_floor_as_well() -> None:
    lone = after(table(ball("cue", 0, 0, 1.0, 0, collides="none")), 0.1).frame()
    assert lone.velocity[0, 0] == pytest.approx(1.0 - SLIDE * G * 0.1, abs=ROUNDING)


@pytest.mark.parametrize("model", ["elastic", "frictional"])
@pytest.mark.parametrize("offset", [0.0, 0.3, 0.7])
def test_each_hit_of_two_balls_obeys_its_law(model: str, offset: float) -> None:
    """On a floor that no friction, so that what is before and after is known."""
    spin, speed = [12.0, -7.0, 20.0], 3.0
    # spinning ever so little demands a floor; it is over at once, and is not there at all for balls without ω_z
    smooth = {"gravity": G, "sliding_friction": 0.0}
    y = offset * 2 * RADIUS
    pair = ball("cue", 0, 0, speed, 0.0, spin=spin), ball("object", 0.4, y)
    scene = table(*pair, dt=0.004, surface=smooth, contact_models={"ball_ball": model})
    simulation = start(scene)
    simulation.contacts()
    for _ in range(50):
        simulation.step()
    n = math.sqrt(1 - offset**2), offset
    law = FRICTIONAL if model == "frictional" else ELASTIC
    light = 1 / MASS, 1 / MASS
    mine, theirs = collide_balls(law, 0.95, (speed, 0.0, *spin), (0.0, 0.0, 0.0, 0.0, 0.0), light, RADIUS, *n)
    assert five(simulation, 0) == pytest.approx(mine, abs=ROUNDING)
    assert five(simulation, 1) == pytest.approx(theirs, abs=ROUNDING)
    parting = (theirs[0] - mine[0]) * n[0] + (theirs[1] - mine[1]) * n[1]
    assert parting == pytest.approx(0.95 * speed * n[0], abs=ROUNDING)
    (row,) = simulation.contacts()
    assert row.pair == (0, 1)
    assert row.impulse == pytest.approx([MASS * theirs[0], MASS * theirs[1]], abs=ROUNDING)
    # from when they touched on, at the hit's own place: not from where they were found
    gone = simulation.time - (0.4 - 2 * RADIUS * n[0]) / speed
    assert simulation.frame().position[1] == pytest.approx([0.4 + theirs[0] * gone, y + theirs[1] * gone], abs=ROUNDING)


@pytest.mark.parametrize("model", ["simple", "han2005", "mathavan2010"])
@pytest.mark.parametrize("kind", ["wall", "post", "end"])
def test_each_hit_of_a_cushion_obeys_its_law(model: str, kind: str) -> None:
    spin, speed, lift = [12.0, -7.0, 20.0], 3.0, 0.03
    smooth = {"gravity": G, "sliding_friction": 0.0}
    surface = {"height": NOSE, "restitution": 0.85, "friction": 0.2}
    things: dict[str, Any] = {
        "wall": {"wall": [{**surface, "points": [[1, -3], [1, 3]]}]},
        "post": {"post": [{**surface, "position": [1, lift], "radius": 0.02}]},
        "end": {"wall": [{**surface, "points": [[1, lift], [2, lift]]}]},
    }[kind]
    reach = RADIUS + (0.02 if kind == "post" else 0.0)
    lift = min(lift, 0.8 * reach)
    if kind == "post":
        things["post"][0]["position"][1] = lift
    elif kind == "end":
        things["wall"][0]["points"] = [[1, lift], [2, lift]]
    n = (1.0, 0.0) if kind == "wall" else (math.sqrt(1 - (lift / reach) ** 2), lift / reach)
    models = {"cushion": model}
    scene = table(ball("cue", 0, 0, speed, 0.0, spin=spin), dt=0.004, surface=smooth, contact_models=models, **things)
    simulation = start(scene)
    simulation.contacts()
    for _ in range(120):
        simulation.step()
    law = CUSHION[model]
    expected = collide_cushion(law, 0.85, 0.2, 0.0, (speed, 0.0, *spin), RADIUS, NOSE, *n)
    assert five(simulation, 0) == pytest.approx(expected, abs=ROUNDING)
    (row,) = simulation.contacts()
    assert row.pair == (0, -1)
    assert row.normal == pytest.approx(n, abs=ROUNDING)
    assert row.impulse == pytest.approx([MASS * (speed - expected[0]), -MASS * expected[1]], abs=ROUNDING)


def test_hits_are_found_on_their_paths_whatever_the_step() -> None:
    """A cut and three cushions: only a phase that ends in the very step of a hit would matter, by μ_s·g·h² / 8."""
    rail = {**BUMPER, "points": [[0, 0], [1.2, 0], [1.2, 2.4], [0, 2.4]], "closed": True}

    def ends(dt: float) -> np.ndarray[Any, Any]:
        balls = ball("cue", 0.3, 0.3, 2.6, 1.8, spin=[5, 5, 30]), ball("object", 0.7, 0.6)
        return np.asarray(after(table(*balls, dt=dt, wall=[rail]), 1.6).frame().position)

    finest = ends(1.6 / 6400)
    for steps in (400, 800, 1600):
        assert ends(1.6 / steps) == pytest.approx(finest, abs=1e-9)  # rounding, grown by four hits


def test_a_combination_passes_through_touching_balls_within_one_step() -> None:
    row = [ball(f"{k}", 0.3 + 2 * RADIUS * k, 0.0) for k in range(3)]
    simulation = start(table(ball("cue", 0, 0, 2.0, 0), *row, dt=0.01))
    simulation.contacts()
    for _ in range(14):
        simulation.step()
    speeds = simulation.frame().velocity[:, 0]
    assert speeds[3] > 0.5 * 2.0  # three hits of e = 0.95 on: the last one has left
    assert len(simulation.contacts()) == 3


def test_what_cloth_presses_against_a_cushion_lies_there() -> None:
    """A ball with follow, frozen to the rail, presses on until its spin is gone; it gains nothing and goes nowhere."""
    frozen = table(ball("cue", 1 - RADIUS, 0, spin=[0, 40.0, 0]), wall=[BUMPER])
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
def test_a_break_gains_no_energy_and_its_account_closes(dt: float) -> None:
    simulation = start(rack(dt, gap=0.0))
    simulation.account()
    began = energy = total_energy(simulation)
    for _ in range(round(1.5 / dt)):
        simulation.step()
        energy, last = total_energy(simulation), energy
        assert energy <= last + 1e-12  # J, of 3; rounding
    account = simulation.account()
    assert began + sum(account.values()) == pytest.approx(energy, abs=1e-12)  # rounding of thousands of sums
    assert account[Cause.RESTITUTION] < 0 > account[Cause.FRICTION]
    assert account[Cause.PHANTOM] == account[Cause.INTEGRATOR] == account[Cause.CORRECTION] == 0.0
    position = simulation.frame().position
    away = np.hypot(*(position[:, None] - position[None]).transpose(2, 0, 1)) + np.eye(16)
    assert away.min() > 2 * RADIUS * 0.99  # slop


def test_momentum_is_kept_by_hits_of_balls_alone() -> None:
    simulation = after(rack(0.002, surface={"gravity": G}, contact_models=ROUGH), 0.24)
    momentum = MASS * simulation.frame().velocity.sum(axis=0)
    assert momentum == pytest.approx([0.0, MASS * 6.0], abs=1e-12)  # rounding; nothing has reached a rail yet


HOLE = {"position": [0.5, 0.0], "radius": 0.06}


def test_a_pocket_captures_whose_centre_comes_within_it() -> None:
    simulation = start(table(ball("cue", 0, 0, 3.0, 0.0), ball("far", -2, 0), pocket=[HOLE], wall=[BUMPER]))
    simulation.account()
    simulation.contacts()
    began = total_energy(simulation)
    for _ in range(300):
        simulation.step()
    frame = simulation.frame()
    assert frame.position[0].tolist() == [0.5, 0.0]
    assert not any(five(simulation, 0))
    assert frame.present.all()
    (row,) = simulation.contacts()
    assert row.pair == (0, -2)  # after the one wall
    assert row.impulse[0] > 0.0 == row.impulse[1]
    account = simulation.account()
    assert account[Cause.RETIRED] < 0.0
    assert began + sum(account.values()) == pytest.approx(total_energy(simulation), abs=ROUNDING)


def test_who_lies_in_a_pocket_meets_nothing_and_can_be_put_back() -> None:
    scene = table(ball("in", 0.5, 0.01), ball("cue", 0.5, -0.5, 0, 3.0), pocket=[{**HOLE, "radius": 0.02}])
    simulation = start(scene)
    assert simulation.frame().position[0].tolist() == [0.5, 0.0]  # at once
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
    for _ in range(400):
        simulation.step()
    assert simulation.frame().position[1].tolist() == [0.5, 0.0]  # nothing was in its way
    simulation.apply(Move(time=0, body="in", position=(0.51, 0.0)))
    assert simulation.frame().position[0].tolist() == [0.5, 0.0]


def test_a_strike_is_that_of_the_cue() -> None:
    simulation = start(table(ball("cue", 0, 0, -1.0, 0), ball("other", 1, 1)))
    strike = Strike(time=0, ball="cue", aim=0.3, speed=2.0, side=0.2, height=-0.3)
    simulation.apply(strike)
    velocity, spin = struck(strike, MASS, RADIUS)
    assert five(simulation, 0) == (*velocity, *spin)


def test_steady_forces_act_on_a_floor_and_are_booked() -> None:
    simulation = start(table(ball("cue", 0, 0), surface={"gravity": G}, contact_models={"ball_ball": "frictional"}))
    simulation.account()
    simulation.apply(Force(time=0, body="cue", force=(0.5, 0.0), torque=1e-4))
    for _ in range(100):
        simulation.step()
    vx, _, _, _, wz = five(simulation, 0)
    assert vx == pytest.approx(0.5 / MASS * 0.1, rel=1e-12)
    assert wz == pytest.approx(1e-4 / (0.4 * MASS * RADIUS**2) * 0.1, rel=1e-12)
    assert simulation.account()[Cause.DRIVES] == pytest.approx(total_energy(simulation), rel=1e-12)


def test_bodies_come_and_go_while_others_roll_on() -> None:
    scene = table(ball("cue", 0, 0, 1.0, 0), ball("gone", 0.3, 0), pocket=[{**HOLE, "position": [5, 5]}])
    simulation = start(scene)
    new = {"position": (0.1, 0.5), "radius": RADIUS, "mass": MASS, "material": "resin"}
    simulation.apply(Spawn(time=0, ball=Ball(**new, velocity=(0, 1.0), spin=(1.0, 2.0, 3.0))))
    assert five(simulation, 2) == (0, 1.0, 1.0, 2.0, 3.0)
    simulation.apply(Remove(time=0, body="gone"))
    simulation.apply(Spawn(time=0, ball=Ball(position=(5, 5.01), radius=RADIUS)))
    for _ in range(300):
        simulation.step()
    frame = simulation.frame()
    assert frame.present.tolist() == [True, False, True, True]
    assert frame.position[3].tolist() == [5, 5]
    alone = after(table(ball("cue", 0, 0, 1.0, 0)), 0.3).frame()
    assert frame.position[0].tolist() == alone.position[0].tolist()
    with pytest.raises(ActionError, match="radii"):
        simulation.apply(Spawn(time=0, ball=Ball(position=(1, 1), radius=0.1)))
    with pytest.raises(ActionError, match="other than balls"):
        simulation.apply(Spawn(time=0, box=Box(position=(1, 1), size=(0.1, 0.1))))
    with pytest.raises(ActionError, match="gravity"):
        simulation.apply(SetParameter(time=0, path="world.gravity", value=[0, -1.0]))
    simulation.apply(SetParameter(time=0, path="pair.0.restitution", value=0.5))
    assert simulation.frame().position[3].tolist() == [5, 5]


def test_a_cut_step_ends_where_the_path_does() -> None:
    simulation = start(table(ball("cue", 0, 0, 2.0, 0), ball("object", 0.1, 0.01), dt=0.01, solver={"substeps": 3}))
    for _ in range(2):
        simulation.step()
    simulation.finish(0.7)
    expected = after(table(ball("cue", 0, 0, 2.0, 0), ball("object", 0.1, 0.01), dt=0.001), 0.027).frame()
    frame = simulation.frame()
    assert frame.position == pytest.approx(expected.position, abs=1e-9)  # between two hits that were found otherwise
    assert frame.spin == pytest.approx(expected.spin, abs=1e-6)  # likewise, over a radius of 3 cm


def test_runs_repeat_and_looking_changes_nothing() -> None:
    plain, looked = start(rack(0.002)), start(rack(0.002))
    looked.contacts()
    looked.account()
    looked.watch(lambda *_: None)
    for _ in range(300):
        plain.step()
        looked.step()
        looked.contacts()
    assert plain.state_hash() == looked.state_hash()


def test_a_relay_goes_on_with_spin_and_pockets() -> None:
    scene = table(ball("cue", 0, 0, 2.0, 0.0, spin=[3, 4, 5]), ball("in", 0.5, 0.0), pocket=[HOLE])
    plain, relay = SwitchableSimulation(scene), SwitchableSimulation(scene)
    for k in range(100):
        if k == 50:
            relay.apply(Switch(time=0.0, settings={"iterations": 5}))
            again = SwitchableSimulation.resumed(relay.checkpoint())
        plain.step()
        relay.step()
    for _ in range(50):
        again.step()
    assert plain.state_hash() == relay.state_hash() == again.state_hash()


def test_an_audit_misses_nothing_that_was_dealt_with() -> None:
    holes = [{"position": [x, y], "radius": 0.07} for x in (0, 1.27) for y in (0, 2.54)]
    run = sandbox.run(rack(0.002, seed=1, pocket=holes, world={"duration": 2.0}))
    assert run.status == "ok"
    assert run.missed_contacts == 0
    assert run.spin.shape == (*run.angle.shape, 3)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"world": {"gravity": [0, -1]}}, "gravity"),
        ({"world": {"linear_drag": 0.1}}, "drag"),
        ({"ball": [ball("a", 0, 0), ball("b", 1, 0, radius=0.05)]}, "radii"),
        ({"box": [{"position": [1, 1], "size": [0.1, 0.1]}]}, "other than balls"),
        ({"joint": [{"kind": "rod", "between": ["cue"], "anchors": [[0, 0], [1, 1]]}]}, "joints"),
    ],
)
def test_what_a_floor_does_not_go_with_is_refused(more: dict[str, Any], words: str) -> None:
    with pytest.raises(Refusal, match=words):
        start(table(ball("cue", 0, 0), **more))


def test_a_floor_that_nothing_asks_of_costs_nothing() -> None:
    """Balls that no floor slows are discs, and those that meet nothing fly."""
    some = [ball("a", 0, 0, 1.0, 0.0), ball("b", 0.5, 0.01), ball("c", 0, 1.0, 1.0, 0.0, collides="none")]
    bare = {"surface": {}, "contact_models": {}, "dt": 0.01}
    on, off = after(table(*some, **bare), 1.0), after(table(*some, **{**bare, "surface": None}), 1.0)
    assert on.flying == off.flying == 1
    assert on.frame().roll is None
    assert on.frame().position.tolist() == off.frame().position.tolist()


def test_a_floor_is_felt_where_it_only_has_pockets() -> None:
    simulation = after(table(ball("cue", 0, 0, 1.0, 0.0), surface=None, contact_models={}, pocket=[HOLE]), 0.6)
    assert simulation.frame().position[0].tolist() == [0.5, 0.0]


@pytest.mark.parametrize("spin", [1e-200, 5e-324, 1e12])
@pytest.mark.parametrize("speed", [0.0, 1e-300, 1e11])
def test_extreme_spins_and_speeds_stay_finite_and_repeat(spin: float, speed: float) -> None:
    scene = table(ball("cue", 0, 0, speed, 0.0, spin=[spin, -spin, spin]), ball("b", 0.057, 0), wall=[BUMPER])
    one, two = after(scene, 0.05), after(scene, 0.05)
    assert np.isfinite(one.frame().position).all()
    assert one.frame().spin is not None
    assert np.isfinite(one.frame().spin).all()
    assert one.state_hash() == two.state_hash()


def test_balls_on_one_spot_and_deep_in_a_cushion_come_apart() -> None:
    heap = [ball(f"{k}", 0.0, 0.0) for k in range(3)]
    simulation = after(table(*heap, ball("deep", 1.0, 0.0), wall=[BUMPER]), 3.0)
    position = simulation.frame().position
    away = np.hypot(*(position[:, None] - position[None]).transpose(2, 0, 1)) + np.eye(4)
    assert away.min() > 1.9 * RADIUS
    assert abs(position[3, 0] - 1.0) > 0.9 * RADIUS
    assert total_energy(simulation) == 0.0
