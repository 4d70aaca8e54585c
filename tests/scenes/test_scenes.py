"""Shipped scenes: every scene can be read, and its run agrees with its description."""

import math
import tomllib
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from sandbox.engines.registry import start
from sandbox.scene.compile.demands import Demand, demands
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import dumps, load, loads
from sandbox.scene.files.shipped_scenes import SCHEMA, ShippedScene, find, shipped
from sandbox.trajectory import Contacts, Frame

pytestmark = pytest.mark.full  # long runs and sweeps

SCENES = shipped()
G = 9.81

FREE_FALL = {Demand.TRANSLATION, Demand.GRAVITY}
COLLISIONS = {Demand.TRANSLATION, Demand.BALL_BALL, Demand.RESTITUTION}
BOX = {*FREE_FALL, Demand.POLYGONS, Demand.FRICTION, Demand.ROTATION}
PENDULUM = {*FREE_FALL, Demand.RODS}
ROLLING = {*COLLISIONS, Demand.SURFACE, Demand.SPIN}
ICE = {*COLLISIONS, Demand.SURFACE, Demand.PUCKS, Demand.CURL, Demand.FRICTION, Demand.ROTATION}
CAROM = {*ROLLING, Demand.BALL_SEGMENT, Demand.FRICTION, Demand.ROTATION}
POCKETED = {*CAROM, Demand.BALL_POST, Demand.POCKETS}
PINBALL = {
    *FREE_FALL,
    Demand.BALL_SEGMENT,
    Demand.BALL_POST,
    Demand.POLYGONS,
    Demand.RESTITUTION,
    Demand.FALLOFF,
    Demand.FRICTION,
    Demand.ROTATION,
    Demand.KICKS,
    Demand.ONE_WAY,
    Demand.ZONES,
    Demand.DRIVES,
}
DEMANDED = {
    "artillery/duel": {*BOX, Demand.DRAG},
    "artillery/four": {*BOX, Demand.DRAG},
    "benchmark/bounce_to_rest": {*FREE_FALL, Demand.BALL_PLANE, Demand.RESTITUTION},
    "benchmark/box_slides": BOX,
    "benchmark/box_sticks": BOX,
    "benchmark/break_shot": COLLISIONS,
    "benchmark/chain_of_20": PENDULUM,
    "benchmark/double_pendulum": PENDULUM,
    "benchmark/elastic_ball": {*FREE_FALL, Demand.BALL_PLANE, Demand.RESTITUTION},
    "benchmark/heavy_on_light": BOX,
    "benchmark/kepler": {Demand.TRANSLATION, Demand.ATTRACTION},
    "benchmark/oblique": COLLISIONS,
    "benchmark/pendulum_170": PENDULUM,
    "benchmark/pendulum_5": PENDULUM,
    "benchmark/pendulum_90": PENDULUM,
    "benchmark/projectile": FREE_FALL,
    "benchmark/rest_depth": {*FREE_FALL, Demand.BALL_PLANE, Demand.FRICTION, Demand.ROTATION},
    "benchmark/slide_to_roll": {*FREE_FALL, Demand.BALL_PLANE, Demand.FRICTION, Demand.ROTATION},
    "benchmark/slide_to_stop": BOX,
    "benchmark/spring": {Demand.TRANSLATION, Demand.SPRINGS},
    "benchmark/stiff_spring": {Demand.TRANSLATION, Demand.SPRINGS},
    "benchmark/stiff_spring_beyond": {Demand.TRANSLATION, Demand.SPRINGS},
    "tutorial/spaceship": {
        Demand.TRANSLATION,
        Demand.ROTATION,
        Demand.POLYGONS,
        Demand.RESTITUTION,
        Demand.FRICTION,
        Demand.THRUST,
        Demand.BOUNDS,
    },
    "benchmark/bullet": {Demand.TRANSLATION, Demand.BALL_SEGMENT, Demand.RESTITUTION},
    "benchmark/gas": {*COLLISIONS, Demand.BALL_PLANE},
    "benchmark/incline": {*FREE_FALL, Demand.BALL_PLANE, Demand.FRICTION, Demand.ROTATION},
    "benchmark/newtons_cradle": COLLISIONS,
    "benchmark/pile": {*FREE_FALL, *COLLISIONS, Demand.BALL_PLANE, Demand.FRICTION, Demand.ROTATION},
    "benchmark/two_balls": COLLISIONS,
    "benchmark/pyramid": {*FREE_FALL, Demand.POLYGONS, Demand.FRICTION, Demand.ROTATION},
    "benchmark/far_pyramid": {*FREE_FALL, Demand.POLYGONS, Demand.FRICTION, Demand.ROTATION},
    "benchmark/tower": {*FREE_FALL, Demand.POLYGONS, Demand.FRICTION, Demand.ROTATION},
    "billiards/8-ball": POCKETED,
    "billiards/9-ball": POCKETED,
    "billiards/bank": CAROM,
    "billiards/half_ball": ROLLING,
    "billiards/snooker": POCKETED,
    "billiards/straight-rail": CAROM,
    "billiards/stun_draw_follow": ROLLING,
    "billiards/three-cushion": CAROM,
    "billiards/throw": {*ROLLING, Demand.ROTATION},
    "games/curling": ICE,
    "games/rube_goldberg": {
        *FREE_FALL,
        *COLLISIONS,
        Demand.BALL_PLANE,
        Demand.BALL_SEGMENT,
        Demand.FRICTION,
        Demand.GEARS,
        Demand.PIVOTS,
        Demand.POLYGONS,
        Demand.RODS,
        Demand.ROTARY_LIMITS,
        Demand.ROTATION,
    },
    "games/landing": {
        Demand.TRANSLATION,
        Demand.ROTATION,
        Demand.GRAVITY,
        Demand.POLYGONS,
        Demand.RESTITUTION,
        Demand.FRICTION,
        Demand.THRUST,
        Demand.BOUNDS,
    },
    "joints/flipper": {
        *FREE_FALL,
        Demand.ROTATION,
        Demand.BALL_SEGMENT,
        Demand.BALL_POST,
        Demand.RESTITUTION,
        Demand.FRICTION,
        Demand.POLYGONS,
        Demand.FALLOFF,
        Demand.KICKS,
        Demand.DRIVES,
    },
    "joints/bridge": {
        *FREE_FALL,
        Demand.BALL_SEGMENT,
        Demand.FRICTION,
        Demand.PIVOTS,
        Demand.POLYGONS,
        Demand.ROTATION,
    },
    "joints/cloth": {*FREE_FALL, Demand.DRAG, Demand.SPRINGS},
    "joints/hanging_chain": {*FREE_FALL, Demand.DRAG, Demand.RODS},
    "joints/ragdoll_stairs": {
        *FREE_FALL,
        Demand.BALL_PLANE,
        Demand.BALL_SEGMENT,
        Demand.FRICTION,
        Demand.PIVOTS,
        Demand.POLYGONS,
        Demand.ROTARY_LIMITS,
        Demand.ROTATION,
    },
    "benchmark/restitution_row": {*FREE_FALL, Demand.BALL_PLANE, Demand.RESTITUTION},
    "benchmark/friction_ramp": BOX,
    "joints/atwood": {*FREE_FALL, Demand.PULLEYS},
    "joints/slider_crank": {
        Demand.TRANSLATION,
        Demand.ROTATION,
        Demand.RODS,
        Demand.PIVOTS,
        Demand.MOTORS,
        Demand.GROOVES,
    },
    "games/conveyor": {
        *FREE_FALL,
        Demand.ROTATION,
        Demand.BALL_BALL,
        Demand.BALL_PLANE,
        Demand.BALL_SEGMENT,
        Demand.BALL_POST,
        Demand.POLYGONS,
        Demand.FRICTION,
        Demand.SURFACE_SPEED,
        Demand.BOUNDS,
    },
    "joints/tearing_cloth": {*FREE_FALL, Demand.BALL_BALL, Demand.BALL_SEGMENT, Demand.SPRINGS},
    "particles/fireworks_100k": {*FREE_FALL, Demand.LIFETIMES},
    "particles/smoke": {*FREE_FALL, Demand.DRAG, Demand.LIFETIMES},
    "particles/sparks": {
        *FREE_FALL,
        Demand.DRAG,
        Demand.BALL_PLANE,
        Demand.RESTITUTION,
        Demand.FRICTION,
        Demand.ROTATION,
        Demand.LIFETIMES,
    },
    "pinball/classic": PINBALL,
    "pinball/full": {*PINBALL, Demand.BALL_BALL, Demand.LAYERS},
    "tutorial/ball": FREE_FALL,
    "tutorial/bounce": {*FREE_FALL, Demand.BALL_PLANE, Demand.RESTITUTION},
    "tutorial/circle_half_plane": {Demand.TRANSLATION, Demand.BALL_PLANE},
    "tutorial/fast_ball": {Demand.TRANSLATION, Demand.BALL_PLANE, Demand.RESTITUTION},
    "tutorial/fireworks": FREE_FALL,
    "tutorial/overpass": {
        Demand.TRANSLATION,
        Demand.BALL_BALL,
        Demand.BALL_SEGMENT,
        Demand.RESTITUTION,
        Demand.LAYERS,
        Demand.ZONES,
    },
}

