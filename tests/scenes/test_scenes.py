"""Shipped scenes: every scene can be read, and its run agrees with its description."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from sandbox.engines.registry import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import dumps, load, loads
from sandbox.scene.files.shipped_scenes import SCHEMA, ShippedScene, find, shipped
from sandbox.trajectory import Contacts, Frame
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

SCENES = shipped()
G = 9.81


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
def test_scene_file_is_complete(shipped_scene: ShippedScene) -> None:
    """It has a title, a description of one line, the line of its schema, a duration and a step; its run fits."""
    text = shipped_scene.path.read_text(encoding="utf-8")
    scene, document, (first, _) = load(shipped_scene.path), tomllib.loads(text), text.split("\n", 1)
    assert 0 < len(scene.title) <= 40
    assert 40 <= len(scene.about) <= 120
    assert scene.about.isprintable() and scene.about.endswith(".")
    keyword, _, target = first.partition(" ")
    assert keyword == "#:schema"
    assert (shipped_scene.path.parent / target).resolve() == shipped_scene.path.parents[1] / SCHEMA
    assert loads(dumps(scene)) == scene
    assert "duration" in document["world"] and "dt" in document["solver"]
    frames = math.ceil(scene.world.duration / scene.solver.dt / scene.solver.record_every) + 1
    assert frames * len(scene.bodies) * 6 * 8 < 300e6


def test_stems_of_scenes_are_unique() -> None:
    stems = [scene.path.stem for scene in SCENES]
    assert len(set(stems)) == len(stems)


def test_every_scene_file_ships() -> None:
    root = Path(__file__).resolve().parents[2] / "scenes"
    assert {scene.path for scene in SCENES} == set(root.rglob("*.toml"))


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


@pytest.mark.parametrize(
    ("height", "touches"),
    [(2.0, False), (1.001, False), (1.0, False), (0.999, True), (0.009, True), (0.0, True), (-1.0, True)],
)
def test_circle_touches_the_half_plane_if_lower_than_its_radius(height: float, touches: bool) -> None:
    _, contacts = run(scene_of("circle_half_plane", f"ball.circle.position=[0.0, {height}]"), until=0.01)
    assert any(map(len, contacts)) is touches


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_stone_tears_the_weak_cloth_and_not_the_strong_one(engine: str) -> None:
    broken = []
    for overrides in ((), ("cloth.sheet.strength=20",)):
        scene = scene_of("tearing_cloth", *overrides)
        simulation = start(scene, engine, scene.solver)
        advance(simulation, 72)  # 0.6 s: the stone is deep in the cloth
        broken.append(len(simulation.broken))
        simulation.close()
    assert broken[0] > 20  # about a column of threads per row torn
    assert broken[1] == 0


def test_pile_starts_without_overlap_inside_its_box() -> None:
    bodies = scene_of("pile").bodies
    assert len(bodies) == 1000
    x, y = bodies.position.T
    assert 0.05 <= x.min() < x.max() <= 2.75
    assert y.min() >= 0.05
    distance = np.hypot(x[:, None] - x, y[:, None] - y)
    np.fill_diagonal(distance, np.inf)
    assert distance.min() > 0.1


@pytest.mark.nightly
def test_contact_force_on_the_box_is_the_weight_of_the_settled_pile() -> None:
    scene = scene_of("pile")
    frames, contacts = run(scene)
    last = contacts[-60:]
    force = sum(-each.impulse[each.pair[:, 1] < 0, 1].sum() for each in last) / (60 * scene.solver.dt)
    assert force == pytest.approx(981.0, rel=0.01)  # the pile still creeps, so its momentum changes slightly
    assert frames[-1].position[:, 1].max() == pytest.approx(3.4, abs=0.15)  # depends on which balls settle on top
    assert energy(scene, frames[-1]) < 1e-3 * 1000 * 0.1 * G * 0.6  # of the energy released by falling about 0.6 m
