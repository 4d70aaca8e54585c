"""Rebound with speed-dependent restitution and kicks: the same law on every engine."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.action import ActionError, Spawn
from sandbox.engines.common.energy_balance import total_energy
from sandbox.engines.common.restitution import fraction_at, kicked, rebound, segment_fractions
from sandbox.engines.contract import Refusal
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Post
from sandbox.scene.description.surface import Floor
from sandbox.scene.description.world import Kick
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document
from tests.engines.builders import make_scene
from tests.engines.stepping import advance

ENGINES = ("pymunk", "exact", "reference")
SURFACES = {"wall": (0.3, 0.0, 0.3), "rubber": (0.8, 0.3, 0.6), "target": (0.35, 0.5, 0.2)}
"""Restitution, its falloff in s/m and friction of a pinball table, from Visual Pinball's materials."""
BUMPER = {"speed": 0.81, "threshold": 0.054}
SLINGSHOT = {"speed": 2.16, "threshold": 0.054, "profile": "middle", "adds_to": "approach"}
R, M = 0.01349, 0.08
BALL = {"name": "ball", "radius": R, "mass": M}
FLOOR = [[-1.0, 0.0], [1.0, 0.0]]
TOLERANCE = 1e-9
"""Tolerance relative to the speed: the law of a single impact without forces holds to rounding."""


def falling_ball(speed: float, x: float = 0.0, sideways: float = 0.0, **wall: Any) -> Scene:
    """Return a ball that hits a wall along x after 10 ms, without gravity."""
    ball = {**BALL, "position": [x - 0.01 * sideways, R + 0.01 * speed], "velocity": [sideways, -speed]}
    return from_document(
        {"solver": {"dt": 0.001}, "world": {"duration": 0.1}, "ball": [ball], "wall": [{"points": FLOOR, **wall}]}
    )


def run_steps(scene: Scene, engine: str, steps: int = 40) -> tuple[SwitchableSimulation, np.ndarray[Any, Any]]:
    """Return a simulation with accounting after some steps, and the velocity of its ball, m/s."""
    simulation = start(scene, engine)
    simulation.account()
    advance(simulation, steps)
    return simulation, simulation.frame().velocity[0]


def assert_ledger_closes(simulation: SwitchableSimulation, before: float) -> None:
    booked = sum(simulation.account().values())
    assert total_energy(simulation) - before == pytest.approx(booked, rel=1e-9, abs=1e-13)  # rounding


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("surface", "speed"), [("wall", 1.0), ("rubber", 0.01), ("target", 7.0)])
def test_restitution_falls_with_speed(engine: str, surface: str, speed: float) -> None:
    e, f, _ = SURFACES[surface]
    simulation, velocity = run_steps(falling_ball(speed, restitution=e, restitution_falloff=f), engine)
    assert velocity[1] == pytest.approx(e / (1 + f * speed) * speed, rel=TOLERANCE)
    loss = 0.5 * M * (speed**2 - velocity[1] ** 2)
    assert simulation.account()[Cause.RESTITUTION] == pytest.approx(-loss, rel=1e-9)  # rounding
    assert simulation.account()[Cause.KICKS] == 0.0


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("speed", [0.06, 3.0])
def test_bumper_adds_its_speed_once_and_its_energy_is_booked(engine: str, speed: float) -> None:
    e, f, _ = SURFACES["rubber"]
    post = {"position": [0.0, -0.0243], "radius": 0.0243, "restitution": e, "restitution_falloff": f, "kick": BUMPER}
    ball = {**BALL, "position": [0.0, R + 0.01 * speed], "velocity": [0.0, -speed]}
    scene = from_document({"solver": {"dt": 0.001}, "ball": [ball], "post": [post]})
    energy = 0.5 * M * speed**2
    simulation, velocity = run_steps(scene, engine)
    unkicked = e / (1 + f * speed) * speed
    assert velocity[1] == pytest.approx(unkicked + 0.81, rel=TOLERANCE)
    assert simulation.account()[Cause.KICKS] == pytest.approx(
        0.5 * M * ((unkicked + 0.81) ** 2 - unkicked**2), rel=1e-9
    )
    assert simulation.account()[Cause.RESTITUTION] == pytest.approx(0.5 * M * unkicked**2 - energy, rel=1e-9)
    assert_ledger_closes(simulation, energy)