every_scene = pytest.mark.parametrize("shipped_scene", SCENES, ids=[scene.name for scene in SCENES])


def run(scene: Scene, until: float | None = None) -> tuple[list[Frame], list[Contacts]]:
    """Step a scene on pymunk; return its frames and the contacts of each step."""
    simulation = start(scene, "pymunk", scene.solver)
    try:
        frames, contacts = [simulation.frame()], [simulation.contacts()]
        for _ in range(round((scene.world.duration if until is None else until) / scene.solver.dt)):
            simulation.step()
            frames.append(simulation.frame())
            contacts.append(simulation.contacts())
        return frames, contacts
    finally:
        simulation.close()


def scene_of(name: str, *overrides: str) -> Scene:
    return load(find(name), overrides)


def energy(scene: Scene, frame: Frame) -> float:
    return float(0.5 * scene.bodies.mass @ (frame.velocity**2).sum(axis=1))


@every_scene
def test_scene_has_a_title_and_a_description_of_one_line(shipped_scene: ShippedScene) -> None:
    scene = load(shipped_scene.path)
    assert 0 < len(scene.title) <= 40
    assert 40 <= len(scene.about) <= 120
    assert scene.about.isprintable()
    assert scene.about.endswith(".")


@every_scene
def test_first_line_of_a_scene_refers_to_the_schema(shipped_scene: ShippedScene) -> None:
    first, _ = shipped_scene.path.read_text(encoding="utf-8").split("\n", 1)
    keyword, _, target = first.partition(" ")
    assert keyword == "#:schema"
    assert (shipped_scene.path.parent / target).resolve() == shipped_scene.path.parents[1] / SCHEMA


