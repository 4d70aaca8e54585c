"""Zones: entries are recorded in the substep in which a centre is first inside; effects of zones on bodies."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sandbox
from sandbox.action import Action, Force, Impulse, Move, Pull, Remove, SetParameter, Spawn
from sandbox.engines.common.zoned_bodies import distance_to_outlines, is_inside, make_zone_shapes
from sandbox.engines.contract import Refusal
from sandbox.engines.switching import SwitchableSimulation
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import AWAY, HELD, INSIDE, RELEASED
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory
from tests.engines.builders import make_scene
from tests.engines.stepping import advance

every_engine = pytest.mark.parametrize("engine", ["pymunk", "box2d", "reference"])
with_impulses = pytest.mark.parametrize("engine", ["pymunk", "reference"])
"""engines that know the impulses of contacts, and account for energy"""


def rounding(engine: str, tolerance: float) -> float:
    """Return a tolerance for rounding errors of 64-bit numbers; with 32-bit numbers, 2²⁹ of it."""
    return tolerance * 2.0**29 if engine == "box2d" else tolerance


H = 0.002
"""Substep of these scenes, s."""
SHAPES: dict[str, dict[str, Any]] = {
    "circle": {"position": [1.0, 0.0], "radius": 0.25},
    "strip": {"points": [[0.75, -1.0], [0.75, 1.0], [1.25, 1.0]], "thickness": 0.2},
    "polygon": {"points": [[0.6, -0.5], [1.4, -0.5], [1.4, 0.5], [1.0, 0.3], [0.6, 0.5]]},
}
CROSSINGS = {"circle": (0.75, 1.25), "strip": (0.65, 0.85), "polygon": (0.6, 1.4)}
"""x at which a body that moves along the x axis enters and leaves each shape, m."""


COORDINATE = st.floats(-2.0, 3.0)


@given(COORDINATE, COORDINATE, st.floats(0.0, 2.0 * math.pi), st.floats(0.0, 0.999999))
def test_no_outline_is_nearer_than_its_distance(x: float, y: float, heading: float, fraction: float) -> None:
    """A point that moves by less than the distance to the nearest outline stays inside or outside of each zone."""
    shapes = make_zone_shapes(scene_of(*SHAPES.values()).zones)
    reach = fraction * distance_to_outlines(shapes, x, y)
    moved = x + reach * math.cos(heading), y + reach * math.sin(heading)
    inside = [
        [is_inside(shapes.edge, shapes.first[z], shapes.first[z + 1], shapes.radius[z], *point) for z in range(3)]
        for point in ((x, y), moved)
    ]
    assert inside[0] == inside[1]


def run_on(engine: str, scene: Scene, **more: Any) -> Trajectory:
    return sandbox.run(scene, engine, **more)


def start_on(engine: str, scene: Scene) -> SwitchableSimulation:
    return sandbox.start(scene, engine)


def scene_of(*zones: dict[str, Any], ball: dict[str, Any] | None = None, **more: Any) -> Scene:
    moving = {"name": "ball", "position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 0.05, **(ball or {})}
    solver = {"dt": 5 * H, "substeps": 5}
    return from_document({"solver": solver, "world": {"duration": 2.0}, "ball": [moving], "zone": list(zones), **more})


def entries(run: Trajectory, scene: Scene) -> list[tuple[float, str]]:
    """Return the time and zone of each recorded entry."""
    first = -1 - len(scene.fixed)
    return [
        (time, scene.fixed_names[-1 - other])
        for time, (_, other) in zip(run.contact_time.tolist(), run.contact_pair.tolist(), strict=True)
        if other <= first
    ]


@every_engine
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("speed", [0.7, 1.0, 3.3])
def test_entry_is_recorded_in_the_substep_in_which_the_centre_enters(engine: str, shape: str, speed: float) -> None:
    scene = scene_of({"name": "it", **SHAPES[shape]}, ball={"velocity": [speed, 0.0]})
    run = run_on(engine, scene)
    ((time, name),) = entries(run, scene)
    expected = CROSSINGS[shape][0] / speed
    assert name == "it"
    # the first end of a substep after entry; rounding of sums of h
    assert expected - 1e-9 <= time <= expected + H + 1e-9
    assert run.contact_impulse.tolist() == [[0.0, 0.0]]
    assert run.contact_normal.tolist() == [[1.0, 0.0]]
    sums = 1e-5 if engine == "box2d" else 1e-9  # of v·h, of up to 700 numbers of 32 bits on Box2D
    assert run.contact_point[0].tolist() == pytest.approx([speed * time, 0.0], abs=sums)


@pytest.mark.fail_slow(60)  # takes over half a second
@every_engine
@given(
    angle=st.floats(0.0, 2.0 * math.pi),
    offset=st.floats(-0.9, 0.9),
    speed=st.floats(0.5, 4.0),
    phase=st.floats(0.0, 1.0),
)
def test_entry_into_a_circle_is_recorded_on_any_chord(
    engine: str, angle: float, offset: float, speed: float, phase: float
) -> None:
    """A chord at any distance within the radius, from any side, at any phase of the steps."""
    radius, start_distance = 0.2, 0.5 + phase * speed * H
    along, across = np.asarray((math.cos(angle), math.sin(angle))), np.asarray((-math.sin(angle), math.cos(angle)))
    start = -start_distance * along + offset * radius * across
    half = radius * math.sqrt(1.0 - offset**2)
    expected = (start_distance - half) / speed
    scene = scene_of(
        {"position": [0.0, 0.0], "radius": radius},
        ball={"position": start.tolist(), "velocity": (speed * along).tolist()},
    )
    recorded = entries(run_on(engine, scene, audit=False), scene)
    assert len(recorded) == 1
    rounding = 1e-9 if engine != "box2d" else 1e-5  # s; positions of Box2D have 32 bits
    assert expected - rounding <= recorded[0][0] <= expected + H + rounding


@every_engine
def test_body_that_starts_inside_is_recorded_at_the_start(engine: str) -> None:
    scene = scene_of({"position": [0.0, 0.0], "radius": 0.3}, ball={"velocity": [0.0, 0.0]})
    run = run_on(engine, scene)
    assert entries(run, scene) == [(0.0, "zone-1")]
    assert run.contact_normal.tolist() == [[0.0, 1.0]]


@every_engine
def test_each_visit_is_recorded_once(engine: str) -> None:
    """A ball bounces between two posts through a zone: one row for each entry of its centre."""
    posts = [{"position": [x, 0.0], "radius": 0.1, "restitution": 1.0} for x in (-0.5, 0.5)]
    scene = scene_of({"position": [0.0, 0.0], "radius": 0.1}, post=posts, ball={"restitution": 1.0})
    recorded = entries(run_on(engine, scene), scene)
    # It starts inside, leaves by 0.1 m, returns after 2·(0.35 − 0.1) m, and then crosses 0.7 m each time at 1 m/s.
    expected = [0.0, 0.6, 1.3, 2.0]
    # a bounce is up to h late
    assert [time for time, _ in recorded] == pytest.approx(expected[: len(recorded)], abs=8 * H)
    assert len(recorded) >= 3


@every_engine
def test_zones_ignore_fixed_and_non_colliding_bodies(engine: str) -> None:
    zone = {"position": [0.0, 0.0], "radius": 3.0}
    balls = [
        {"position": [0.0, 0.0], "radius": 0.1, "collides": "none"},
        {"position": [1.0, 0.0], "radius": 0.1, "fixed": True},
    ]
    scene = from_document({"world": {"duration": 0.5}, "zone": [zone], "ball": balls})
    assert entries(run_on(engine, scene), scene) == []


@every_engine
def test_zones_without_effects_do_not_change_the_run(engine: str) -> None:
    walls = [{"points": [[-1, -1], [1, -1], [1, 1], [-1, 1]], "closed": True, "restitution": 1.0, "friction": 0.3}]
    balls = {"name": "crowd", "count": 12, "lower": [-0.9, -0.9], "upper": [0.9, 0.9], "radius": 0.08}
    balls |= {"velocity_jitter": 3.0, "restitution": 1.0, "friction": 1.0}
    plain = {"world": {"duration": 1.0, "gravity": [0.0, -3.0]}, "wall": walls, "scatter": [balls]}
    runs = [run_on(engine, from_document({**plain, "zone": zones})) for zones in ([], list(SHAPES.values()))]
    plain_run, zone_run = runs
    for key in ("position", "velocity", "angle", "angular_velocity"):
        assert np.array_equal(getattr(plain_run, key), getattr(zone_run, key)), key
    assert len(zone_run.contact_time) > len(plain_run.contact_time)


@every_engine
def test_gravity_zone_acts_as_a_slope_up_and_down(engine: str) -> None:
    """Against g = 2 m/s² at 1.5 m/s the ball turns after v²/2g = 0.5625 m and leaves as fast as it entered."""
    slope = {"points": [[0.5, -1], [2, -1], [2, 1], [0.5, 1]], "gravity": [-2.0, 0.0]}
    run = run_on(engine, scene_of(slope, ball={"velocity": [1.5, 0.0]}))
    # It enters up to h late, v·h farther in; explicit Euler overshoots by g·h·t/2, with t = 0.75 s.
    assert run.position[:, 0, 0].max() == pytest.approx(0.5 + 0.5625, abs=1.5 * H + 2.0 * H * 0.75)
    # The velocity is exact up to the substeps at the edge.
    assert run.velocity[-1, 0, 0] == pytest.approx(-1.5, abs=3 * 2.0 * H)


@every_engine
def test_gravity_zone_replaces_world_gravity_while_drag_persists(engine: str) -> None:
    """v̇ = g − k v from rest, with the gravity of the zone: v = g/k·(1 − e^(−kt)).

    Drag on pymunk is exact in each substep; rk4 of the reference has an error of (k·h)⁴·k·T/120, 5e-14; Box2D's scheme
    is of order 1, with an error below k·h.
    """
    zone = {"position": [0.0, 0.0], "radius": 50.0, "gravity": [3.0, 1.0]}
    world = {"duration": 1.0, "gravity": [0.0, -9.81], "linear_drag": 0.8}
    scene = scene_of(zone, ball={"velocity": [0.0, 0.0]}, world=world)
    run = run_on(engine, scene, **({"integrator": "rk4"} if engine == "reference" else {}))
    expected = np.asarray([3.0, 1.0]) / 0.8 * -math.expm1(-0.8)
    # rounding of 500 substeps
    assert run.velocity[-1, 0] == pytest.approx(expected, rel=0.8 * H if engine == "box2d" else 1e-12)


@every_engine
def test_change_of_world_gravity_does_not_act_inside_a_gravity_zone(engine: str) -> None:
    zone = {"position": [0.0, 0.0], "radius": 50.0, "gravity": [1.0, 0.0]}
    change = SetParameter(time=0.5, path="world.gravity", value=[0.0, -5.0])
    run = run_on(engine, scene_of(zone, ball={"velocity": [0.0, 0.0]}, world={"duration": 1.0}), actions=[change])
    assert run.velocity[-1, 0] == pytest.approx([1.0, 0.0], abs=rounding(engine, 1e-12))  # of 500 sums


HOLE: dict[str, Any] = {"name": "hole", "position": [1.0, 0.0], "radius": 0.08, "holds": True}


def run_until(engine: str, scene: Scene, seconds: float) -> SwitchableSimulation:
    simulation = start_on(engine, scene)
    simulation.contacts()
    while simulation.time < seconds - 1e-9:
        simulation.step()
    return simulation


@every_engine
def test_held_body_stays_at_the_centre_under_gravity_and_impacts(engine: str) -> None:
    """A heavy ball that hits the held ball bounces elastically, as off a wall."""
    heavy = {"name": "heavy", "position": [1.0, 3.0], "velocity": [0.0, -2.0], "radius": 0.1, "mass": 50.0}
    moving = {"name": "ball", "position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 0.05, "restitution": 1.0}
    scene = make_scene(
        world={"duration": 2.0},
        solver={"dt": 5 * H, "substeps": 5},
        ball=[moving, {**heavy, "restitution": 1.0}],
        zone=[{**HOLE, "gravity": [0.0, -20.0]}],
    )
    run = run_on(engine, scene)
    held = run.time > 1.05
    assert (run.position[held, 0] == [1.0, 0.0]).all()
    assert not run.velocity[held, 0].any()
    assert run.velocity[-1, 1, 1] == pytest.approx(2.0, rel=1e-12)  # off an immovable body


@every_engine
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
def test_action_releases_a_held_body_until_it_has_left_the_zone(engine: str, release: Action) -> None:
    simulation = run_until(engine, scene_of(HOLE), 1.5)
    assert simulation.frame().visits is not None
    assert simulation.frame().visits.tolist() == [[HELD]]
    simulation.apply(release)
    simulation.step()
    assert simulation.frame().visits.tolist() in ([[RELEASED]], [[AWAY]])
    frame = advance(simulation, 100).frame()
    assert frame.visits.tolist() == [[AWAY]]
    assert np.hypot(*(frame.position[0] - [1.0, 0.0])) > 0.08


@every_engine
def test_released_body_keeps_its_mass_and_is_held_again_on_return(engine: str) -> None:
    """Thrown up at 2 m/s against g = 10 m/s², it returns after 0.4 s and is held again at once."""
    zone = {**HOLE, "layers": ["ground"]}
    scene = scene_of(zone, world={"duration": 3.0, "gravity": [0.0, 0.0]}, ball={"mass": 0.25})
    simulation = run_until(engine, scene, 1.2)
    simulation.apply(SetParameter(time=0, path="world.gravity", value=[0.0, -10.0]))
    simulation.apply(Impulse(time=0, body="ball", impulse=(0.0, 0.5)))  # 0.25 kg · 2 m/s
    released, top = simulation.time, 0.0
    while simulation.frame().visits.tolist() != [[HELD]]:
        simulation.step()
        top = max(top, float(simulation.frame().position[0, 1]))
    assert top == pytest.approx(0.2, abs=10.0 * H * 0.4)  # v²/2g; explicit Euler has an error of g·h·t/2
    # It enters 0.08 m above the centre: t = (v + √(v² − 2·g·0.08))/g, found at the end of its step.
    expected = (2.0 + math.sqrt(4.0 - 1.6)) / 10.0
    assert simulation.time - released == pytest.approx(expected, abs=5 * H + 2 * H)
    assert simulation.frame().position.tolist() == [[1.0, 0.0]]


@every_engine
def test_overlap_does_not_shift_a_held_body(engine: str) -> None:
    """Half of the spawned ball is inside the wall; pymunk would push it out while it is held."""
    hole = {"position": [1.0, 0.0], "radius": 0.1, "holds": True}
    wall = {"points": [[0.0, -0.05], [2.0, -0.05]], "thickness": 0.02}
    simulation = run_until(engine, scene_of(hole, ball={"position": [-5.0, 0.0]}, wall=[wall]), 0.0)
    if engine != "box2d":
        simulation.account()
    simulation.apply(Spawn(time=0.0, ball=Ball(name="late", position=(1.0, 0.03), radius=0.2)))
    advance(simulation, 3)
    assert simulation.frame().position[1].tolist() == [1.0, 0.0]


@every_engine
@pytest.mark.parametrize("drag", [{"linear_drag": 0.5}, {"quadratic_drag": 0.5, "wind": [2.0, 0.0]}])
def test_drag_does_not_move_a_body_held_in_a_gravity_zone(engine: str, drag: dict[str, Any]) -> None:
    hole = {"position": [0.0, 0.0], "radius": 0.2, "holds": True, "gravity": [3.0, 4.0]}
    simulation = run_until(engine, scene_of(hole, world={"duration": 1.0, **drag}), 0.2)
    assert simulation.frame().position.tolist() == [[0.0, 0.0]]
    assert simulation.frame().velocity.tolist() == [[0.0, 0.0]]


@every_engine
def test_holding_zone_holds_one_body_at_a_time(engine: str) -> None:
    balls = [
        {"name": name, "position": [x, 0.0], "velocity": [1.0, 0.0], "radius": 0.05}
        for name, x in (("first", 0.5), ("second", 0.0))
    ]
    wide = {"position": [1.0, 0.0], "radius": 0.3, "holds": True}
    simulation = run_until(engine, from_document({"world": {"duration": 2.0}, "ball": balls, "zone": [wide]}), 1.9)
    frame = simulation.frame()
    assert frame.position[0].tolist() == [1.0, 0.0]
    assert frame.visits[0].tolist() == [HELD]
    assert frame.visits[1, 0] in (AWAY, INSIDE)


@every_engine
def test_jointed_body_is_recorded_but_not_held(engine: str) -> None:
    rope = {"kind": "rod", "between": ["ball"], "anchors": [[0, 0], [0, 1]]}
    scene = scene_of({"position": [0.3, 0.05], "radius": 0.2, "holds": True}, joint=[rope])
    run = run_on(engine, scene)
    assert len(entries(run, scene)) >= 1
    assert np.hypot(*run.velocity[-1, 0]) > 0.5


@every_engine
def test_removal_of_a_held_body_frees_the_zone(engine: str) -> None:
    simulation = run_until(engine, scene_of(HOLE), 1.5)
    simulation.apply(Remove(time=0, body="ball"))
    ball = Ball(name="next", position=(0.8, 0.0), velocity=(1.0, 0.0), radius=0.05)
    simulation.apply(Spawn(time=0, ball=ball))
    advance(simulation, 40)
    assert simulation.frame().visits.tolist() == [[AWAY], [HELD]]


def test_half_kick_is_refused_with_zones_that_change_motion() -> None:
    with pytest.raises(Refusal, match="half_kick"):
        sandbox.start(scene_of(HOLE, solver={"half_kick": True}))


@with_impulses
def test_lasting_contacts_keep_their_impulses_while_entries_are_recorded(engine: str) -> None:
    """Balls rest while another flies through zones above; resting contacts have the same impulse as without zones."""
    plane = {"point": [0.0, -1.0], "normal": [0.0, 1.0], "layers": ["ground"]}
    balls = [{"position": [0.3 * k, -0.9], "radius": 0.1} for k in range(3)]
    flying = {"name": "flies", "position": [0.0, 0.0], "velocity": [1.0, 0.0], "radius": 0.05, "layer": "air"}
    gates = [{"position": [0.2 + 0.1 * k, 0.0], "radius": 0.04, "layers": ["air"]} for k in range(8)]
    world = {"duration": 1.0, "gravity": [0.0, -2.0]}
    sky = {"position": [0.0, 0.0], "radius": 9.0, "layers": ["air"], "gravity": [0.0, 0.0]}
    plain, recorded = (
        run_on(
            engine,
            from_document({"world": world, "ball": [*balls, flying], "plane": [plane], "zone": [sky, *more]}),
            audit=False,
        )
        for more in ([], gates)
    )
    resting_impulses = [run.contact_impulse[run.contact_pair[:, 1] == -1] for run in (plain, recorded)]
    assert np.array_equal(*resting_impulses)
    # m·g·t of each, 1 kg · 2 m/s² · 1 s, up to the first contact
    assert resting_impulses[0][:, 1] == pytest.approx(-2.0, abs=0.1)
    assert len(recorded.contact_time) - len(plain.contact_time) == 8