@pytest.mark.parametrize("engine", ENGINES)
def test_no_kick_below_the_threshold(engine: str) -> None:
    for speed, kick in ((0.0539, 0.0), (0.0541, 0.81)):
        _, velocity = run_steps(falling_ball(speed, restitution=0.5, kick=BUMPER), engine)
        assert velocity[1] == pytest.approx(0.5 * speed + kick, rel=TOLERANCE)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("x", "speed"), [(-0.9, 0.06), (0.0, 2.0), (0.3, 7.0)])
def test_slingshot_adds_to_the_approach_speed_and_its_energy_is_booked(engine: str, x: float, speed: float) -> None:
    e, f, _ = SURFACES["rubber"]
    scene = falling_ball(speed, x, restitution=e, restitution_falloff=f, kick=SLINGSHOT)
    simulation, velocity = run_steps(scene, engine)
    s = 0.5 * (x + 1.0)
    driven = speed + 2.16 * 4 * s * (1 - s)
    unkicked, rebound_speed = (e / (1 + f * v) * v for v in (speed, driven))
    assert velocity[1] == pytest.approx(rebound_speed, rel=TOLERANCE)
    # rounding
    assert simulation.account()[Cause.KICKS] == pytest.approx(0.5 * M * (rebound_speed**2 - unkicked**2), rel=1e-9)
    assert_ledger_closes(simulation, 0.5 * M * speed**2)


@pytest.mark.parametrize("engine", ENGINES)
def test_kick_added_to_the_approach_has_no_effect_without_restitution(engine: str) -> None:
    _, velocity = run_steps(falling_ball(2.0, 0.3, kick=SLINGSHOT), engine)
    assert velocity[1] == pytest.approx(0.0, abs=TOLERANCE)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("x", [-0.9, 0.0])
def test_kick_added_to_the_rebound_is_largest_in_the_middle(engine: str, x: float) -> None:
    fraction = 0.5 * (x + 1.0)
    _, velocity = run_steps(falling_ball(2.0, x, restitution=0.8, kick=SLINGSHOT | {"adds_to": "rebound"}), engine)
    assert velocity[1] == pytest.approx(1.6 + 2.16 * 4 * fraction * (1 - fraction), rel=TOLERANCE)
    assert velocity[1] <= (1.6 + 2.16) * (1 + TOLERANCE)


@pytest.mark.parametrize("engine", ENGINES)
def test_kick_fraction_is_measured_along_the_whole_polyline(engine: str) -> None:
    points = [[6.0, 0.0], [4.0, 0.0], [2.0, 0.0], [2.0, -2.0]]  # 6 m long; x = 2.5 is at 3.5 m
    _, velocity = run_steps(falling_ball(2.0, 2.5, points=points, restitution=0.5, kick=SLINGSHOT), engine)
    fraction = 3.5 / 6.0
    assert velocity[1] == pytest.approx(0.5 * (2.0 + 2.16 * 4 * fraction * (1 - fraction)), rel=TOLERANCE)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("adds_to", "rebound_speed"), [("rebound", 1.0 + 0.81), ("approach", 0.5 * 2.81)])
def test_vertex_of_two_segments_kicks_once(engine: str, adds_to: str, rebound_speed: float) -> None:
    points = [[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0]]
    kick = BUMPER | {"adds_to": adds_to}
    simulation, velocity = run_steps(falling_ball(2.0, 0.0, points=points, restitution=0.5, kick=kick), engine)
    assert velocity[1] == pytest.approx(rebound_speed, rel=TOLERANCE)
    assert_ledger_closes(simulation, 0.5 * M * 4.0)


@pytest.mark.parametrize("engine", ENGINES)
def test_friction_of_a_kick_follows_its_normal_impulse(engine: str) -> None:
    # Grazing: it slips throughout, so the friction impulse is μ times the whole normal impulse, including the kick.
    scene = falling_ball(1.0, 0.0, 8.0, restitution=0.5, friction=0.3, kick=BUMPER)
    simulation, velocity = run_steps(scene, engine)
    assert velocity[1] == pytest.approx(1.31, rel=TOLERANCE)
    assert velocity[0] == pytest.approx(8.0 - 0.3 * 2.31, rel=TOLERANCE)
    spin = simulation.frame().angular_velocity[0]
    assert abs(spin) == pytest.approx(0.3 * 2.31 * M * R / (0.5 * M * R**2), rel=TOLERANCE)
    assert_ledger_closes(simulation, 0.5 * M * 65.0)


