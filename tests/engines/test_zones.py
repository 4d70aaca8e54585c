"""Zones: who comes in is noted in the substep in which its centre first lies inside, and what zones then do."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sandbox
from sandbox.action import Action, Force, Impulse, Move, Pull, Remove, SetParameter, Spawn, Switch
from sandbox.engines.contract import Refusal
from sandbox.engines.switching import SwitchableSimulation
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import AWAY, HELD, INSIDE, RELEASED
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory

both = pytest.mark.parametrize("engine", ["pymunk", "reference"])

H = 0.002
"""s, the substep of these scenes"""
SHAPES: dict[str, dict[str, Any]] = {
    "circle": {"position": [1.0, 0.0], "radius": 0.25},
    "strip": {"points": [[0.75, -1.0], [0.75, 1.0], [1.25, 1.0]], "thickness": 0.2},
    "polygon": {"points": [[0.6, -0.5], [1.4, -0.5], [1.4, 0.5], [1.0, 0.3], [0.6, 0.5]]},
}
"""with where a body that flies along the x axis comes in, and out again"""
ENTRY = {"circle": (0.75, 1.25), "strip": (0.65, 0.85), "polygon": (0.6, 1.4)}


def run_on(engine: str, scene: Scene, **more: Any) -> Trajectory:
    return sandbox.run(scene, engine, **more)


def start_on(engine: str, scene: Scene) -> SwitchableSimulation:
    return sandbox.start(scene, engine)


def scene_of(*zones: dict[str, Any], ball: dict[str, Any] | None = None, **more: Any) -> Scene:
    one = {"name": "ball", "position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 0.05, **(ball or {})}
    solver = {"dt": 5 * H, "substeps": 5}
    return from_document({"solver": solver, "world": {"duration": 2.0}, "ball": [one], "zone": list(zones), **more})


def entries(run: Trajectory, scene: Scene) -> list[tuple[float, str]]:
    """Return when which zone noted somebody."""
    first = -1 - len(scene.fixed)
    return [
        (time, scene.fixed_names[-1 - other])
        for time, (_, other) in zip(run.contact_time.tolist(), run.contact_pair.tolist(), strict=True)
        if other <= first
    ]


@both
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("speed", [0.7, 1.0, 3.3])
def test_entry_is_noted_in_the_substep_in_which_the_centre_comes_in(engine: str, shape: str, speed: float) -> None:
    scene = scene_of({"name": "it", **SHAPES[shape]}, ball={"velocity": [speed, 0.0]})
    run = run_on(engine, scene)
    ((time, name),) = entries(run, scene)
    due = ENTRY[shape][0] / speed
    assert name == "it"
    assert due - 1e-9 <= time <= due + H + 1e-9  # the first end of a substep from then on; sums of h round
    assert run.contact_impulse.tolist() == [[0.0, 0.0]]
    assert run.contact_normal.tolist() == [[1.0, 0.0]]
    assert run.contact_point[0].tolist() == pytest.approx([speed * time, 0.0], abs=1e-9)  # sums of v·h


@both
@given(
    angle=st.floats(0.0, 2.0 * math.pi),
    offset=st.floats(-0.9, 0.9),
    speed=st.floats(0.5, 4.0),
    phase=st.floats(0.0, 1.0),
)
@settings(max_examples=40, deadline=None)
def test_chord_of_a_circle_is_noted_when_it_begins(
    engine: str, angle: float, offset: float, speed: float, phase: float
) -> None:
    """A chord at a distance of a share of the radius, from any side, at any phase of the steps."""
    radius, far = 0.2, 0.5 + phase * speed * H
    along, across = np.asarray((math.cos(angle), math.sin(angle))), np.asarray((-math.sin(angle), math.cos(angle)))
    start = -far * along + offset * radius * across
    half = radius * math.sqrt(1.0 - offset**2)
    due = (far - half) / speed
    scene = scene_of(
        {"position": [0.0, 0.0], "radius": radius},
        ball={"position": start.tolist(), "velocity": (speed * along).tolist()},
    )
    noted = entries(run_on(engine, scene, audit=False), scene)
    assert len(noted) == 1
    assert due - 1e-9 <= noted[0][0] <= due + H + 1e-9


@both
def test_who_starts_inside_is_noted_at_the_start_with_no_direction(engine: str) -> None:
    scene = scene_of({"position": [0.0, 0.0], "radius": 0.3}, ball={"velocity": [0.0, 0.0]})
    run = run_on(engine, scene)
    assert entries(run, scene) == [(0.0, "zone-1")]
    assert run.contact_normal.tolist() == [[0.0, 1.0]]


@both
def test_each_visit_is_noted_once(engine: str) -> None:
    """Back and forth between two posts through a zone: a note for each time that the centre comes in."""
    posts = [{"position": [x, 0.0], "radius": 0.1, "restitution": 1.0} for x in (-0.5, 0.5)]
    scene = scene_of({"position": [0.0, 0.0], "radius": 0.1}, post=posts, ball={"restitution": 1.0})
    noted = entries(run_on(engine, scene), scene)
    # It starts inside, and comes back after 2·(0.35 − 0.1) m + 0.1 m out and so on, each way of 0.7 m at 1 m/s.
    due = [0.0, 0.6, 1.3, 2.0]
    assert [time for time, _ in noted] == pytest.approx(due[: len(noted)], abs=8 * H)  # a bounce comes up to h late
    assert len(noted) >= 3


@both
def test_zones_note_neither_what_is_fixed_nor_what_meets_nothing(engine: str) -> None:
    zone = {"position": [0.0, 0.0], "radius": 3.0}
    balls = [
        {"position": [0.0, 0.0], "radius": 0.1, "collides": "none"},
        {"position": [1.0, 0.0], "radius": 0.1, "fixed": True},
    ]
    scene = from_document({"world": {"duration": 0.5}, "zone": [zone], "ball": balls})
    assert entries(run_on(engine, scene), scene) == []


@both
def test_a_scene_is_not_changed_by_zones_that_only_note(engine: str) -> None:
    walls = [{"points": [[-1, -1], [1, -1], [1, 1], [-1, 1]], "closed": True, "restitution": 1.0, "friction": 0.3}]
    balls = {"name": "crowd", "count": 12, "lower": [-0.9, -0.9], "upper": [0.9, 0.9], "radius": 0.08}
    balls |= {"velocity_jitter": 3.0, "restitution": 1.0, "friction": 1.0}
    plain = {"world": {"duration": 1.0, "gravity": [0.0, -3.0]}, "wall": walls, "scatter": [balls]}
    runs = [run_on(engine, from_document({**plain, "zone": zones})) for zones in ([], list(SHAPES.values()))]
    one, other = runs
    for key in ("position", "velocity", "angle", "angular_velocity"):
        assert np.array_equal(getattr(one, key), getattr(other, key)), key
    assert len(other.contact_time) > len(one.contact_time)


@both
def test_gravity_of_a_zone_is_a_slope_up_and_down_again(engine: str) -> None:
    """Up a slope of g = 2 m/s² at 1.5 m/s: it turns after v²/2g = 0.5625 m, and leaves as fast as it came."""
    slope = {"points": [[0.5, -1], [2, -1], [2, 1], [0.5, 1]], "gravity": [-2.0, 0.0]}
    run = run_on(engine, scene_of(slope, ball={"velocity": [1.5, 0.0]}))
    # It comes in up to h late, v·h farther; explicit Euler rises g·h·t/2 too high, with t = 0.75 s.
    assert run.position[:, 0, 0].max() == pytest.approx(0.5 + 0.5625, abs=1.5 * H + 2.0 * H * 0.75)
    # The velocity is exact but for the substeps at the edge, in which it acts or not, and by which it is late.
    assert run.velocity[-1, 0, 0] == pytest.approx(-1.5, abs=3 * 2.0 * H)


@both
def test_gravity_of_a_zone_replaces_the_worlds_and_drag_goes_on_acting(engine: str) -> None:
    """v̇ = g − k v from rest, with the zone's g: v = g/k·(1 − e^(−kt)).

    pymunk's drag is exact in each substep; of the reference's rk4 (k·h)⁴·k·T/120 is left out, 5e-14.
    """
    zone = {"position": [0.0, 0.0], "radius": 50.0, "gravity": [3.0, 1.0]}
    world = {"duration": 1.0, "gravity": [0.0, -9.81], "linear_drag": 0.8}
    scene = scene_of(zone, ball={"velocity": [0.0, 0.0]}, world=world)
    run = run_on(engine, scene, **({"integrator": "rk4"} if engine == "reference" else {}))
    expected = np.asarray([3.0, 1.0]) / 0.8 * -math.expm1(-0.8)
    assert run.velocity[-1, 0] == pytest.approx(expected, rel=1e-12)  # rounding of 500 substeps


@both
def test_world_gravity_that_changes_changes_nothing_inside(engine: str) -> None:
    zone = {"position": [0.0, 0.0], "radius": 50.0, "gravity": [1.0, 0.0]}
    turn = SetParameter(time=0.5, path="world.gravity", value=[0.0, -5.0])
    run = run_on(engine, scene_of(zone, ball={"velocity": [0.0, 0.0]}, world={"duration": 1.0}), actions=[turn])
    assert run.velocity[-1, 0] == pytest.approx([1.0, 0.0], abs=1e-12)  # rounding of 500 sums


HOLE: dict[str, Any] = {"name": "hole", "position": [1.0, 0.0], "radius": 0.08, "holds": True}


def started(engine: str, scene: Scene, seconds: float) -> SwitchableSimulation:
    relay = start_on(engine, scene)
    relay.contacts()
    while relay.time < seconds - 1e-9:
        relay.step()
    return relay


@both
def test_held_body_stands_at_the_centre_whatever_comes(engine: str) -> None:
    """Gravity pulls, and a heavy ball hits it: that one bounces off as off a wall, e = 1."""
    heavy = {"name": "heavy", "position": [1.0, 3.0], "velocity": [0.0, -2.0], "radius": 0.1, "mass": 50.0}
    one = {"name": "ball", "position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 0.05, "restitution": 1.0}
    scene = from_document(
        {
            "world": {"duration": 2.0},
            "solver": {"dt": 5 * H, "substeps": 5},
            "ball": [one, {**heavy, "restitution": 1.0}],
            "zone": [{**HOLE, "gravity": [0.0, -20.0]}],
        }
    )
    run = run_on(engine, scene)
    late = run.time > 1.05
    assert (run.position[late, 0] == [1.0, 0.0]).all()
    assert not run.velocity[late, 0].any()
    assert run.velocity[-1, 1, 1] == pytest.approx(2.0, rel=1e-12)  # against what does not move


@both
@pytest.mark.parametrize(
    "release",
    [
        Impulse(time=0, body="ball", impulse=(0.0, 2.0)),
        Move(time=0, body="ball", position=(1.0, 0.0), velocity=(0.0, 2.0)),
        Force(time=0, body="ball", force=(0.0, 5.0)),
        Pull(time=0, body="ball", target=(1.0, 2.0)),
        Move(time=0, body="ball", position=(3.0, 3.0)),
    ],
    ids=["impulse", "kick", "force", "pull", "carried away"],
)
def test_held_body_is_freed_by_who_drives_it_and_not_caught_before_it_has_left(engine: str, release: Action) -> None:
    relay = started(engine, scene_of(HOLE), 1.5)
    assert relay.frame().visits is not None
    assert relay.frame().visits.tolist() == [[HELD]]
    relay.apply(release)
    relay.step()
    assert relay.frame().visits.tolist() in ([[RELEASED]], [[AWAY]])
    for _ in range(100):
        relay.step()
    frame = relay.frame()
    assert frame.visits.tolist() == [[AWAY]]
    assert np.hypot(*(frame.position[0] - [1.0, 0.0])) > 0.08


@both
def test_let_go_body_weighs_what_it_did_and_is_caught_when_it_comes_back(engine: str) -> None:
    """Thrown up at 2 m/s against g = 10: it is back after 0.4 s, and held again at once."""
    zone = {**HOLE, "layers": ["ground"]}
    scene = scene_of(zone, world={"duration": 3.0, "gravity": [0.0, 0.0]}, ball={"mass": 0.25})
    relay = started(engine, scene, 1.2)
    relay.apply(SetParameter(time=0, path="world.gravity", value=[0.0, -10.0]))
    relay.apply(Impulse(time=0, body="ball", impulse=(0.0, 0.5)))  # 0.25 kg · 2 m/s
    began, top = relay.time, 0.0
    while relay.frame().visits.tolist() != [[HELD]]:
        relay.step()
        top = max(top, float(relay.frame().position[0, 1]))
    assert top == pytest.approx(0.2, abs=10.0 * H * 0.4)  # v²/2g; explicit Euler is g·h·t/2 off
    # It comes in 0.08 m above the centre: t = (v + √(v² − 2·g·0.08))/g, seen at the end of its step.
    due = (2.0 + math.sqrt(4.0 - 1.6)) / 10.0
    assert relay.time - began == pytest.approx(due, abs=5 * H + 2 * H)
    assert relay.frame().position.tolist() == [[1.0, 0.0]]


@both
@pytest.mark.parametrize(
    "release",
    [
        Impulse(time=0.0, body="ball", impulse=(0.3, 0.0)),
        Move(time=0.0, body="ball", position=(2.0, 0.0), velocity=(1.0, 0.0)),
    ],
    ids=["kicked", "moved"],
)
def test_body_that_starts_in_a_hole_can_be_let_go(engine: str, release: Action) -> None:
    scene = scene_of({"position": [0.0, 0.0], "radius": 0.2, "holds": True}, ball={"mass": 0.3})
    relay = started(engine, scene, 0.1)
    assert relay.frame().visits is not None and relay.frame().visits.tolist() == [[HELD]]
    relay.apply(release)
    relay.step()
    np.testing.assert_allclose(relay.frame().velocity[0], [1.0, 0.0], rtol=1e-15)


@both
def test_what_is_held_amid_an_overlap_is_not_shifted_by_it(engine: str) -> None:
    """Half of the ball is in the wall as it joins; pymunk would go on to push it out after it was caught."""
    hole = {"position": [1.0, 0.0], "radius": 0.1, "holds": True}
    wall = {"points": [[0.0, -0.05], [2.0, -0.05]], "thickness": 0.02}
    relay = started(engine, scene_of(hole, ball={"position": [-5.0, 0.0]}, wall=[wall]), 0.0)
    relay.account()
    relay.apply(Spawn(time=0.0, ball=Ball(name="late", position=(1.0, 0.03), radius=0.2)))
    for _ in range(3):
        relay.step()
    assert relay.frame().position[1].tolist() == [1.0, 0.0]


@both
@pytest.mark.parametrize("drag", [{"linear_drag": 0.5}, {"quadratic_drag": 0.5, "wind": [2.0, 0.0]}])
def test_air_does_not_move_who_is_held_under_another_gravity(engine: str, drag: dict[str, Any]) -> None:
    hole = {"position": [0.0, 0.0], "radius": 0.2, "holds": True, "gravity": [3.0, 4.0]}
    relay = started(engine, scene_of(hole, world={"duration": 1.0, **drag}), 0.2)
    assert relay.frame().position.tolist() == [[0.0, 0.0]]
    assert relay.frame().velocity.tolist() == [[0.0, 0.0]]


@both
def test_hole_holds_one_at_a_time(engine: str) -> None:
    balls = [
        {"name": name, "position": [x, 0.0], "velocity": [1.0, 0.0], "radius": 0.05}
        for name, x in (("first", 0.5), ("second", 0.0))
    ]
    wide = {"position": [1.0, 0.0], "radius": 0.3, "holds": True}
    relay = started(engine, from_document({"world": {"duration": 2.0}, "ball": balls, "zone": [wide]}), 1.9)
    frame = relay.frame()
    assert frame.position[0].tolist() == [1.0, 0.0]
    assert frame.visits[0].tolist() == [HELD]
    assert frame.visits[1, 0] in (AWAY, INSIDE)


@both
def test_what_hangs_on_a_joint_is_noted_and_not_held(engine: str) -> None:
    rope = {"kind": "rod", "between": ["ball"], "anchors": [[0, 0], [0, 1]]}
    scene = scene_of({"position": [0.3, 0.05], "radius": 0.2, "holds": True}, joint=[rope])
    run = run_on(engine, scene)
    assert len(entries(run, scene)) >= 1
    assert np.hypot(*run.velocity[-1, 0]) > 0.5


@both
def test_removed_body_is_in_no_zone_and_makes_room(engine: str) -> None:
    relay = started(engine, scene_of(HOLE), 1.5)
    relay.apply(Remove(time=0, body="ball"))
    ball = Ball(name="next", position=(0.8, 0.0), velocity=(1.0, 0.0), radius=0.05)
    relay.apply(Spawn(time=0, ball=ball))
    for _ in range(40):
        relay.step()
    assert relay.frame().visits.tolist() == [[AWAY], [HELD]]


@both
def test_books_close_with_zones_that_hold_and_lift(engine: str) -> None:
    zones = [HOLE, {"points": [[0.2, -1], [0.6, -1], [0.6, 1], [0.2, 1]], "gravity": [4.0, 6.0]}]
    scene = scene_of(*zones, world={"duration": 2.0, "gravity": [0.0, -1.0]}, ball={"position": [0.0, 0.2]})
    free = Impulse(time=1.5, body="ball", impulse=(0.3, 0.3))
    run = run_on(engine, scene, account=True, actions=[free])
    residual = run.energy - run.energy[0] - run.account.sum(axis=1)
    assert np.abs(residual).max() < 1e-12  # J, rounding of sums of about 1 J
    drives = run.account[-1, run.info["causes"].index("drives")]
    assert abs(drives) > 0.1


def replayed(engine: str, scene: Scene, actions: list[Action]) -> str:
    return str(run_on(engine, scene, actions=actions, audit=False).info["state_hash"])


@both
def test_engine_taken_up_again_goes_on_the_same_way(engine: str) -> None:
    """A switch in each quarter of a run with slopes, layers, a hole that holds and lets go: visits are handed over."""
    zones = [
        {"points": [[0.2, -1], [0.6, -1], [0.6, 1], [0.2, 1]], "gravity": [1.0, 0.0], "layers": ["ground", "up"]},
        {"position": [0.3, 0.0], "radius": 0.05, "to_layer": "up"},
        {**HOLE, "layers": ["up"]},
    ]
    scene = scene_of(*zones)
    free = Impulse(time=1.5, body="ball", impulse=(0.1, 0.2))
    plain = run_on(engine, scene, actions=[free])
    switches = [Switch(time=t) for t in (0.25, 0.3, 0.45, 1.2, 1.52)]
    switched = run_on(engine, scene, actions=[*switches, free])
    assert switched.info["state_hash"] == plain.info["state_hash"]
    assert entries(switched, scene) == entries(plain, scene)
    assert plain.layer[:, 0].tolist() == switched.layer[:, 0].tolist()


@both
def test_checkpoints_hold_visits_and_layers(engine: str) -> None:
    relay = started(engine, scene_of(HOLE, {"position": [0.5, 0.0], "radius": 0.1, "to_layer": "up"}), 0.5)
    point = relay.checkpoint()
    ways = []
    for each in (relay, SwitchableSimulation.resumed(point)):
        for _ in range(120):
            each.step()
        ways.append(each.state_hash())
    assert ways[0] == ways[1]


def test_exact_engine_refuses_zones() -> None:
    with pytest.raises(Refusal, match="zones"):
        sandbox.start(scene_of(HOLE), "exact")


def test_half_kick_is_refused_with_zones_that_change_motion() -> None:
    with pytest.raises(Refusal, match="half_kick"):
        sandbox.start(scene_of(HOLE, solver={"half_kick": True}))


@both
def test_contacts_that_last_keep_their_impulses_while_others_are_noted(engine: str) -> None:
    """A heap rests while a ball flies through zones above it: each resting contact bears the same as without them."""
    plane = {"point": [0.0, -1.0], "normal": [0.0, 1.0], "layers": ["ground"]}
    balls = [{"position": [0.3 * k, -0.9], "radius": 0.1} for k in range(3)]
    flies = {"name": "flies", "position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 0.05, "layer": "air"}
    gates = [{"position": [0.2 + 0.1 * k, 0.0], "radius": 0.04, "layers": ["air"]} for k in range(8)]
    world = {"duration": 1.0, "gravity": [0.0, -2.0]}
    sky = {"position": [0.0, 0.0], "radius": 9.0, "layers": ["air"], "gravity": [0.0, 0.0]}
    plain, noted = (
        run_on(
            engine,
            from_document({"world": world, "ball": [*balls, flies], "plane": [plane], "zone": [sky, *more]}),
            audit=False,
        )
        for more in ([], gates)
    )
    rests = [run.contact_impulse[run.contact_pair[:, 1] == -1] for run in (plain, noted)]
    assert np.array_equal(*rests)
    assert rests[0][:, 1] == pytest.approx(-2.0, abs=0.1)  # m·g·t of each, 1 kg · 2 m/s² · 1 s, but the first touch
    assert len(noted.contact_time) - len(plain.contact_time) == 8
