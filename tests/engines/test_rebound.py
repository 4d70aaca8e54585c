"""How fast things part that hit what falls off with speed, or kicks: one law on every engine."""

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
from sandbox.engines.energy_ledger import Cause, EnergyLedger
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Post
from sandbox.scene.description.surface import Floor
from sandbox.scene.description.world import Kick
from sandbox.scene.files.load import from_document

ENGINES = ("pymunk", "exact", "reference")
SURFACES = {
    "wall": (0.3, 0.0, 0.3),
    "rubber": (0.8, 0.3, 0.6),
    "target": (0.35, 0.5, 0.2),
    "post": (0.9, 0.1, 0.3),
}
"""Restitution, its falloff in s/m, friction: of a pinball table, as in Visual Pinball's materials."""
BUMPER = {"speed": 0.81, "threshold": 0.054}
SLINGSHOT = {"speed": 2.16, "threshold": 0.054, "profile": "middle", "adds_to": "approach"}
R, M = 0.01349, 0.08
BALL = {"name": "ball", "radius": R, "mass": M}
FLOOR = [[-1.0, 0.0], [1.0, 0.0]]
LAW = 1e-9
"""Relative to the speed: a law of one hit, without forces, holds to rounding; the issue asks for this."""


def falling(speed: float, x: float = 0.0, sideways: float = 0.0, **wall: Any) -> Scene:
    """Return a ball that falls on to a wall along x without gravity, 10 ms from now."""
    ball = {**BALL, "position": [x - 0.01 * sideways, R + 0.01 * speed], "velocity": [sideways, -speed]}
    return from_document(
        {"solver": {"dt": 0.001}, "world": {"duration": 0.1}, "ball": [ball], "wall": [{"points": FLOOR, **wall}]}
    )


def after(scene: Scene, engine: str, steps: int = 40) -> tuple[SwitchableSimulation, np.ndarray[Any, Any]]:
    """Return a simulation that has gone on for some steps, with an account, and its ball's velocity, m/s."""
    simulation = start(scene, engine)
    simulation.account()
    for _ in range(steps):
        simulation.step()
    return simulation, simulation.frame().velocity[0]


def closes(simulation: SwitchableSimulation, before: float) -> None:
    brought = sum(simulation.account().values())
    assert total_energy(simulation) - before == pytest.approx(brought, rel=1e-9, abs=1e-13)  # rounding


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("speed", [0.01, 1.0, 7.0])
def test_restitution_falls_with_speed(engine: str, surface: str, speed: float) -> None:
    e, f, _ = SURFACES[surface]
    simulation, velocity = after(falling(speed, restitution=e, restitution_falloff=f), engine)
    assert velocity[1] == pytest.approx(e / (1 + f * speed) * speed, rel=LAW)
    took = 0.5 * M * (speed**2 - velocity[1] ** 2)
    assert simulation.account()[Cause.RESTITUTION] == pytest.approx(-took, rel=1e-9)  # rounding
    assert simulation.account()[Cause.KICKS] == 0.0


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("speed", [0.06, 0.5, 3.0])
def test_bumper_adds_its_speed_once_and_books_it(engine: str, speed: float) -> None:
    e, f, _ = SURFACES["rubber"]
    post = {"position": [0.0, -0.0243], "radius": 0.0243, "restitution": e, "restitution_falloff": f, "kick": BUMPER}
    ball = {**BALL, "position": [0.0, R + 0.01 * speed], "velocity": [0.0, -speed]}
    scene = from_document({"solver": {"dt": 0.001}, "ball": [ball], "post": [post]})
    energy = 0.5 * M * speed**2
    simulation, velocity = after(scene, engine)
    alone = e / (1 + f * speed) * speed
    assert velocity[1] == pytest.approx(alone + 0.81, rel=LAW)
    assert simulation.account()[Cause.KICKS] == pytest.approx(0.5 * M * ((alone + 0.81) ** 2 - alone**2), rel=1e-9)
    assert simulation.account()[Cause.RESTITUTION] == pytest.approx(0.5 * M * alone**2 - energy, rel=1e-9)
    closes(simulation, energy)