@pytest.mark.parametrize("engine", ENGINES)
def test_ball_at_rest_on_a_kicking_wall_stays_at_rest(engine: str) -> None:
    # The threshold exceeds the speed from one step of gravity, 0.0098 m/s, which the ball may have at contact.
    wall = {"points": FLOOR, "kick": {"speed": 5.0, "threshold": 0.02}, "restitution": 0.5, "restitution_falloff": 0.3}
    scene = make_scene(
        world={"gravity": [0.0, -9.81]}, solver={"dt": 0.001}, ball=[{**BALL, "position": [0.0, R]}], wall=[wall]
    )
    simulation, velocity = run_steps(scene, engine, 500)
    assert abs(velocity[1]) < 1e-9  # rounding of sums on pymunk
    assert simulation.frame().position[0, 1] == pytest.approx(R, abs=1e-5)  # slop of pymunk
    assert simulation.account()[Cause.KICKS] == 0.0


@pytest.mark.parametrize("engine", ENGINES)
def test_falloffs_of_two_balls_add_and_a_pair_overrides_both(engine: str) -> None:
    def separation_speed(**more: Any) -> float:
        materials = [{"name": n, "restitution": 0.9, "restitution_falloff": f} for n, f in (("a", 0.2), ("b", 0.3))]
        balls = [
            {"position": [-0.02, 0.0], "velocity": [2.0, 0.0], "radius": R, "mass": M, "material": "a"},
            {"position": [0.02, 0.0], "velocity": [-2.0, 0.0], "radius": R, "mass": M, "material": "b"},
        ]
        scene = from_document({"solver": {"dt": 0.001}, "material": materials, "ball": balls, **more})
        _, velocity = run_steps(scene, engine, 20)
        return float(2.0 * abs(velocity[0]))

    assert separation_speed() == pytest.approx(0.81 * 4.0 / (1 + 0.5 * 4.0), rel=TOLERANCE)
    pair = {"between": ["a", "b"], "restitution_falloff": 0.05}
    assert separation_speed(pair=[pair]) == pytest.approx(0.81 * 4.0 / (1 + 0.05 * 4.0), rel=TOLERANCE)


def test_box_landing_flat_on_a_kicking_wall_stays_level() -> None:
    for engine in ("pymunk", "reference"):
        scene = make_scene(
            solver={"dt": 0.001},
            box=[{"position": [0.0, 0.12], "velocity": [0.0, -2.0], "size": [0.2, 0.2], "mass": 1.0}],
            wall=[{"points": FLOOR, "restitution": 0.5, "restitution_falloff": 0.5, "kick": BUMPER}],
        )
        simulation, velocity = run_steps(scene, engine)
        # ten iterations of the solver
        assert velocity[1] == pytest.approx(0.5 * 2.0 / (1 + 0.5 * 2.0) + 0.81, rel=1e-6)
        assert simulation.account()[Cause.KICKS] > 0.0
        assert_ledger_closes(simulation, 2.0)


@pytest.mark.parametrize("detection", ["bisect", "swept", "shrink"])
def test_kicks_work_with_every_detection_of_the_reference(detection: str) -> None:
    scene = falling_ball(3.0, restitution=0.8, restitution_falloff=0.3, kick=BUMPER)
    simulation = start(scene, "reference", scene.solver.replace(detection=detection, integrator="velocity_verlet"))
    simulation.account()
    advance(simulation, 40)
    assert simulation.frame().velocity[0, 1] == pytest.approx(0.8 / 1.9 * 3.0 + 0.81, rel=TOLERANCE)
    assert_ledger_closes(simulation, 0.5 * M * 9.0)


@given(st.floats(0, 1), st.floats(0, 10), st.floats(0, 100))
def test_rebound_is_bounded_by_restitution_and_grows_with_speed(e: float, f: float, v: float) -> None:
    assert 0.0 <= rebound(e, f, v) <= e * v * (1 + 1e-15)
    assert rebound(e, f, 1.01 * v) >= rebound(e, f, v) * (1 - 1e-14)  # both are rounded