@every_scene
def test_scene_round_trips(shipped_scene: ShippedScene) -> None:
    scene = load(shipped_scene.path)
    assert loads(dumps(scene)) == scene


@every_scene
def test_scene_has_exactly_the_expected_demands(shipped_scene: ShippedScene) -> None:
    assert demands(load(shipped_scene.path)) == DEMANDED[shipped_scene.name]


@every_scene
def test_scene_file_has_a_duration_and_a_step(shipped_scene: ShippedScene) -> None:
    document = tomllib.loads(shipped_scene.path.read_text(encoding="utf-8"))
    assert {"duration"} <= set(document["world"])
    assert {"dt"} <= set(document["solver"])


@every_scene
def test_run_of_a_scene_takes_less_than_300_megabytes(shipped_scene: ShippedScene) -> None:
    scene = load(shipped_scene.path)
    frames = math.ceil(scene.world.duration / scene.solver.dt / scene.solver.record_every) + 1
    assert frames * len(scene.bodies) * 6 * 8 < 300e6


def test_stems_of_scenes_are_unique() -> None:
    stems = [scene.path.stem for scene in SCENES]
    assert len(set(stems)) == len(stems)


def test_every_scene_file_ships() -> None:
    root = Path(__file__).resolve().parents[2] / "scenes"
    assert {scene.path for scene in SCENES} == set(root.rglob("*.toml"))
    assert {scene.name for scene in SCENES} == set(DEMANDED)