@pytest.mark.parametrize("engine", ENGINES)
def test_nothing_is_kicked_below_the_threshold(engine: str) -> None:
    for speed, kick in ((0.0539, 0.0), (0.0541, 0.81)):
        _, velocity = after(falling(speed, restitution=0.5, kick=BUMPER), engine)
        assert velocity[1] == pytest.approx(0.5 * speed + kick, rel=LAW)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("x", [-0.9, -0.5, 0.0, 0.3])
@pytest.mark.parametrize("speed", [0.06, 0.5, 1.0, 2.0, 7.0])
def test_slingshot_drives_the_ball_into_its_rubber_and_books_what_that_gains(
    engine: str, x: float, speed: float
) -> None:
    e, f, _ = SURFACES["rubber"]
    scene = falling(speed, x, restitution=e, restitution_falloff=f, kick=SLINGSHOT)
    simulation, velocity = after(scene, engine)
    s = 0.5 * (x + 1.0)
    driven = speed + 2.16 * 4 * s * (1 - s)
    alone, out = (e / (1 + f * v) * v for v in (speed, driven))
    assert velocity[1] == pytest.approx(out, rel=LAW)
    assert simulation.account()[Cause.KICKS] == pytest.approx(0.5 * M * (out**2 - alone**2), rel=1e-9)  # rounding
    closes(simulation, 0.5 * M * speed**2)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("speed", "out"), [(0.5, 1.1835), (1.0, 1.2977), (2.0, 1.4804)])
def test_slingshot_throws_as_hard_as_visual_pinball(engine: str, speed: float, out: float) -> None:
    # There 80 units at most, halved in the middle: 40 × 0.05397 = 2.16 m/s onto the approach, then 0.8/(1 + 0.3 v).
    scene = falling(speed, restitution=0.8, restitution_falloff=0.3, kick=SLINGSHOT)
    _, velocity = after(scene, engine)
    assert velocity[1] == pytest.approx(out, abs=5e-5)  # the table's digits


@pytest.mark.parametrize("engine", ENGINES)
def test_kick_onto_the_approach_of_a_surface_without_restitution_gives_nothing(engine: str) -> None:
    _, velocity = after(falling(2.0, 0.3, kick=SLINGSHOT), engine)
    assert velocity[1] == pytest.approx(0.0, abs=LAW)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("x", [-0.9, -0.5, 0.0, 0.3])
def test_kick_onto_the_rebound_is_most_in_the_middle(engine: str, x: float) -> None:
    share = 0.5 * (x + 1.0)
    _, velocity = after(falling(2.0, x, restitution=0.8, kick=SLINGSHOT | {"adds_to": "rebound"}), engine)
    assert velocity[1] == pytest.approx(1.6 + 2.16 * 4 * share * (1 - share), rel=LAW)
    assert velocity[1] <= (1.6 + 2.16) * (1 + LAW)


@pytest.mark.parametrize("engine", ENGINES)
def test_share_counts_along_the_whole_polyline(engine: str) -> None:
    points = [[-1.0, 0.0], [-0.5, 0.0], [1.0, 0.0], [1.0, -2.0]]  # 4 m long; x = 0.25 lies at 1.25 m
    _, velocity = after(falling(2.0, 0.25, points=points, restitution=0.5, kick=SLINGSHOT), engine)
    share = 1.25 / 4.0
    assert velocity[1] == pytest.approx(0.5 * (2.0 + 2.16 * 4 * share * (1 - share)), rel=LAW)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("adds_to", "out"), [("rebound", 1.0 + 0.81), ("approach", 0.5 * 2.81)])
def test_joint_of_two_segments_kicks_once(engine: str, adds_to: str, out: float) -> None:
    points = [[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0]]
    kick = BUMPER | {"adds_to": adds_to}
    simulation, velocity = after(falling(2.0, 0.0, points=points, restitution=0.5, kick=kick), engine)
    assert velocity[1] == pytest.approx(out, rel=LAW)
    closes(simulation, 0.5 * M * 4.0)


