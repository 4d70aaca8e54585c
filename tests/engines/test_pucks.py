"""Pucks: flat discs on a surface, on every engine that models them."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.action import Action, ActionError, Impulse, SetParameter, Spawn, Strike
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.contract import Refusal, Simulation
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.registry import start
from sandbox.engines.tabletop.motion import curled
from sandbox.scene.compile.demands import Demand, demands, on_floor
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps, from_document, loads
from sandbox.trajectory import Frame
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

G, MU, MUS, R, MASS = 9.81, 0.05, 0.004, 0.145, 19.96
ENGINES = ["pymunk", "exact"]
every_engine = pytest.mark.parametrize("engine", ENGINES)


def puck(name: str, x: float, y: float, vx: float = 0.0, vy: float = 0.0, spin: float = 0.0, **more: Any) -> Any:
    state = {"position": [x, y], "velocity": [vx, vy], "angular_velocity": spin}
    return {"name": name, **state, "radius": R, "mass": MASS, "restitution": 0.9, "friction": 0.5, **more}


def ice(*pucks: Any, curl: float = 0.0, dt: float = 0.005, **more: Any) -> Scene:
    surface = {"bodies": "pucks", "sliding_friction": MU, "spinning_friction": MUS, "curl": curl}
    world = {"duration": 10.0}
    return from_document({"world": world, "solver": {"dt": dt}, "surface": surface, "ball": list(pucks), **more})


def run_for(scene: Scene, time: float, engine: str = "pymunk", *actions: Action) -> Simulation:
    simulation = start(scene, engine)
    for action in actions:
        simulation.apply(action)
    advance(simulation, round(time / scene.solver.dt))
    return simulation


def is_at_rest(frame: Frame) -> bool:
    return not (frame.velocity.any() or frame.angular_velocity.any())


@every_engine
def test_sliding_and_spinning_of_a_puck_decelerate_independently(engine: str) -> None:
    scene = ice(puck("a", 0, 0, 1.2, 1.6, 0.25))
    halfway = run_for(scene, 0.4, engine).frame()
    remaining = 1.0 - MU * G * 0.4 / 2.0
    assert halfway.velocity[0] == pytest.approx([1.2 * remaining, 1.6 * remaining], rel=1e-12)  # rounding of 80 steps
    assert halfway.angular_velocity[0] == pytest.approx(0.25 - 2.0 * MUS * G / R * 0.4, rel=1e-11)  # likewise
    final = run_for(scene, 5.0, engine).frame()
    assert is_at_rest(final)
    assert final.position[0] == pytest.approx(np.asarray([0.6, 0.8]) * 4.0 / (2.0 * MU * G), rel=1e-12)
    assert final.angle[0] == pytest.approx(0.25**2 / (4.0 * MUS * G / R), rel=1e-11)


def test_curling_puck_follows_the_closed_form() -> None:
    scene = ice(puck("a", 0, 0, 0.0, 2.0, 3.0), puck("b", 5, 0, 0.0, 2.0, -3.0), curl=0.4)
    frame = run_for(scene, 2.0).frame()
    expected = np.asarray(curled(0.0, 2.0, MU * G, 0.4, 2.0))
    assert frame.position[0] == pytest.approx(expected[:2], abs=1e-12)  # rounding of 400 steps
    assert frame.velocity[0] == pytest.approx(expected[2:], abs=1e-12)
    assert frame.position[0, 0] < 0.0  # counter-clockwise spin curls to the left
    assert frame.position[1] == pytest.approx([5.0 - expected[0], expected[1]], abs=1e-12)


def test_curling_puck_does_not_depend_on_the_step() -> None:
    pucks = [puck("a", 0, 0, 2.0, 0.05, 2.0), puck("b", 2.5, 0.1), puck("c", 3.5, 0.5)]
    coarse, fine = (run_for(ice(*pucks, curl=0.3, dt=dt), 6.0).frame() for dt in (0.02, 0.0005))
    assert is_at_rest(coarse)
    # hits are resolved at their exact time at any step; the rest is rounding, amplified by two hits
    assert coarse.position == pytest.approx(fine.position, abs=1e-8)


@given(
    spins=st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3)),
    offset=st.floats(-0.25, 0.25),
    speed=st.floats(0.5, 3.0),
    radius=st.floats(0.08, 0.2),
)
def test_engines_agree_on_collisions(
    spins: tuple[float, float, float], offset: float, speed: float, radius: float
) -> None:
    a, b, c = spins
    wall = {"points": [[3.0, -2.0], [3.0, 2.0]], "restitution": 0.5, "friction": 0.5}
    pucks = (
        puck("a", 0, 0, speed, 0, a),
        puck("b", 1.0, offset, spin=b),
        puck("c", 2.0, 3 * offset, spin=c, radius=radius),
    )
    scene = ice(*pucks, wall=[wall], dt=0.01)
    one, other = (run_for(scene, 1.5, engine).frame() for engine in ENGINES)
    # a step of 10 ms covers 3 cm; the time of a hit is found to 1e-15, which three collisions of discs amplify
    assert one.position == pytest.approx(other.position, abs=1e-8)
    assert one.velocity == pytest.approx(other.velocity, abs=1e-8)
    assert one.angular_velocity == pytest.approx(other.angular_velocity, abs=1e-7)


@pytest.mark.parametrize(("engine", "curl"), [("pymunk", 0.0), ("pymunk", 0.5), ("exact", 0.0)])
@settings(max_examples=15)
@given(
    spins=st.lists(st.floats(-4, 4), min_size=4, max_size=4), offset=st.floats(-0.25, 0.25), speed=st.floats(0.5, 3.0)
)
def test_energy_never_rises_and_mirrored_runs_stay_mirrored(
    engine: str, curl: float, spins: list[float], offset: float, speed: float
) -> None:
    def throw(sign: float) -> Simulation:
        positions = [(0.0, 0.0), (0.8, offset), (1.4, -offset), (1.9, 2.0 * offset)]
        pucks = [
            puck(str(k), x, sign * y, speed if k == 0 else 0.0, 0.0, sign * spin)
            for k, ((x, y), spin) in enumerate(zip(positions, spins, strict=True))
        ]
        wall = {"points": [[2.6, -9.0], [2.6, 9.0]], "restitution": 0.7, "friction": 0.3}
        return start(ice(*pucks, curl=curl, dt=0.02, wall=[wall]), engine)

    run, mirrored = throw(1.0), throw(-1.0)
    previous = total_energy(run)
    for _ in range(50):
        run.step()
        mirrored.step()
        now = total_energy(run)
        assert now <= previous + 1e-11  # rounding of some 100 J
        previous = now
    frame, mirrored_frame = run.frame(), mirrored.frame()
    # the mirrored runs differ by rounding, amplified by up to four hits
    assert frame.position * [1.0, -1.0] == pytest.approx(mirrored_frame.position, abs=1e-8)
    assert frame.angular_velocity == pytest.approx(-mirrored_frame.angular_velocity, abs=1e-7)


@pytest.mark.parametrize(("engine", "curl"), [("pymunk", 0.0), ("pymunk", 0.4), ("exact", 0.0)])
def test_ledger_of_pucks_closes(engine: str, curl: float) -> None:
    wall = {"points": [[2.0, -2.0], [2.0, 2.0]], "restitution": 0.5, "friction": 0.5}
    simulation = start(ice(puck("a", 0, 0, 2.0, 0.1, 3.0), puck("b", 1.0, 0.1), wall=[wall], curl=curl), engine)
    simulation.account()
    before = total_energy(simulation)
    advance(simulation, 200)
    account = simulation.account()
    assert sum(account.values()) == pytest.approx(total_energy(simulation) - before, abs=1e-11)  # rounding of 40 J
    assert account[Cause.FRICTION] < -1.0
    assert account[Cause.RESTITUTION] < -0.1
    others = set(account) - {Cause.FRICTION, Cause.RESTITUTION}
    assert sum(abs(account[cause]) for cause in others) < 1e-6  # hops and corrected overlaps


@every_engine
def test_pucks_fall_into_pockets(engine: str) -> None:
    hole = {"position": [1.0, 0.0], "radius": 0.05}
    frame = run_for(ice(puck("a", 0, 0, 1.5, 0, 1.0), pocket=[hole]), 2.0, engine).frame()
    assert frame.position[0].tolist() == [1.0, 0.0]
    assert is_at_rest(frame)


@every_engine
def test_friction_can_change_while_pucks_slide(engine: str) -> None:
    scene = ice(puck("a", 0, 0, 2.0, 0.0))
    simulation = run_for(scene, 1.0, engine)
    simulation.apply(SetParameter(time=1.0, path="surface.sliding_friction", value=0.5 * MU))
    speed = 2.0 - MU * G
    assert simulation.scene.surface is not None
    assert simulation.scene.surface.sliding_friction == 0.5 * MU
    advance(simulation, 200)
    assert simulation.frame().velocity[0, 0] == pytest.approx(speed - 0.5 * MU * G, rel=1e-12)  # rounding
    smooth = start(frictionless_ice(), engine)
    with pytest.raises(ActionError, match="floor friction cannot be switched"):
        smooth.apply(SetParameter(time=0.0, path="surface.sliding_friction", value=0.1))


def frictionless_ice() -> Scene:
    return from_document({"surface": {"bodies": "pucks"}, "ball": [puck("a", 0, 0, 1.0)]})


def test_curl_can_be_set_only_where_it_is_modelled() -> None:
    scene = ice(puck("a", 0, 0, 2.0, 0.0, 3.0))
    curl = SetParameter(time=0.0, path="surface.curl", value=0.4)
    expected = curled(2.0, 0.0, MU * G, 0.4, 1.0)
    assert run_for(scene, 1.0, "pymunk", curl).frame().position[0] == pytest.approx(expected[:2], abs=1e-12)  # rounding
    with pytest.raises(ActionError, match="curl"):
        start(scene, "exact").apply(curl)


def test_demands_of_a_scene_of_pucks() -> None:
    straight, curled_scene = ice(puck("a", 0, 0)), ice(puck("a", 0, 0), curl=0.1)
    assert demands(curled_scene) - demands(straight) == {Demand.CURL}
    assert {Demand.SURFACE, Demand.PUCKS} <= demands(straight)
    assert Demand.SPIN not in demands(curled_scene)
    with pytest.raises(Refusal, match="curl"):
        start(curled_scene, "exact")
    for engine in ("pymunk", "reference"):
        start(curled_scene, engine).step()
    assert loads(dumps(curled_scene)) == curled_scene
    assert straight.bodies.moment[0] == pytest.approx(0.5 * MASS * R**2, rel=1e-15)  # a disc


def test_pucks_on_a_frictionless_surface_are_discs_for_every_engine() -> None:
    scene = frictionless_ice()
    assert not on_floor(scene)
    for engine in ("pymunk", "exact", "reference"):
        simulation = start(scene, engine)
        simulation.step()
        assert simulation.frame().position[0, 0] == pytest.approx(scene.solver.dt, rel=1e-12)  # rounding


def test_puck_accepts_impulses_but_no_strike_and_others_can_spawn() -> None:
    simulation = start(ice(puck("a", 0, 0)), "pymunk")
    with pytest.raises(ActionError, match="puck"):
        simulation.apply(Strike(time=0, ball="a", aim=0.0, speed=1.0))
    simulation.apply(Impulse(time=0, body="a", impulse=(MASS, 0.0), angular=0.5 * MASS * R**2))
    simulation.apply(Spawn(time=0, ball=Ball(name="new", position=(1.0, 0.0), radius=0.1)))
    assert simulation.frame().velocity[0].tolist() == [1.0, 0.0]
    assert simulation.frame().angular_velocity[0] == pytest.approx(1.0, rel=1e-15)
    advance(simulation, 300)
    assert simulation.frame().position[1, 0] > 1.0  # it was hit
    with pytest.raises(ActionError, match="angular_velocity"):
        simulation.apply(Spawn(time=0, ball=Ball(position=(9.0, 0.0), radius=0.1, spin=(0.0, 0.0, 1.0))))


@pytest.mark.parametrize(
    ("surface", "more", "path", "expected_text"),
    [
        ({"curl": 0.1, "bodies": "spheres"}, {}, "surface.curl", "pucks"),
        ({"rolling_friction": 0.1}, {}, "surface.rolling_friction", "do not roll"),
        ({}, {"contact_models": {"ball_ball": "frictional"}}, "contact_models.ball_ball", "spheres"),
        ({}, {"ball": [puck("a", 0, 0) | {"spin": [0, 0, 1]}]}, "ball.a.spin", "angular_velocity"),
        ({}, {"wall": [{"points": [[5, 0], [5, 1]], "height": 0.01}]}, "wall[0].height", "cushions"),
        ({}, {"shot": [{"ball": "a", "aim": 0, "speed": 1}]}, "shot[0]", "cue"),
        ({"bodies": "bricks"}, {}, "surface.bodies", "'spheres' or 'pucks'"),
    ],
)
def test_unsupported_settings_of_pucks_are_refused(
    surface: dict[str, Any], more: dict[str, Any], path: str, expected_text: str
) -> None:
    document = {"surface": {"bodies": "pucks", **surface}, "ball": [puck("a", 0, 0)], **more}
    with pytest.raises(SceneError) as caught:
        from_document(document)
    faults = {fault.path: fault.message for fault in caught.value.faults}
    assert any(found.startswith(path) and expected_text in message for found, message in faults.items()), faults
