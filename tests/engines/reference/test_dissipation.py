"""Dissipative impacts: they never create energy, and equal Newton's law where that creates none."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import sandbox
from sandbox.engines.energy_ledger import Cause
from sandbox.engines.reference.sequential_impulses import largest_fractions
from sandbox.measure.preflight import run_preflight
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests.accounts import ledger
from tests.engines.builders import make_scene

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

ROOM_PLANES = [
    {"point": [0, -2], "normal": [0, 1]},
    {"point": [0, 2], "normal": [0, -1]},
    {"point": [-2, 0], "normal": [1, 0]},
    {"point": [2, 0], "normal": [-1, 0]},
]


def thrown_bodies(seed: int, count: int, e: float, mu: float, **solver: object) -> Scene:
    """Return a scene of boxes and capsules thrown about a room without gravity."""
    random = np.random.default_rng(seed)
    bodies: dict[str, list[dict[str, object]]] = {"box": [], "capsule": []}
    for k in range(count):
        common = {
            "name": f"body {k}",
            "position": [-1.0 + 2.0 * (k % 2), -1.0 + 2.0 * (k // 2)],
            "angle": random.uniform(0, 6.28),
            "velocity": random.uniform(-5, 5, 2).tolist(),
            "angular_velocity": random.uniform(-20, 20),
            "restitution": e,
            "friction": mu,
        }
        shape = {"size": random.uniform(0.1, 0.8, 2).tolist()}
        if k % 3 == 2:
            shape = {"length": random.uniform(0.2, 0.6), "radius": random.uniform(0.05, 0.2)}
        bodies["capsule" if k % 3 == 2 else "box"].append({**common, **shape})
    planes = [{**plane, "restitution": 1.0, "friction": 1.0} for plane in ROOM_PLANES]
    return from_document(
        {"title": "", "world": {"duration": 1.0}, "solver": {"dt": 0.002, **solver}, "plane": planes, **bodies}
    )


def kinetic_energy(run: sandbox.Trajectory, scene: Scene) -> np.ndarray:
    mass, moment = scene.bodies.mass, scene.bodies.moment
    return np.asarray(0.5 * ((run.velocity**2).sum(axis=2) @ mass + run.angular_velocity**2 @ moment))


@given(st.integers(0, 10**6), st.integers(1, 4), st.floats(0, 1), st.floats(0, 2))
@example(seed=4, count=4, e=0.0, mu=1.0)  # the iterations without restitution end before convergence
@example(seed=4, count=2, e=0.0, mu=1.0)
@settings(max_examples=15)
def test_dissipative_impacts_never_create_energy(seed: int, count: int, e: float, mu: float) -> None:
    scene = thrown_bodies(seed, count, e, mu, impact="dissipative")
    for integrator, detection in (("explicit_euler", "discrete"), ("velocity_verlet", "bisect")):
        energy = kinetic_energy(
            sandbox.run(scene, engine="reference", integrator=integrator, detection=detection), scene
        )
        # rounding of some impacts a step, each 1e-13 of the energy that it exchanges
        assert (np.diff(energy) <= 1e-11 * energy[0]).all()


def test_newtons_law_creates_energy() -> None:
    """Control for the test above: the same bodies with Newton's law."""
    gains = []
    for seed in range(8):
        scene = thrown_bodies(seed, 2, 0.9, 0.8)
        energy = kinetic_energy(sandbox.run(scene, engine="reference"), scene)
        gains.append(float(np.diff(energy).max() / energy[0]))
    assert max(gains) > 0.01


@pytest.mark.parametrize("kind", ["frictionless", "balls"])
def test_both_laws_are_bit_identical_where_newtons_law_creates_no_energy(kind: str) -> None:
    if kind == "frictionless":
        scene = thrown_bodies(3, 4, 0.8, 0.0)
    else:
        ball = {"radius": 0.3, "restitution": 0.8, "friction": 0.6, "velocity": [2.0, 1.0]}
        balls = [{**ball, "position": [x, 0.0], "angular_velocity": 30.0 * x} for x in (-1.0, 0.0, 1.0)]
        planes = [{**plane, "friction": 1.0} for plane in ROOM_PLANES]
        scene = from_document({"title": "", "world": {"duration": 2.0}, "plane": planes, "ball": balls})
    runs = [sandbox.run(scene, engine="reference", impact=impact) for impact in ("newton", "dissipative")]
    for name in ("position", "velocity", "angular_velocity"):
        assert np.array_equal(getattr(runs[0], name), getattr(runs[1], name))


def test_ledger_books_energy_created_by_impacts_as_phantom() -> None:
    """A box is thrown onto rough ground: energy created by Newton's law is booked as phantom on both engines."""
    box = {"position": [0, 1], "size": [0.2447, 0.1003], "velocity": [-1.6, -5.0], "angular_velocity": -12.0}
    gains = []
    for angle in (1.2, 1.3, 1.36, 1.4, 1.5):
        scene = make_scene(
            title="",
            world={"gravity": [0.0, -9.81], "duration": 1.0},
            solver={"dt": 0.002},
            plane=[{"point": [0, 0], "normal": [0, 1], "restitution": 0.99, "friction": 1.2}],
            box=[{**box, "angle": angle}],
        )
        ledgers = [
            ledger(scene, "pymunk"),
            ledger(scene, "reference"),
            ledger(scene, "reference", impact="dissipative"),
        ]
        assert all(each.closes_to < 1e-9 for each in ledgers)  # rounding of the works of 500 substeps
        gains.append([each.of(Cause.PHANTOM) / each.total[0] for each in ledgers])
    pymunk, newton, dissipative = np.array(gains).T
    assert pymunk.max() > 0.05 and newton.max() > 0.05
    assert dissipative.max() < 1e-12  # rounding


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_preflight_warns_of_energy_created_by_impacts(engine: str) -> None:
    box = {"position": [0, 1], "size": [0.2447, 0.1003], "velocity": [-1.6, -5.0], "angular_velocity": -12.3}
    scene = make_scene(
        title="",
        world={"gravity": [0.0, -9.81], "duration": 1.0},
        solver={"dt": 0.002},
        plane=[{"point": [0, 0], "normal": [0, 1], "restitution": 0.99, "friction": 1.2}],
        box=[{**box, "angle": 1.36}],
    )
    (warning,) = [each for each in run_preflight(scene, engine=engine).warnings if each.kind == "energy"]
    assert "dissipative" in warning.message
    dissipative = scene.solver.replace(impact="dissipative")
    assert not [each for each in run_preflight(scene, dissipative, "reference").warnings if each.kind == "energy"]


def test_largest_fraction_is_where_the_work_reaches_zero() -> None:
    work, slope, curve = (
        np.array([-1.0, -1.0, -2.0, 0.5, 0.0]),
        np.array([0.0, 3.0, 0.5, 1.0, 0.0]),
        np.array([4.0, 0, 0.5, 0, 0]),
    )
    assert largest_fractions(work, slope, curve) == pytest.approx([0.5, 1 / 3, 1.0, 0.0, 1.0])


@pytest.mark.parametrize("engine", ["pymunk", "exact"])
def test_other_engines_refuse_dissipative_impacts(engine: str) -> None:
    run = sandbox.run(thrown_bodies(0, 1, 0.5, 0.5), engine=engine, impact="dissipative")
    assert run.status == "refused"
