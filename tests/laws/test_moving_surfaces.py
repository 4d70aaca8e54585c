"""Moving surfaces (conveyor belts, drums): closed forms and energy on every engine, and what is refused."""

from typing import Any

import numpy as np
import pytest

import sandbox
from sandbox.action import SetParameter
from sandbox.engines.registry import ENGINES, able
from sandbox.measure.analytic import solution
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance
from tests.laws.engine_configs import IMPULSE_CONFIGS, EngineConfig, each_config

pytestmark = pytest.mark.fail_slow(60)  # many runs of seconds

G, MU, SPEED = 10.0, 0.5, 2.0

BELT: dict[str, dict[str, Any]] = {
    "plane": {"plane": [{"point": [0, 0], "normal": [0, 1], "surface_speed": SPEED, "friction": MU}]},
    "wall": {"wall": [{"points": [[-20, -0.1], [20, -0.1]], "thickness": 0.2, "surface_speed": SPEED, "friction": MU}]},
}
STEP = 1.5 * G * 1e-3
"""m/s, speed that gravity adds in 1.5 steps: by so much the end of slipping is late, and an impact harder"""


def belt_scene(belt: str, gravity: float = -G, **bodies: Any) -> Scene:
    world = {"gravity": [0.0, gravity], "duration": 1.5}
    return from_document({"world": world, "solver": {"dt": 0.001}, **BELT[belt], **bodies})


def ball(x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"position": [x, y], "radius": 0.5, "mass": 1.0, **more}


def run(config: EngineConfig, scene: Scene) -> Any:
    return config.run(scene, dt=0.001)


@each_config(IMPULSE_CONFIGS)
@pytest.mark.parametrize("belt", BELT)
def test_ball_on_a_belt_slides_then_rolls(config: EngineConfig, belt: str) -> None:
    """A disc slides with a = μ g until v + ω r = s, after s/(3 μ g): then v = s/3 and ω = 2 s/(3 r)."""
    result = run(config, belt_scene(belt, ball=[ball(0.0, 0.5)]))
    t, end = result.time, SPEED / (3.0 * MU * G)
    assert result.velocity[:, 0, 0] == pytest.approx(np.minimum(MU * G * t, SPEED / 3.0), abs=STEP)
    assert result.velocity[t > end + 0.01, 0, 0] == pytest.approx(SPEED / 3.0, abs=config.rounding(1e-12) + 1e-4)
    assert result.angular_velocity[-1, 0] == pytest.approx(2.0 * SPEED / 3.0 / 0.5, abs=config.rounding(1e-12) + 1e-3)


@each_config([config for config in IMPULSE_CONFIGS if config.engine != "exact"])
def test_box_on_a_belt_reaches_its_speed(config: EngineConfig) -> None:
    if config.settings.get("detection") == "swept":
        config = EngineConfig(config.engine, {**config.settings, "detection": "bisect"})  # that supports polygons
    box = {"position": [0.0, 0.25], "size": [1.0, 0.5], "mass": 2.0}
    result = run(config, belt_scene("plane", box=[box]))
    expected = np.minimum(MU * G * result.time, SPEED)
    assert result.velocity[:, 0, 0] == pytest.approx(expected, abs=2.0 * STEP)  # of its two contact points
    assert result.velocity[-1, 0, 0] == pytest.approx(SPEED, abs=1e-4)