@pytest.mark.parametrize("engine", ENGINES)
def test_friction_of_a_kick_is_that_of_its_impulse(engine: str) -> None:
    # Grazing: it slips throughout, so that friction takes μ times the whole impulse along the normal, kick included.
    scene = falling(1.0, 0.0, 8.0, restitution=0.5, friction=0.3, kick=BUMPER)
    simulation, velocity = after(scene, engine)
    assert velocity[1] == pytest.approx(1.31, rel=LAW)
    assert velocity[0] == pytest.approx(8.0 - 0.3 * 2.31, rel=LAW)
    spin = simulation.frame().angular_velocity[0]
    assert abs(spin) == pytest.approx(0.3 * 2.31 * M * R / (0.5 * M * R**2), rel=LAW)
    closes(simulation, 0.5 * M * 65.0)


@pytest.mark.parametrize("engine", ENGINES)
def test_ball_that_rests_on_a_wall_that_kicks_stays_there(engine: str) -> None:
    # The threshold is above what a step of gravity gives, 0.0098 m/s: so much it may fall before it is found to touch.
    wall = {"points": FLOOR, "kick": {"speed": 5.0, "threshold": 0.02}, "restitution": 0.5, "restitution_falloff": 0.3}
    scene = from_document(
        {
            "world": {"gravity": [0.0, -9.81]},
            "solver": {"dt": 0.001},
            "ball": [{**BALL, "position": [0.0, R]}],
            "wall": [wall],
        }
    )
    simulation, velocity = after(scene, engine, 500)
    assert abs(velocity[1]) < 1e-9  # pymunk leaves the rounding of its sums
    assert simulation.frame().position[0, 1] == pytest.approx(R, abs=1e-5)  # pymunk lets it sink by its slop
    assert simulation.account()[Cause.KICKS] == 0.0


@pytest.mark.parametrize("engine", ENGINES)
def test_two_balls_add_their_falloffs_and_a_pair_outranks_both(engine: str) -> None:
    def parted(**more: Any) -> float:
        materials = [{"name": n, "restitution": 0.9, "restitution_falloff": f} for n, f in (("a", 0.2), ("b", 0.3))]
        balls = [
            {"position": [-0.02, 0.0], "velocity": [2.0, 0.0], "radius": R, "mass": M, "material": "a"},
            {"position": [0.02, 0.0], "velocity": [-2.0, 0.0], "radius": R, "mass": M, "material": "b"},
        ]
        scene = from_document({"solver": {"dt": 0.001}, "material": materials, "ball": balls, **more})
        _, velocity = after(scene, engine, 20)
        return float(2.0 * abs(velocity[0]))

    assert parted() == pytest.approx(0.81 * 4.0 / (1 + 0.5 * 4.0), rel=LAW)
    pair = {"between": ["a", "b"], "restitution_falloff": 0.05}
    assert parted(pair=[pair]) == pytest.approx(0.81 * 4.0 / (1 + 0.05 * 4.0), rel=LAW)


def test_box_flat_on_a_wall_that_kicks_goes_up_level() -> None:
    for engine in ("pymunk", "reference"):
        scene = from_document(
            {
                "solver": {"dt": 0.001},
                "box": [{"position": [0.0, 0.12], "velocity": [0.0, -2.0], "size": [0.2, 0.2], "mass": 1.0}],
                "wall": [{"points": FLOOR, "restitution": 0.5, "restitution_falloff": 0.5, "kick": BUMPER}],
            }
        )
        simulation, velocity = after(scene, engine)
        assert velocity[1] == pytest.approx(0.5 * 2.0 / (1 + 0.5 * 2.0) + 0.81, rel=1e-6)  # ten passes of the solver
        assert simulation.account()[Cause.KICKS] > 0.0
        closes(simulation, 2.0)