@given(st.floats(0, 10), st.floats(0, 1))
def test_middle_profile_has_its_largest_kick_in_the_middle_and_none_at_the_ends(speed: float, fraction: float) -> None:
    assert kicked(speed, 0.1, True, 0.5, 1.0) == kicked(speed, 0.1, False, fraction, 1.0) == speed
    assert 0.0 <= kicked(speed, 0.1, True, fraction, 1.0) <= speed * (1 + 1e-15)
    assert kicked(speed, 0.1, True, 0.0, 1.0) == kicked(speed, 0.1, True, 1.0, 1.0) == 0.0
    assert kicked(speed, 0.1, False, fraction, 0.1) == 0.0


@given(st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=3, max_size=6, unique=True), st.booleans())
def test_segment_fractions_are_contiguous_from_zero_to_one(points: list[tuple[float, float]], closed: bool) -> None:
    parts = segment_fractions((*points, points[0]) if closed else points)
    assert parts[0][0] == 0.0
    assert parts[-1][1] == pytest.approx(1.0, rel=1e-14)  # rounding of sums
    assert all(a[1] == b[0] for a, b in pairwise(parts))
    assert len(parts) == len(points) - (not closed)


def test_fraction_at_is_clamped_to_the_ends_of_a_segment() -> None:
    assert fraction_at((0.0, 0.0), (2.0, 0.0), (0.5, 0.75), (1.0, 3.0)) == 0.625
    assert fraction_at((0.0, 0.0), (2.0, 0.0), (0.5, 0.75), (-1.0, 3.0)) == 0.5
    assert fraction_at((0.0, 0.0), (2.0, 0.0), (0.5, 0.75), (9.0, 3.0)) == 0.75


def test_penalty_refuses_falloff_and_kicks() -> None:
    scene = falling_ball(1.0, restitution=0.5, restitution_falloff=0.3, kick=BUMPER)
    with pytest.raises(Refusal, match=r"'penalty' does not model falloff.*'penalty' does not model kicks"):
        start(scene, "reference", scene.solver.replace(response="penalty"))
    plain = falling_ball(1.0, restitution=0.5)
    simulation = start(plain, "reference", plain.solver.replace(response="penalty"))
    with pytest.raises(ActionError, match="does not support restitution_falloff"):
        simulation.apply(Spawn(time=0.0, ball=Ball(position=(0.5, 0.5), radius=R, restitution_falloff=0.1)))


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("engine", ENGINES)
@settings(max_examples=10)
@given(x=st.floats(-0.2, 0.2), vx=st.floats(-2, 2), vy=st.floats(-2, 2), g=st.floats(0, 2))
def test_ledger_closes_in_a_kicking_box(engine: str, x: float, vx: float, vy: float, g: float) -> None:
    rubber = {"restitution": 0.8, "restitution_falloff": 0.3, "friction": 0.6}
    box = {"points": [[-0.3, 0.0], [0.3, 0.0], [0.3, 0.6], [-0.3, 0.6]], "closed": True, **rubber}
    post = {"position": [0.0, 0.45], "radius": 0.05, **rubber, "kick": BUMPER}
    scene = make_scene(
        world={"gravity": [0.0, -g]},
        solver={"dt": 0.002},
        ball=[{**BALL, "position": [x, 0.2], "velocity": [vx, vy]}],
        wall=[{**box, "kick": {"speed": 0.5, "threshold": 0.1, "profile": "middle"}}],
        post=[post],
    )
    simulation = start(scene, engine)
    simulation.account()
    before = total_energy(simulation)
    advance(simulation, 400)
    account = simulation.account()
    scale = sum(abs(energy) for energy in account.values()) + before + 1e-6
    assert total_energy(simulation) - before == pytest.approx(sum(account.values()), abs=1e-9 * scale)  # rounding
    assert account[Cause.KICKS] >= 0.0 >= account[Cause.RESTITUTION]
    # Hops on a post add a little energy on exact; the rebound law itself adds none.
    assert account[Cause.PHANTOM] <= 1e-6 * scale


def test_surfaces_refuse_kicks_in_scenes_built_without_a_file() -> None:
    post = Post(position=(1.0, 0.0), radius=0.1, kick=Kick(speed=1.0))
    scene = Scene(
        surface=Floor(sliding_friction=0.2), balls=(Ball(position=(0.0, 0.0), radius=0.03, mass=0.2),), posts=(post,)
    )
    with pytest.raises(SceneError, match=r"post\[0\]\.kick: is not supported in a scene with a \[surface\]"):
        start(scene, "pymunk")