@pytest.mark.parametrize("slope", [0.0, 0.2])
@pytest.mark.parametrize("shape", ["ball", "box"])
def test_closed_form_on_a_belt_agrees_with_the_engines(slope: float, shape: str) -> None:
    """On a belt that runs up a slope: bodies slide down at first, then are carried up, or roll."""
    belt = {"point": [0, 0], "normal": [-slope, 1.0], "surface_speed": SPEED, "friction": MU}
    n = np.asarray([-slope, 1.0]) / np.hypot(slope, 1.0)
    body: dict[str, Any] = {"position": (0.5 * n).tolist(), "velocity": (-0.5 * np.asarray([n[1], -n[0]])).tolist()}
    body |= {"radius": 0.5} if shape == "ball" else {"size": [2.0, 1.0], "angle": float(np.arctan(slope))}
    document = {"world": {"gravity": [0.0, -G], "duration": 1.5}, "plane": [belt], shape: [body]}
    scene = from_document(document)
    exact = solution(scene)
    assert exact is not None and exact.about == "motion on a belt"
    for engine in [name for name in able(scene) if name != "box2d"]:
        result = sandbox.run(scene, engine, dt=0.001)
        # a·t·h/2 with up to 7 m/s²; `exact` to rounding
        error = 1e-12 if engine == "exact" else 7e-3
        assert result.position == pytest.approx(exact.at(result.time).position, abs=error)
        assert result.velocity[-1] == pytest.approx(exact.at(result.time[-1:]).velocity[0], abs=error)


@each_config(IMPULSE_CONFIGS)
def test_lower_side_of_a_belt_runs_the_other_way(config: EngineConfig) -> None:
    result = run(config, belt_scene("wall", gravity=G, ball=[ball(0.0, -0.7)]))
    assert result.velocity[-1, 0, 0] == pytest.approx(-SPEED / 3.0, abs=1e-4)


@each_config(IMPULSE_CONFIGS)
def test_drum_turns_a_ball_that_hits_it(config: EngineConfig) -> None:
    """An impact at speed v with e = 0 has the normal impulse m v; friction ends the slip s with s m/3 < μ m v."""
    drum = {"position": [0.0, 0.0], "radius": 1.0, "surface_speed": 0.3, "friction": MU}
    falling = ball(0.0, 2.0, velocity=[0.0, -1.0])
    document = {"world": {"gravity": [0.0, 0.0], "duration": 0.6}, "post": [drum], "ball": [falling]}
    result = run(config, from_document(document))
    assert result.velocity[-1, 0] == pytest.approx([0.1, 0.0], abs=config.impact_rounding(1e-12))
    assert result.angular_velocity[-1, 0] == pytest.approx(0.4, abs=config.impact_rounding(1e-12))


@each_config(IMPULSE_CONFIGS)
def test_speeds_of_two_surfaces_add(config: EngineConfig) -> None:
    """Both surfaces run clockwise, so that they move against each other where two balls touch."""
    speeds = {"surface_speed": 0.3, "friction": MU}
    balls = [ball(0.0, 0.0, velocity=[1.0, 0.0], **speeds), ball(1.5, 0.0, **speeds)]
    # friction of both sides multiplies: 0.25 of the normal impulse, 0.5 N·s without restitution, exceeds 0.6 m/6
    result = run(config, from_document({"world": {"gravity": [0.0, 0.0], "duration": 1.0}, "ball": balls}))
    assert result.velocity[-1] == pytest.approx(np.asarray([[0.5, 0.1], [0.5, -0.1]]), abs=config.impact_rounding(1e-9))
    assert result.angular_velocity[-1] == pytest.approx([0.4, 0.4], abs=4 * config.impact_rounding(1e-9))


VECTOR = {"plane": [{"point": [0, 0], "normal": [0, 1], "surface_velocity": [SPEED, 0.0], "friction": MU}]}
WORKING = [
    (engine, tables)
    for tables in (*BELT.values(), VECTOR)
    for engine in able(from_document({**tables, "ball": [ball(0.0, 0.5)]}))
    if ENGINES[engine].knows_impulses
]