def test_ball_ends_at_the_position_of_explicit_euler() -> None:
    scene = scene_of("ball")
    frames, _ = run(scene)
    assert frames[-1].position[0, 1] == pytest.approx(5.14405, abs=1e-12)  # 100 roundings of about 1e-15
    exact, _ = run(scene_of("ball", "solver.half_kick=true"))
    assert exact[-1].position[0, 1] == pytest.approx(5.095, abs=1e-12)  # 100 roundings of about 1e-15


def test_overpass_is_crossed_only_by_the_fast_ball() -> None:
    scene = scene_of("overpass")
    frames, _ = run(scene, 1.7)
    x, v = (np.asarray([getattr(frame, key)[:2, 0] for frame in frames]) for key in ("position", "velocity"))
    h, g = scene.solver.h, 3.0
    on_bridge, behind = (v[np.flatnonzero(x[:, 0] > edge)[0], 0] for edge in (0.0, 1.15))
    assert on_bridge == pytest.approx(math.sqrt(9.0 - 2 * g * 0.8), abs=2 * g * h)  # one substep at each edge
    assert behind == pytest.approx(3.0, abs=4 * g * h)
    assert frames[-1].position[0].tolist() == [2.2, 0.0]
    # Explicit Euler is g·h·t/2 too far after t = 2/3 s, and gravity starts up to h late, which adds v·h.
    assert x[:, 1].max() == pytest.approx(-1.1 + 4.0 / (2 * g), abs=g * h * (2 / 3) / 2 + 2.0 * h)
    assert [frame.layer[1] for frame in frames][-1] == scene.layers.index("ramp")


def test_bounce_reaches_the_expected_peaks() -> None:
    frames, _ = run(scene_of("bounce"))
    height = np.array([frame.position[0, 1] for frame in frames]) - 0.5
    top = (height[1:-1] > height[:-2]) & (height[1:-1] >= height[2:])
    expected = [3.2, 2.048, 1.31072]
    # impact is found up to v·dt = 1 cm late; each of up to three bounces adds as much, scaled by e² or less
    assert height[1:-1][top][:3] == pytest.approx(expected, abs=0.03)


@pytest.mark.parametrize("name", ["fireworks", "fireworks_100k"])
def test_fireworks_stay_within_the_bounds_of_their_velocities(name: str) -> None:
    scene = scene_of(name, "solver.dt=0.1")
    (emitter,) = scene.emitters
    (left, slow), (right, fast) = emitter.velocity_min, emitter.velocity_max
    frames, _ = run(scene)
    alive = [frame for frame in frames if frame.present.any()]
    assert alive[-1].time >= 2.0 - 1e-9  # rounding of 20 sums
    for frame in alive[1:]:
        t = frame.time
        x, y = frame.position[frame.present].T
        fall = -0.5 * G * t**2 + 0.5 * G * scene.solver.dt * t  # of explicit Euler
        tolerance = 1e-9  # rounding of 30 sums of about 100 m
        assert left * t - tolerance <= x.min() < x.max() <= right * t + tolerance
        assert slow * t + fall - tolerance <= y.min() < y.max() <= fast * t + fall + tolerance
    ranges = {"fireworks": (2.0, 4.0), "fireworks_100k": (40.0, 30.0)}
    assert (right - left, fast - slow) == ranges[name]


def test_lifetimes_of_the_large_firework_are_uniform_from_2_to_3_seconds() -> None:
    scene = scene_of("fireworks_100k", "solver.dt=0.1")
    frames, _ = run(scene)
    counts = [int(frame.present.sum()) for frame in frames]
    assert counts[:20] == [100_000] * 20
    assert counts[30] == 0
    assert counts[20:30] == pytest.approx(np.linspace(1e5, 1e4, 10), abs=4 * 159)  # 4 standard deviations of a binomial


def test_smoke_reaches_the_terminal_velocity_in_its_description() -> None:
    frames, _ = run(scene_of("smoke"), until=4.8)
    last = frames[-1]
    assert 0 < last.present.sum() < 1000
    slow = 0.5 * (math.sqrt(5.8) - 1.0)
    # Differences decay at 1 + |u| > 1.7 /s: 16 m/s · e^(−1.7·4.8) = 5e-3 m/s is left.
    assert last.velocity[last.present] == pytest.approx(np.tile([1.0, slow], (last.present.sum(), 1)), abs=5e-3)