@pytest.mark.parametrize("detection", ["bisect", "swept", "shrink"])
def test_every_detection_of_the_reference_kicks(detection: str) -> None:
    scene = falling(3.0, restitution=0.8, restitution_falloff=0.3, kick=BUMPER)
    simulation = start(scene, "reference", scene.solver.replace(detection=detection, integrator="velocity_verlet"))
    simulation.account()
    for _ in range(40):
        simulation.step()
    assert simulation.frame().velocity[0, 1] == pytest.approx(0.8 / 1.9 * 3.0 + 0.81, rel=LAW)
    closes(simulation, 0.5 * M * 9.0)


def bumpers(dt: float) -> Scene:
    rubber = {"restitution": 0.8, "restitution_falloff": 0.3, "friction": 0.3}
    posts = [{"position": p, "radius": 0.0243, "kick": BUMPER, **rubber} for p in ([0.0, 0.0], [0.13, 0.05])]
    return from_document(
        {
            "world": {"gravity": [0.0, -0.7], "duration": 0.25},
            "solver": {"dt": dt},
            "ball": [{**BALL, "position": [0.06, 0.03], "velocity": [-0.9, -0.35]}],
            "post": posts,
            "wall": [{"points": [[-0.3, -0.1], [0.3, -0.1]], "restitution": 0.3, "friction": 0.3}],
        }
    )


def end_of(engine: str, dt: float) -> np.ndarray[Any, Any]:
    """Return where the ball is between two bumpers after 0.25 s, and several hits."""
    simulation = start(bumpers(dt), engine)
    hits = 0
    simulation.contacts()
    for _ in range(round(0.25 / dt)):
        simulation.step()
        hits += len(simulation.contacts().time)
    assert hits >= 2
    return simulation.frame().position[0]


def test_engines_agree_on_bumpers_in_the_order_of_their_step() -> None:
    truth = end_of("exact", 0.25)
    for engine in ("pymunk", "reference"):
        coarse, fine = (float(np.hypot(*(end_of(engine, dt) - truth))) for dt in (2e-4, 2.5e-5))
        # Contacts are found at the end of a step: an error of first order, as large as v·h, that the curved posts
        # enlarge at each hit.
        assert fine < 2e-3
        assert fine < 0.5 * coarse


@given(st.floats(0, 1), st.floats(0, 10), st.floats(0, 100))
def test_rebound_never_exceeds_that_without_falloff_and_grows_with_speed(e: float, f: float, v: float) -> None:
    assert 0.0 <= rebound(e, f, v) <= e * v * (1 + 1e-15)
    assert rebound(e, f, 1.01 * v) >= rebound(e, f, v) * (1 - 1e-14)  # both round


@given(st.floats(0, 10), st.floats(0, 1))
def test_middle_is_where_a_kick_is_most_and_ends_have_none(speed: float, share: float) -> None:
    assert kicked(speed, 0.1, True, 0.5, 1.0) == kicked(speed, 0.1, False, share, 1.0) == speed
    assert 0.0 <= kicked(speed, 0.1, True, share, 1.0) <= speed * (1 + 1e-15)
    assert kicked(speed, 0.1, True, 0.0, 1.0) == kicked(speed, 0.1, True, 1.0, 1.0) == 0.0
    assert kicked(speed, 0.1, False, share, 0.1) == 0.0


@settings(max_examples=30)
@given(st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=3, max_size=6, unique=True), st.booleans())
def test_stretches_follow_each_other_from_nothing_to_the_whole(points: list[tuple[float, float]], closed: bool) -> None:
    parts = segment_fractions((*points, points[0]) if closed else points)
    assert parts[0][0] == 0.0
    assert parts[-1][1] == pytest.approx(1.0, rel=1e-14)  # sums round
    assert all(a[1] == b[0] for a, b in pairwise(parts))
    assert len(parts) == len(points) - (not closed)


def test_share_at_is_held_between_the_ends_of_a_segment() -> None:
    assert fraction_at((0.0, 0.0), (2.0, 0.0), (0.5, 0.75), (1.0, 3.0)) == 0.625
    assert fraction_at((0.0, 0.0), (2.0, 0.0), (0.5, 0.75), (-1.0, 3.0)) == 0.5
    assert fraction_at((0.0, 0.0), (2.0, 0.0), (0.5, 0.75), (9.0, 3.0)) == 0.75