@pytest.mark.parametrize(("engine", "tables"), WORKING)
def test_work_of_a_moving_surface_is_half_lost_to_friction(engine: str, tables: dict[str, Any]) -> None:
    """Until a disc rolls, the belt does the work J s with J = m s/3; half of it becomes kinetic energy, m s²/6."""
    world = {"gravity": [0.0, -G], "duration": 1.5}
    scene = from_document({"world": world, "solver": {"dt": 0.001}, **tables, "ball": [ball(0.0, 0.5)]})
    result = sandbox.run(scene, engine, account=True)
    account = dict(zip(result.info["causes"], result.account[-1].tolist(), strict=True))
    assert account["drives"] == pytest.approx(SPEED**2 / 3.0, rel=1e-9)
    assert account["friction"] == pytest.approx(-(SPEED**2) / 6.0, rel=2e-2)  # the impulse of one step is divided
    assert sum(account.values()) == pytest.approx(result.energy[-1] - result.energy[0], rel=1e-9)


@each_config(IMPULSE_CONFIGS)
def test_speed_can_be_changed_during_a_run(config: EngineConfig) -> None:
    simulation = config.start(belt_scene("plane", ball=[ball(0.0, 0.5, name="b")]))
    advance(simulation, 500)
    simulation.apply(SetParameter(time=0.0, path="plane[0].surface_speed", value=-1.0))
    frame = advance(simulation, 1500).frame()
    # rolling: v + ω r = −1; friction keeps L = I ω − m v r, so that v changes by a third of the change of the belt
    assert frame.velocity[0, 0] == pytest.approx(-1.0 / 3.0, abs=1e-3)
    simulation.close()


VELOCITY_ENGINES = [c for c in IMPULSE_CONFIGS if c.engine in ("pymunk", "reference")]


@each_config(VELOCITY_ENGINES)
@pytest.mark.parametrize("shape", ["ball", "box"])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_surface_velocity_is_a_vector_on_all_sides(config: EngineConfig, shape: str, side: float) -> None:
    """Above and below a slab, and however it is turned, bodies are driven along the vector: `surface_speed` turns."""
    slab = {"position": [0.0, 0.0], "size": [30.0, 1.0], "fixed": True, "angle": np.pi, "friction": MU}
    slab |= {"surface_velocity": [SPEED, 7.0]}  # the component along the normal has no effect
    body = {"position": [0.0, side], "radius": 0.5} if shape == "ball" else {"position": [0, side], "size": [1.0, 1.0]}
    bodies = {"ball": [body]} if shape == "ball" else {}
    scene = from_document(
        {
            "world": {"gravity": [0.0, -side * G], "duration": 1.5},
            "box": [slab, *([body] if shape == "box" else [])],
            **bodies,
        }
    )
    if config.settings.get("detection") == "swept":
        config = EngineConfig(config.engine, {**config.settings, "detection": "bisect"})  # that supports polygons
    result, moving = run(config, scene), int(np.flatnonzero(~scene.bodies.fixed)[0])
    final = SPEED / 3.0 if shape == "ball" else SPEED
    velocity = result.velocity[:, moving, 0]
    assert velocity == pytest.approx(np.minimum(MU * G * result.time, final), abs=2.0 * STEP)
    assert velocity[-1] == pytest.approx(final, abs=1e-4)


@pytest.mark.parametrize("slope", [0.0, 0.2])
@pytest.mark.parametrize("kind", ["plane", "ball"])
def test_closed_form_with_a_surface_velocity(slope: float, kind: str) -> None:
    """A velocity of the plane along itself is the same as a speed; that of a body has the opposite effect."""
    n = np.asarray([-slope, 1.0]) / np.hypot(slope, 1.0)
    along = np.asarray([n[1], -n[0]])
    belt = {"point": [0, 0], "normal": [-slope, 1.0], "friction": MU}
    body: dict[str, Any] = {"position": (0.5 * n).tolist(), "velocity": (-0.5 * along).tolist(), "radius": 0.5}
    start = {"world": {"gravity": [0.0, -G], "duration": 1.5}, "solver": {"dt": 0.001}}
    by_speed = from_document({**start, "plane": [{**belt, "surface_speed": SPEED}], "ball": [body]})
    sign = 1.0 if kind == "plane" else -1.0
    moved = {"plane": belt, "ball": body}
    moved[kind] = {**moved[kind], "surface_velocity": (sign * SPEED * along).tolist()}
    by_velocity = from_document({**start, **{key: [value] for key, value in moved.items()}})
    exact, expected = solution(by_velocity), solution(by_speed)
    assert exact is not None and expected is not None
    times = np.linspace(0.0, 1.5, 31)
    assert exact.at(times).position == pytest.approx(expected.at(times).position, abs=1e-12)
    for engine in ("pymunk", "reference"):
        result = sandbox.run(by_velocity, engine)
        assert result.position == pytest.approx(expected.at(result.time).position, abs=7e-3)  # a·t·h/2