def test_sparks_bounce_on_the_floor_and_not_on_each_other() -> None:
    scene = scene_of("sparks")
    frames, contacts = run(scene)
    assert all((each.pair[:, 1] < 0).all() for each in contacts)
    assert sum(map(len, contacts)) > 600
    for frame in frames:
        x, y = frame.position[frame.present].T
        # A contact is detected at the end of a step: up to v·dt deep, at 11 m/s less than 12 cm.
        assert not len(x) or (x.max() <= 5.0 + 0.12 and y.min() >= -0.12)
    assert frames[0].present.all()
    assert not frames[-1].present.any()


def test_velocities_of_the_large_firework_are_uniform() -> None:
    counts, _ = np.histogram(scene_of("fireworks_100k").bodies.velocity[:, 0], 10, (-20.0, 20.0))
    assert counts.sum() == 100_000
    assert np.abs(counts - 10_000).max() < 4 * 95  # 4 standard deviations of a binomial


@pytest.mark.parametrize(
    ("height", "touches"),
    [(2.0, False), (1.001, False), (1.0, False), (0.999, True), (0.009, True), (0.0, True), (-1.0, True)],
)
def test_circle_touches_the_half_plane_if_lower_than_its_radius(height: float, touches: bool) -> None:
    _, contacts = run(scene_of("circle_half_plane", f"ball.circle.position=[0.0, {height}]"), until=0.01)
    assert any(map(len, contacts)) is touches


def test_fast_ball_penetrates_the_plane_in_one_step() -> None:
    scene = scene_of("fast_ball")
    ball, plane = scene.balls[0], scene.planes[0]
    gap = ball.position[1] - ball.radius - plane.point[1]
    assert gap / -ball.velocity[1] == pytest.approx(0.045, rel=1e-15)
    frames, contacts = run(scene)
    assert frames[1].position[0, 1] - ball.radius == pytest.approx(-5.5, abs=1e-12)  # rounding
    assert len(contacts[1]) == 1
    assert frames[-1].velocity[0, 1] == pytest.approx(100.0, rel=1e-12)  # e = 1, to rounding


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_stone_tears_the_weak_cloth_and_not_the_strong_one(engine: str) -> None:
    broken = []
    for overrides in ((), ("cloth.sheet.strength=20",)):
        scene = scene_of("tearing_cloth", *overrides)
        simulation = start(scene, engine, scene.solver)
        for _ in range(72):  # 0.6 s: the stone is deep in the cloth
            simulation.step()
        broken.append(len(simulation.broken))
        simulation.close()
    assert broken[0] > 20  # about a column of threads per row torn
    assert broken[1] == 0


def test_two_balls_separate_at_half_the_approach_speed() -> None:
    scene = scene_of("two_balls")
    frames, contacts = run(scene)
    assert frames[-1].velocity == pytest.approx(np.array([[2.5, 0.0], [4.5, 0.0]]), abs=1e-12)  # rounding
    assert energy(scene, frames[0]) - energy(scene, frames[-1]) == pytest.approx(4.5, abs=1e-11)  # rounding
    first = min(contact.time for each in contacts for contact in each)
    assert 0 <= first - 0.375 <= scene.solver.dt + 1e-12  # detected at the end of its step, plus rounding


def test_cradle_transfers_the_velocity_to_the_last_ball() -> None:
    scene = scene_of("newtons_cradle")
    assert all(b.position[0] - a.position[0] > 0.1 for a, b in pairwise(scene.balls))
    frames, _ = run(scene)
    # a single contact is solved exactly; 1e-9 is the remainder of iterating over several in a step
    assert frames[-1].velocity[:, 0] == pytest.approx([0.0, 0.0, 0.0, 0.0, 1.0], abs=1e-9)
    late = 1.1 - frames[-1].position[4, 0]
    assert 0 < late < 5 * scene.solver.dt  # one step for each of the four impacts, and one more for the first