def test_springs_refuse_what_they_cannot_part_so() -> None:
    scene = falling(1.0, restitution=0.5, restitution_falloff=0.3, kick=BUMPER)
    with pytest.raises(Refusal, match=r"'penalty' does not model falloff.*'penalty' does not model kicks"):
        start(scene, "reference", scene.solver.replace(response="penalty"))
    plain = falling(1.0, restitution=0.5)
    simulation = start(plain, "reference", plain.solver.replace(response="penalty"))
    with pytest.raises(ActionError, match="does not support restitution_falloff"):
        simulation.apply(Spawn(time=0.0, ball=Ball(position=(0.5, 0.5), radius=R, restitution_falloff=0.1)))


def test_pairs_that_need_nothing_are_told_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    from sandbox.engines.pymunk_adapter.callbacks import PairCallbacks

    told: list[int] = []
    tell = PairCallbacks._set_coefficients
    monkeypatch.setattr(PairCallbacks, "_set_coefficients", lambda self, *rest: (told.append(1), tell(self, *rest))[1])
    after(falling(2.0, restitution=0.5, friction=0.2), "pymunk")
    assert not told
    after(falling(2.0, restitution=0.5, restitution_falloff=0.1), "pymunk")
    assert told


def test_account_books_kicks_as_a_cause_of_their_own() -> None:
    account = EnergyLedger()
    account.add(Cause.KICKS, 2.0)
    assert account.entries()[Cause.KICKS] == 2.0
    assert account.entries()[Cause.PHANTOM] == 0.0


@pytest.mark.parametrize("engine", ENGINES)
@settings(max_examples=10, deadline=None)
@given(x=st.floats(-0.2, 0.2), vx=st.floats(-2, 2), vy=st.floats(-2, 2), g=st.floats(0, 2))
def test_account_closes_in_a_box_that_kicks(engine: str, x: float, vx: float, vy: float, g: float) -> None:
    rubber = {"restitution": 0.8, "restitution_falloff": 0.3, "friction": 0.6}
    box = {"points": [[-0.3, 0.0], [0.3, 0.0], [0.3, 0.6], [-0.3, 0.6]], "closed": True, **rubber}
    post = {"position": [0.0, 0.45], "radius": 0.05, **rubber, "kick": BUMPER}
    scene = from_document(
        {
            "world": {"gravity": [0.0, -g]},
            "solver": {"dt": 0.002},
            "ball": [{**BALL, "position": [x, 0.2], "velocity": [vx, vy]}],
            "wall": [{**box, "kick": {"speed": 0.5, "threshold": 0.1, "profile": "middle"}}],
            "post": [post],
        }
    )
    simulation = start(scene, engine)
    simulation.account()
    before = total_energy(simulation)
    for _ in range(400):
        simulation.step()
    account = simulation.account()
    scale = sum(abs(energy) for energy in account.values()) + before + 1e-6
    assert total_energy(simulation) - before == pytest.approx(sum(account.values()), abs=1e-9 * scale)  # rounding
    assert account[Cause.KICKS] >= 0.0 >= account[Cause.RESTITUTION]
    # What hops on a post gives a little (exact); no law of a rebound gives anything by itself.
    assert account[Cause.PHANTOM] <= 1e-6 * scale


@pytest.mark.parametrize("engine", ENGINES)
def test_floors_refuse_what_kicks_even_where_no_file_was_checked(engine: str) -> None:
    post = Post(position=(1.0, 0.0), radius=0.1, kick=Kick(speed=1.0))
    scene = Scene(
        surface=Floor(sliding_friction=0.2), balls=(Ball(position=(0.0, 0.0), radius=0.03, mass=0.2),), posts=(post,)
    )
    with pytest.raises(Refusal, match=r"kicks on a floor|does not model"):
        start(scene, engine)