@each_config(VELOCITY_ENGINES)
def test_surface_velocities_of_two_bodies_subtract(config: EngineConfig) -> None:
    """Discs whose surfaces move at the same velocity do not rub; at different ones, friction ends the difference."""
    for velocities, change in (([[0.0, 0.3], [0.0, 0.3]], 0.0), ([[0.0, 0.3], [0.0, -0.3]], 0.1)):
        balls = [ball(0.0, 0.0, velocity=[1.0, 0.0]), ball(1.5, 0.0)]
        balls = [{**b, "friction": MU, "surface_velocity": v} for b, v in zip(balls, velocities, strict=True)]
        result = run(config, from_document({"world": {"gravity": [0.0, 0.0], "duration": 1.0}, "ball": balls}))
        expected = np.asarray([[0.5, -change], [0.5, change]])
        assert result.velocity[-1] == pytest.approx(expected, abs=config.impact_rounding(1e-9))


@each_config(VELOCITY_ENGINES)
def test_surface_velocity_can_be_changed_during_a_run(config: EngineConfig) -> None:
    simulation = config.start(belt_scene("plane", ball=[ball(0.0, 0.5, name="b")]))
    for path, value in (("plane[0].surface_speed", 0.0), ("plane[0].surface_velocity", [-1.0, 0.0])):
        simulation.apply(SetParameter(time=0.0, path=path, value=value))
    advance(simulation, 1500)
    assert simulation.frame().velocity[0, 0] == pytest.approx(-1.0 / 3.0, abs=1e-3)
    simulation.close()


def test_exact_fails_in_a_corner_with_a_moving_surface() -> None:
    lines = [{"points": [[-2, 2], [0, 0]]}, {"points": [[0, 0], [2, 2]], "surface_speed": 1.0, "friction": 0.5}]
    document = {"world": {"gravity": [0.0, -G], "duration": 5.0}, "wall": lines, "ball": [ball(0.1, 2.0)]}
    result = sandbox.run(from_document(document), "exact")
    assert result.status == "failed"
    assert "moving surface" in result.reason


@pytest.mark.parametrize(
    ("engine", "settings"), [("reference", {"response": "penalty"}), ("reference", {"impact": "dissipative"})]
)
def test_methods_that_do_not_model_moving_surfaces_refuse(engine: str, settings: dict[str, Any]) -> None:
    result = sandbox.run(belt_scene("plane", ball=[ball(0.0, 0.5)]), engine, **settings)
    assert result.status == "refused"
    assert "surface speed" in result.reason


@pytest.mark.parametrize("engine", [name for name in ENGINES if name != "box2d"])
def test_surface_speeds_are_refused_on_a_floor(engine: str) -> None:
    document = {
        "world": {"gravity": [0.0, 0.0]},
        "surface": {"sliding_friction": 0.2},
        "wall": [{"points": [[-1, 3], [1, 3]], "surface_speed": 1.0, "friction": 0.2}],
        "ball": [ball(0.0, 0.0)],
    }
    assert "surface speed" in sandbox.run(from_document(document), engine).reason