def test_disc_rolls_down_at_two_thirds_of_the_sliding_acceleration() -> None:
    frames, _ = run(scene_of("incline"))
    last = frames[-1]
    assert np.hypot(*last.velocity[0]) == pytest.approx(6.54, rel=1e-3)  # one or two of 2,000 steps to settle
    assert last.angular_velocity[0] == pytest.approx(-13.08, rel=1e-3)  # same reason
    assert np.hypot(*(last.position[0] - frames[0].position[0])) == pytest.approx(6.54, rel=2e-3)  # same reason


def test_disc_slips_with_low_friction() -> None:
    frames, _ = run(scene_of("incline", "plane.slope.friction=0.1"))
    a = G * (0.5 - 0.1 * math.sqrt(0.75))
    assert np.hypot(*frames[-1].velocity[0]) / 2.0 == pytest.approx(a, rel=1e-3)  # one or two steps to settle
    assert a == pytest.approx(4.055, abs=5e-4)  # to the digits given in the file


def test_bullet_misses_the_wall_with_the_probability_in_its_description() -> None:
    scene = scene_of("bullet")
    frames, contacts = run(scene)
    assert not any(map(len, contacts))
    assert frames[-1].velocity[0].tolist() == [100.0, 0.0]
    starts = np.linspace(0.0, 0.1, 40, endpoint=False) + 0.00125
    ends = [run(scene_of("bullet", f"ball.bullet.position=[{x}, 0.0]"))[0][-1] for x in starts]
    missed = np.mean([end.position[0, 0] > 1.0 for end in ends])
    assert missed == pytest.approx(0.8, abs=1 / 40)  # resolution of 40 starting points


def test_bullet_hits_the_wall_at_the_safe_step_of_its_description() -> None:
    for x in np.linspace(0.05, 0.07, 9):
        frames, _ = run(scene_of("bullet", "solver.dt=0.0002", f"ball.bullet.position=[{x}, 0.0]"))
        assert frames[-1].velocity[0, 0] == pytest.approx(-50.0, rel=1e-12)  # e = 0.5, to rounding


def test_pile_starts_without_overlap_inside_its_box() -> None:
    bodies = scene_of("pile").bodies
    assert len(bodies) == 1000
    x, y = bodies.position.T
    assert 0.05 <= x.min() < x.max() <= 2.75
    assert y.min() >= 0.05
    distance = np.hypot(x[:, None] - x, y[:, None] - y)
    np.fill_diagonal(distance, np.inf)
    assert distance.min() > 0.1


@pytest.mark.slow
def test_contact_force_on_the_box_is_the_weight_of_the_settled_pile() -> None:
    scene = scene_of("pile")
    frames, contacts = run(scene)
    last = contacts[-60:]
    force = sum(-each.impulse[each.pair[:, 1] < 0, 1].sum() for each in last) / (60 * scene.solver.dt)
    assert force == pytest.approx(981.0, rel=0.01)  # the pile still creeps, so its momentum changes slightly
    assert frames[-1].position[:, 1].max() == pytest.approx(3.4, abs=0.15)  # depends on which balls settle on top
    assert energy(scene, frames[-1]) < 1e-3 * 1000 * 0.1 * G * 0.6  # of the energy released by falling about 0.6 m


def test_gas_conserves_energy_and_relaxes_to_the_maxwell_distribution() -> None:
    scene = scene_of("gas")
    frames, _ = run(scene)
    assert energy(scene, frames[0]) == pytest.approx(78.54, abs=0.005)  # to the digits given in the file
    # contacts of three balls are iterated, not solved exactly: a loss of 3e-5 was measured in 20 s
    assert energy(scene, frames[-1]) == pytest.approx(energy(scene, frames[0]), rel=1e-3)
    speeds = [np.hypot(*frame.velocity.T) for frame in frames]
    ratio = [speed.mean() ** 2 / (speed**2).mean() for speed in speeds]
    assert ratio[0] == pytest.approx(0.896, abs=5e-4)  # to the digits given in the file
    # 0.012 is the deviation at one time; the mean over 15 s is of more than ten independent times
    assert np.mean(ratio[1000:]) == pytest.approx(math.pi / 4, abs=0.012)
    assert all(not frame.angular_velocity.any() for frame in frames)
