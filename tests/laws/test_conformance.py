"""Conformance of every engine in the registry with its own list of capabilities.

For each demand there is a scene that needs it, and a closed form that fails without it. An engine that lists the demand
must reproduce the closed form; one that does not must refuse the scene, and name the demand. A new engine is complete
when it passes here and in the other files of this folder, which run over the registry as well.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

import sandbox
from sandbox.action import Action, Drive
from sandbox.engines.contract import Refusal
from sandbox.engines.registry import ENGINES, able, start
from sandbox.scene.compile.demands import Demand, demands
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory

Document = dict[str, Any]

DT = 1e-3
ERROR = 0.012
"""m, m/s or rad after at most a second: with steps h of 1 ms and accelerations up to 10 m/s², schemes of order 1 are
wrong by h·a·t/2 = 5e-3; Box2D meets a surface up to four slops before, here 0.01"""


class Proof(NamedTuple):
    """A scene that needs one demand, and the check of its run."""

    document: Document
    check: Callable[[Trajectory], None]
    duration: float = 1.0
    actions: tuple[Action, ...] = ()

    @property
    def scene(self) -> Scene:
        """The scene of the document."""
        world = {**self.document["world"], "duration": self.duration}
        return from_document({**self.document, "world": world})


def scene(**tables: Any) -> Document:
    """Return a document without gravity, unless it is stated."""
    return {"world": {"gravity": [0.0, 0.0], **tables.pop("world", {})}, **tables}


def ball(x: float = 0.0, y: float = 0.0, vx: float = 0.0, vy: float = 0.0, **more: Any) -> Document:
    return {"position": [x, y], "velocity": [vx, vy], "radius": 0.25, "mass": 1.0, **more}


def box(x: float = 0.0, y: float = 0.0, **more: Any) -> Document:
    return {"position": [x, y], "size": [1.0, 0.5], "mass": 1.0, "name": "box", **more}


FLOOR: Document = {"point": [0.0, 0.0], "normal": [0.0, 1.0]}
WALL: Document = {"points": [[1.0, -1.0], [1.0, 1.0]]}
MOMENT = (1.0**2 + 0.5**2) / 12
"""kg·m², of `box`"""
GRAVITY: Document = {"gravity": [0.0, -10.0]}


def visit(begin: float, end: float) -> Callable[[Trajectory], None]:
    """Return a check of the only visit of a sensor, s."""

    def check(run: Trajectory) -> None:
        ((_, _, *times),) = run.sensor_visits
        assert times == pytest.approx([begin, end], abs=DT + 1e-6)  # found at the end of a step; 32 bits of box2d

    return check


def position(x: float, y: float, body: int = 0, error: float = ERROR) -> Callable[[Trajectory], None]:
    """Return a check of the last position of a body, m."""

    def check(run: Trajectory) -> None:
        assert run.position[-1, body].tolist() == pytest.approx([x, y], abs=error)

    return check


def velocity(x: float, y: float, body: int = 0, error: float = ERROR) -> Callable[[Trajectory], None]:
    """Return a check of the last velocity of a body, m/s."""

    def check(run: Trajectory) -> None:
        assert run.velocity[-1, body].tolist() == pytest.approx([x, y], abs=error)

    return check


def angle(value: float, error: float = ERROR, body: int = 0) -> Callable[[Trajectory], None]:
    """Return a check of the last angle of a body, rad."""

    def check(run: Trajectory) -> None:
        assert run.angle[-1, body] == pytest.approx(value, abs=error)

    return check


def spin(value: float, error: float = ERROR, body: int = 0) -> Callable[[Trajectory], None]:
    """Return a check of the last angular velocity of a body, rad/s."""

    def check(run: Trajectory) -> None:
        assert run.angular_velocity[-1, body] == pytest.approx(value, abs=error)

    return check


def retired_at(time: float, body: int = 0) -> Callable[[Trajectory], None]:
    """Return a check of the time at which a body leaves, s."""

    def check(run: Trajectory) -> None:
        assert run.retired_time[body] == pytest.approx(time, abs=2.0 * DT)

    return check


def both(*checks: Callable[[Trajectory], None]) -> Callable[[Trajectory], None]:
    """Return a check that makes each of the checks."""

    def check(run: Trajectory) -> None:
        for each in checks:
            each(run)

    return check


def is_pocketed(run: Trajectory) -> None:
    """One capture, and the ball lies in the pocket."""
    assert (run.contact_pair < 0).any(axis=1).sum() == 1
    assert np.hypot(*(run.position[-1, 0] - np.asarray([0.8, 0.0]))) < 0.3


def curls(run: Trajectory) -> None:
    """A sliding puck that turns counter-clockwise deviates to the left by κ/(4 + κ²) of v²/(μ g)."""
    total = 1.0 / (0.1 * 9.81) / (2.0 - 0.5j)
    assert complex(*run.position[-1, 0]) == pytest.approx(total, abs=ERROR)


def _pendulum() -> Document:
    return {"kind": "rod", "between": ["a"], "anchors": [[0.0, 0.0], [0.0, 0.0]]}


def _floor(**more: Any) -> Document:
    return {"sliding_friction": 0.2, **more}


AXLE: Document = {"kind": "pivot", "between": ["box"], "at": [0.0, 0.0]}

PROOFS: dict[Demand, Proof] = {
    Demand.TRANSLATION: Proof(scene(ball=[ball(vx=2.0, vy=-1.0)]), position(2.0, -1.0)),
    Demand.ROTATION: Proof(scene(ball=[ball(angular_velocity=2.0)]), angle(2.0)),
    Demand.GRAVITY: Proof(scene(world=GRAVITY, ball=[ball(vx=1.0)]), position(1.0, -5.0)),
    Demand.DRAG: Proof(scene(world={"linear_drag": 2.0}, ball=[ball(vx=1.0)]), velocity(math.exp(-2.0), 0.0)),
    # in a second, lift turns the velocity by s·ω = π/2
    Demand.GRAVITY_SCALE: Proof(scene(world=GRAVITY, ball=[ball(gravity_scale=-0.5)]), velocity(0.0, 5.0)),
    Demand.BODY_DAMPING: Proof(
        scene(ball=[ball(vx=1.0, linear_damping=2.0, angular_damping=1.0, angular_velocity=3.0)]),
        both(velocity(math.exp(-2.0), 0.0), spin(3.0 * math.exp(-1.0))),
    ),
    Demand.SPEED_LIMITS: Proof(
        scene(world=GRAVITY, ball=[ball(max_speed=2.0, max_angular_velocity=1.0, angular_velocity=3.0)]),
        both(velocity(0.0, -2.0), spin(1.0), position(0.0, -1.8)),
    ),
    Demand.ROLLING: Proof(
        scene(
            world=GRAVITY,
            ball=[ball(y=0.25, vx=1.0, angular_velocity=-4.0, rolling_resistance=0.05, friction=1.0)],
            plane=[FLOOR],
        ),
        both(velocity(1.0 - 0.5 / 1.5, 0.0), spin(-4.0 * (1.0 - 0.5 / 1.5), error=4.0 * ERROR)),
    ),
    Demand.LIFT: Proof(scene(ball=[ball(vx=1.0, angular_velocity=5.0, lift=0.1 * math.pi)]), velocity(0.0, 1.0)),
    # velocity and spin keep a quarter of their values
    Demand.DAMPING: Proof(
        scene(world={"damping": 0.25}, ball=[ball(vx=1.0, angular_velocity=1.0)]), both(velocity(0.25, 0.0), spin(0.25))
    ),
    # the first ball stops the second half of their momentum: e = 0
    Demand.BALL_BALL: Proof(scene(ball=[ball(vx=1.0), ball(1.0)]), velocity(0.5, 0.0)),
    Demand.BALL_PLANE: Proof(scene(world=GRAVITY, ball=[ball(0.0, 0.3)], plane=[FLOOR]), position(0.0, 0.25)),
    Demand.BALL_SEGMENT: Proof(scene(ball=[ball(vx=2.0)], wall=[WALL]), position(0.75, 0.0)),
    Demand.BALL_POST: Proof(
        scene(ball=[ball(vx=2.0)], post=[{"position": [1.0, 0.0], "radius": 0.25}]), position(0.5, 0.0)
    ),
    # it rests on two corners
    Demand.POLYGONS: Proof(scene(world=GRAVITY, box=[box(0.0, 0.3)], plane=[FLOOR]), position(0.0, 0.25)),
    Demand.RESTITUTION: Proof(scene(ball=[ball(vx=2.0)], wall=[{**WALL, "restitution": 0.5}]), velocity(-1.0, 0.0)),
    # a disc that slides rolls at 2/3 of its speed
    Demand.FRICTION: Proof(
        scene(world=GRAVITY, ball=[ball(0.0, 0.25, vx=1.5)], plane=[{**FLOOR, "friction": 0.4}]), velocity(1.0, 0.0)
    ),
    # e(v) = 0.9/(1 + 0.4·2) = 0.5
    Demand.FALLOFF: Proof(
        scene(ball=[ball(vx=2.0)], wall=[{**WALL, "restitution": 0.9, "restitution_falloff": 0.4}]), velocity(-1.0, 0.0)
    ),
    Demand.KICKS: Proof(scene(ball=[ball(vx=2.0)], wall=[{**WALL, "kick": {"speed": 3.0}}]), velocity(-3.0, 0.0)),
    # a belt drives a disc at rest to s/3
    Demand.SURFACE_SPEED: Proof(
        scene(world=GRAVITY, ball=[ball(0.0, 0.25)], plane=[{**FLOOR, "friction": 0.4, "surface_speed": 1.5}]),
        velocity(0.5, 0.0),
    ),
    # likewise, to the left
    Demand.SURFACE_VELOCITY: Proof(
        scene(
            world=GRAVITY, ball=[ball(0.0, 0.25)], plane=[{**FLOOR, "friction": 0.4, "surface_velocity": [-1.5, 1.0]}]
        ),
        velocity(-0.5, 0.0),
    ),
    # the wall, upwards, lets bodies pass from right to left
    Demand.ONE_WAY: Proof(
        scene(ball=[ball(2.0, vx=-2.0), ball(0.0, 0.7, vx=2.0)], wall=[{**WALL, "one_way": True}]),
        both(position(0.0, 0.0), position(0.75, 0.7, body=1)),
    ),
    Demand.PASSABLE: Proof(scene(ball=[ball(vx=2.0)], wall=[{**WALL, "solid": False}]), position(2.0, 0.0)),
    # a turn of 1 rad on a circle of 1 m
    Demand.RODS: Proof(
        scene(ball=[ball(1.0, vy=1.0, name="a")], joint=[_pendulum()]), position(math.cos(1.0), math.sin(1.0))
    ),
    Demand.PIVOTS: Proof(
        scene(box=[box(0.5, angular_velocity=1.0, velocity=[0.0, 0.5])], joint=[AXLE]),
        position(0.5 * math.cos(1.0), 0.5 * math.sin(1.0)),
    ),
    Demand.SLIDES: Proof(
        scene(ball=[ball(1.0, vx=2.0, name="a")], joint=[{**_pendulum(), "kind": "slide", "most": 2.0}]),
        position(2.0, 0.0),
    ),
    Demand.GROOVES: Proof(
        scene(
            ball=[ball(vx=1.0, vy=1.0, name="a")],
            joint=[{"kind": "groove", "between": ["a"], "groove": [[-2.0, 0.0], [2.0, 0.0]]}],
        ),
        position(1.0, 0.0),
    ),
    Demand.ROTARY_LIMITS: Proof(
        scene(
            box=[box(angular_velocity=2.0)],
            joint=[AXLE, {"kind": "rotary_limit", "between": ["box"], "least": -0.5, "most": 0.5}],
        ),
        angle(0.5),
    ),
    Demand.MOTORS: Proof(
        scene(box=[box()], joint=[AXLE, {"kind": "motor", "between": ["box"], "rate": 2.0}]), angle(2.0)
    ),
    Demand.GEARS: Proof(
        scene(
            box=[box(angular_velocity=3.0), box(3.0, name="other")],
            joint=[
                AXLE,
                {"kind": "pivot", "between": ["other"], "at": [3.0, 0.0]},
                # angle_other·2 − angle_box = 0: momentum is exchanged in the first step: ω = 3·4/5 and half of that
                {"kind": "gear", "between": ["box", "other"], "ratio": 2.0},
            ],
        ),
        both(angle(2.4), angle(1.2, body=1)),
    ),
    # x = cos ω t with ω² = k/m
    Demand.SPRINGS: Proof(
        scene(
            ball=[ball(1.0, name="a")], joint=[{**_pendulum(), "kind": "spring", "rest_length": 0.0, "stiffness": 4.0}]
        ),
        position(math.cos(2.0), 0.0),
    ),
    # an impulse of 2 N·s on 1 kg, after a quarter of a second
    Demand.EVENTS: Proof(
        scene(ball=[ball(name="a")], event=[{"kind": "impulse", "time": 0.25, "body": "a", "impulse": [2.0, 0.0]}]),
        position(1.5, 0.0),
    ),
    # slack until x = 1 at 0.25 s, taut for half a period, π/ω = 0.25 s with ω² = k/m, then slack on the way back
    Demand.BANDS: Proof(
        scene(
            ball=[ball(0.5, vx=2.0, name="a")],
            joint=[
                {
                    **_pendulum(),
                    "kind": "spring",
                    "rest_length": 1.0,
                    "stiffness": (4.0 * math.pi) ** 2,
                    "pulls_only": True,
                }
            ],
        ),
        both(position(0.0, 0.0), velocity(-2.0, 0.0)),
    ),
    Demand.ROTARY_SPRINGS: Proof(
        scene(
            box=[box(angular_velocity=1.0)],
            joint=[{"kind": "rotary_spring", "between": ["box"], "stiffness": 4.0 * MOMENT}],
        ),
        angle(0.5 * math.sin(2.0)),
    ),
    Demand.PULLEYS: Proof(
        scene(
            world=GRAVITY,
            ball=[ball(0.0, -1.0, mass=3.0, name="a"), ball(2.0, -5.0, name="b")],
            joint=[{"kind": "pulley", "between": ["a", "b"], "wheels": [[0.0, 0.0], [2.0, 0.0]]}],
        ),
        position(0.0, -3.5),
    ),
    # it turns back to its click, and not beyond
    Demand.RATCHETS: Proof(
        scene(
            box=[box(angle=0.3, angular_velocity=-2.0)],
            joint=[AXLE, {"kind": "ratchet", "between": ["box"], "ratchet": 0.4}],
        ),
        angle(0.0),
    ),
    # a kick at one of two equal boxes turns both about their common centre: I = 2 (MOMENT + 0.5² kg·m²)
    Demand.WELDS: Proof(
        scene(
            box=[box(-0.5, velocity=[0.0, -0.5]), box(0.5, name="other", velocity=[0.0, 0.5])],
            joint=[{"kind": "weld", "between": ["box", "other"]}],
        ),
        angle(2.0 * 0.5 * 0.5 / (2.0 * (MOMENT + 0.25))),
    ),
    # across the axis nothing moves, and nothing turns
    Demand.PRISMATICS: Proof(
        scene(
            box=[box(velocity=[1.0, 1.0], angular_velocity=1.0)],
            joint=[{"kind": "prismatic", "between": ["box"], "axis": [1.0, 0.0], "travel": [-2.0, 2.0]}],
        ),
        both(position(1.0, 0.0), angle(0.0)),
    ),
    # y = sin ω t / ω with ω² = k/m, while the wheel turns and x stays
    Demand.WHEELS: Proof(
        scene(
            ball=[ball(vx=1.0, vy=1.0, angular_velocity=1.0, name="a")],
            joint=[{"kind": "wheel", "between": ["a"], "axis": [0.0, 1.0], "travel": [-1.0, 1.0], "stiffness": 4.0}],
        ),
        both(position(0.0, 0.5 * math.sin(2.0)), angle(1.0)),
    ),
    # a weight of 10 N hangs from a rod of at most 4 N
    Demand.MAX_FORCE: Proof(
        scene(
            world=GRAVITY, ball=[ball(0.0, -1.0, name="a")], joint=[{**_pendulum(), "max_force": 4.0, "length": 1.0}]
        ),
        velocity(0.0, -6.0),
    ),
    # an error of 1 m is corrected at 0.5 m/s
    Demand.MAX_BIAS: Proof(
        scene(
            ball=[ball(1.0, name="a")],
            joint=[{"kind": "pivot", "between": ["a"], "anchors": [[0.0, 0.0], [0.0, 0.0]], "max_bias": 0.5}],
        ),
        position(0.5, 0.0),
    ),
    # the fraction of an error that remains after one second
    Demand.JOINT_BIAS: Proof(
        scene(
            ball=[ball(1.0, name="a")],
            joint=[{"kind": "pivot", "between": ["a"], "anchors": [[0.0, 0.0], [0.0, 0.0]], "bias": 0.25}],
        ),
        position(0.25, 0.0),
    ),
    # a circle with v² = k/r
    Demand.ATTRACTION: Proof(
        scene(ball=[ball(1.0, vy=1.0)], attraction=[{"toward": [0.0, 0.0], "strength": 1.0}]),
        position(math.cos(1.0), math.sin(1.0)),
    ),
    Demand.THRUST: Proof(
        scene(ball=[ball(name="a")], thrust=[{"body": "a", "force": [4.0, -2.0]}]), position(2.0, -1.0)
    ),
    # friction of 1 N across, none along
    Demand.TYRES: Proof(
        scene(ball=[ball(vx=2.0, vy=2.0, name="a")], tyre=[{"body": "a", "grip": 1.0}]), velocity(2.0, 1.0)
    ),
    Demand.DRIVES: Proof(
        scene(
            box=[box()],
            drive=[{"kind": "stroke", "body": "box", "pivot": [0.0, 0.0], "stops": [0.0, 0.3], "rate": 1.0}],
        ),
        angle(0.3),
        actions=(Drive(time=0.0, drive="drive-1", level=1.0),),
    ),
    Demand.BOUNDS: Proof(scene(world={"bounds": [[-1.0, -1.0], [1.0, 1.0]]}, ball=[ball(vx=2.0)]), retired_at(0.5)),
    Demand.LIFETIMES: Proof(
        scene(
            emitter=[{"position": [0, 0], "count": 1, "velocity_min": [1, 0], "velocity_max": [1, 0], "lifetime": 0.4}]
        ),
        retired_at(0.4),
    ),
    # a sphere that slides rolls at 5/7 of its speed
    Demand.SURFACE: Proof(scene(surface=_floor(), ball=[ball(vx=1.4)]), velocity(1.0, 0.0)),
    Demand.SPIN: Proof(scene(surface=_floor(), ball=[ball(vx=-1.4)]), velocity(-1.0, 0.0)),
    Demand.POCKETS: Proof(
        scene(surface=_floor(), ball=[ball(vx=1.4)], pocket=[{"position": [0.8, 0.0], "radius": 0.3}]), is_pocketed
    ),
    # s = v²/(2 μ g)
    Demand.PUCKS: Proof(
        scene(surface=_floor(bodies="pucks"), ball=[ball(vx=1.4)]), position(1.4**2 / (2.0 * 0.2 * 9.81), 0.0)
    ),
    Demand.CURL: Proof(
        scene(
            surface={"sliding_friction": 0.1, "bodies": "pucks", "curl": 0.5}, ball=[ball(vx=1.0, angular_velocity=1.0)]
        ),
        curls,
        1.5,
    ),
    # a body in another layer passes the wall
    Demand.LAYERS: Proof(
        scene(ball=[ball(vx=2.0), ball(0.0, 0.7, vx=2.0, layer="ramp")], wall=[{**WALL, "layers": ["ramp"]}]),
        both(position(2.0, 0.0), position(0.75, 0.7, body=1)),
    ),
    # the first wall is not in the ball's mask, the second one is
    Demand.CATEGORIES: Proof(
        scene(
            ball=[ball(vx=2.0, mask=["wall"], restitution=1.0)],
            wall=[{**WALL, "categories": ["curtain"]}, {"points": [[1.5, -9.0], [1.5, 9.0]], "restitution": 1.0}],
        ),
        position(0.5, 0.0),
    ),
    # the second ball stands in the way of the first, which passes it
    Demand.GROUPS: Proof(
        scene(ball=[ball(vx=2.0, group="a"), ball(1.0, group="a", name="passed"), ball(1.0, 5.0, name="apart")]),
        both(position(2.0, 0.0), position(1.0, 0.0, body=1)),
    ),
    # a paddle at −1 m/s hits the ball, which had 1 m/s, at 0.325 s: without loss it then has −3 m/s
    Demand.KINEMATIC: Proof(
        scene(
            ball=[ball(vx=1.0, restitution=1.0)], box=[box(1.4, velocity=[-1.0, 0.0], restitution=1.0, kinematic=True)]
        ),
        both(position(0.325 - 3.0 * 0.675, 0.0), position(0.4, 0.0, body=1)),
    ),
    # the same with a paddle on a path, which moves from 0.2 to 0.8 s: it hits the ball at 0.425 s
    Demand.PATHS: Proof(
        scene(
            ball=[ball(vx=1.0, restitution=1.0)],
            box=[
                box(
                    1.4,
                    restitution=1.0,
                    kinematic=True,
                    path={"points": [[0.0, 0.0], [-0.6, 0.0]], "speed": 1.0, "repeat": "once", "start": 0.2},
                )
            ],
        ),
        both(position(0.425 - 3.0 * 0.575, 0.0), position(0.8, 0.0, body=1)),
    ),
    # a box that is solid from the right: the ball passes through it
    Demand.ONE_WAY_BODIES: Proof(
        scene(ball=[ball(vx=2.0, restitution=1.0)], box=[box(1.0, restitution=1.0, fixed=True, one_way=[1.0, 0.0])]),
        position(2.0, 0.0),
    ),
    # gravity within 0.5 m around x = 1: 0.5 s at −4 m/s²
    Demand.ZONES: Proof(
        scene(
            ball=[ball(vx=2.0)],
            zone=[{"points": [[0.5, -9.0], [1.5, -9.0], [1.5, 9.0], [0.5, 9.0]], "gravity": [0.0, -4.0]}],
        ),
        velocity(2.0, -2.0),
    ),
    # a disc that displaces half its mass falls at half of gravity
    Demand.BUOYANCY: Proof(
        scene(
            world=GRAVITY,
            ball=[ball()],
            zone=[{"points": [[-9, -9], [9, -9], [9, 9], [-9, 9]], "liquid": {"density": 0.5 / (math.pi * 0.25**2)}}],
        ),
        velocity(0.0, -5.0),
    ),
    # its right side reaches the sensor at x = 0.75, and its left side leaves it at x = 1.75
    Demand.SENSORS: Proof(
        scene(ball=[ball(vx=2.0)], sensor=[{"points": [[1.0, -1.0], [1.5, -1.0], [1.5, 1.0], [1.0, 1.0]]}]),
        both(visit(0.375, 0.875), position(2.0, 0.0)),
    ),
}


def test_there_is_a_proof_of_every_demand() -> None:
    assert set(PROOFS) == set(Demand)


@pytest.mark.parametrize("demand", Demand)
def test_proof_needs_its_demand(demand: Demand) -> None:
    assert demand in demands(PROOFS[demand].scene)


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("demand", Demand)
@pytest.mark.parametrize("engine", ENGINES)
def test_engine_models_what_it_lists_and_refuses_the_rest_by_name(engine: str, demand: Demand) -> None:
    proof = PROOFS[demand]
    missing = demands(proof.scene) - ENGINES[engine].capabilities
    run = sandbox.run(proof.scene, engine, dt=DT, audit=False, actions=proof.actions)
    if not missing:
        assert run.status == "ok", run.reason
        proof.check(run)
        return
    assert run.status == "refused"
    for each in missing:
        assert str(each) in run.reason
    with pytest.raises(Refusal) as caught:
        start(proof.scene, engine)
    assert set(caught.value.able) == set(able(proof.scene)) - {engine}


@pytest.mark.parametrize("demand", Demand)
def test_some_engine_models_each_demand(demand: Demand) -> None:
    assert any(demand in engine.capabilities for engine in ENGINES.values())
