"""Ensembles: the same results as single runs, whatever computes them; starts of the stated distribution."""

import math
from dataclasses import replace
from threading import Event, Thread

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sandbox
from sandbox.engines.common.kernel import COMPILED
from sandbox.engines.reference.compiled_stepper import OPTIONAL_KERNELS
from sandbox.measure.run.ensemble import FIELDS, varied_starts
from sandbox.resource_limits import TooLargeError
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.files.load import loads

BOX = (
    "[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\n[[plane]]\npoint = [-1, 0]\nnormal = [1, 0]\n"
    "[[plane]]\npoint = [1, 0]\nnormal = [-1, 0]\n[[wall]]\npoints = [[-0.8, 0.5], [-0.2, 0.3]]\nthickness = 0.02\n"
    "[[post]]\nposition = [0.5, 0.4]\nradius = 0.05\n"
)
GAS = (
    "[world]\ngravity = [0, -5]\nduration = 1.0\nseed = 7\n[solver]\ndt = 0.01\n" + BOX + "[[grid]]\nname = 'atom'\n"
    "radius = 0.05\norigin = [-0.8, 0.8]\ncolumns = 4\nrows = 2\nspacing = [0.4, 0.3]\nvelocity_jitter = 1.0\n"
    "restitution = 0.9\nfriction = 0.2\n[[ball]]\nname = 'anchor'\nposition = [0.0, 2.0]\nradius = 0.1\nfixed = true\n"
)
BOXES = (
    "[world]\ngravity = [0, -5]\nduration = 0.6\nlinear_drag = 0.1\n[solver]\ndt = 0.01\n" + BOX + "[[box]]\n"
    "name = 'ship'\nposition = [0, 0.5]\nsize = [0.3, 0.2]\n[[box]]\nposition = [0.1, 1.2]\nsize = [0.2, 0.2]\n"
    "[[capsule]]\nposition = [-0.4, 0.6]\nlength = 0.3\nradius = 0.05\n"
    "[[thrust]]\nbody = 'ship'\nforce = [0.1, 0.2]\npoint = [0.0, -0.1]\nend = 0.3\n"
)
PENDULUM = (
    "[world]\ngravity = [0, -9.81]\nduration = 0.5\n[[ball]]\nname = 'bob'\nposition = [1, 0]\nradius = 0.1\n"
    "[[joint]]\nkind = 'rod'\nbetween = ['bob']\n"
)
SPRING = PENDULUM.replace("kind = 'rod'", "kind = 'spring'\nstiffness = 50")


@pytest.fixture(autouse=True)
def _compiled_steps() -> None:
    for kernel in OPTIONAL_KERNELS:
        kernel.spent = math.inf


def single_run(scene: Scene, engine: str, seed: int, vary: dict[str, float], m: int, **changes: object):
    """Return an ordinary run from the m-th start."""
    setup, starts = Setup.of(scene), varied_starts(scene, m + 1, vary, seed)
    columns = {name: getattr(starts, name)[m] for name in FIELDS}
    varied = replace(setup, bodies=replace(setup.bodies, **columns))
    return sandbox.run(varied, engine, audit=False, **changes)


VARY = {"ball.*.velocity": 0.5, "grid.atom.position": 0.01, "ball.*.angular_velocity": 0.3}
TURN = {"*.*.velocity": 0.5, "*.*.angle": 0.2, "*.*.angular_velocity": 1.0}


@pytest.mark.parametrize(
    ("engine", "text", "vary"),
    [("exact", GAS, VARY), ("reference", GAS, VARY), ("pymunk", GAS, VARY), ("reference", BOXES, TURN),
     ("reference", PENDULUM, TURN)],
    ids=["exact", "reference", "pymunk", "boxes", "pendulum"],
)  # fmt: skip
@settings(max_examples=5)
@given(seed=st.integers(0, 2**40), duration=st.sampled_from([0.005, 0.3, 0.7351]))
def test_every_run_is_an_ordinary_run(engine, text, vary, seed, duration):
    scene = loads(text)
    scene = scene.model_copy(update={"world": scene.world.model_copy(update={"duration": duration})})
    found = sandbox.ensemble(scene, 4, vary=vary, engine=engine, seed=seed)
    assert vary is VARY or duration != 0.3 or found.compiled.all() == COMPILED  # of whole steps
    for m in range(4):
        expected = single_run(scene, engine, seed, vary, m)
        assert found.status[m] == expected.status
        if expected.status == "ok":
            for name in FIELDS:
                assert getattr(found, name)[m].tobytes() == getattr(expected, name)[-1].tobytes(), name
        else:
            assert np.isnan(found.position[m]).all()


@pytest.mark.parametrize("engine", ["exact", "reference"])
def test_runs_of_balls_are_computed_by_compiled_code(engine: str) -> None:
    found = sandbox.ensemble(loads(GAS), 8, vary={"ball.*.velocity": 0.1}, engine=engine)
    assert found.compiled.all() == (COMPILED or engine == "exact")
    assert (found.status == "ok").all()
    assert not sandbox.ensemble(loads(SPRING), 2, vary={"*.*.velocity": 0.1}, engine="reference").compiled.any()


@pytest.mark.parametrize("engine", ["exact", "reference", "pymunk"])
def test_neither_threads_nor_the_number_of_runs_change_a_digit(engine: str) -> None:
    scene, vary = loads(GAS), {"ball.*.velocity": 0.3}
    one = sandbox.ensemble(scene, 9, vary=vary, engine=engine)
    three = sandbox.ensemble(scene, 9, vary=vary, engine=engine, threads=3)
    fewer = sandbox.ensemble(scene, 4, vary=vary, engine=engine, threads=2)
    assert one.position.tobytes() == three.position.tobytes()
    assert one.position[:4].tobytes() == fewer.position.tobytes()
    other = sandbox.ensemble(scene, 9, vary=vary, engine=engine, seed=8)
    assert (one.start_velocity != other.start_velocity).any()


def test_frames_and_contacts_are_those_of_the_runs() -> None:
    scene, vary = loads(GAS), {"ball.*.velocity": 0.2}
    with_frames = sandbox.ensemble(scene, 3, vary=vary, engine="reference", keep="frames")
    with_contacts = sandbox.ensemble(scene, 3, vary=vary, engine="reference", keep="contacts")
    for m in range(3):
        expected = single_run(scene, "reference", 7, vary, m)
        assert with_frames.frames[m].tobytes() == expected.position.tobytes()
        of_run = with_contacts.contact_run == m
        assert with_contacts.contact_time[of_run].tobytes() == expected.contact_time.tobytes()
        assert with_contacts.contact_pair[of_run].tobytes() == expected.contact_pair.tobytes()
        assert with_contacts.contact_impulse[of_run].tobytes() == expected.contact_impulse.tobytes()
    assert with_frames.time.tolist() == expected.time.tolist()


def test_starts_are_normally_distributed_and_independent() -> None:
    starts = varied_starts(loads(GAS), 3000, {"ball.*.velocity": 0.5, "ball.*.position": 0.1}, seed=3)
    own = loads(GAS).bodies
    moves = ~own.fixed
    deviation = (starts.velocity - own.velocity)[:, moves] / 0.5
    shift = (starts.position - own.position)[:, moves] / 0.1
    values = np.concatenate((deviation.reshape(3000, -1), shift.reshape(3000, -1)), axis=1)
    correlation = np.corrcoef(values.T)
    # 5 deviations of a correlation of 3000 pairs, 1/√n each
    assert np.abs(correlation - np.eye(len(correlation))).max() < 5 / math.sqrt(3000)
    assert abs(float((values**4).mean()) - 3.0) < 0.1  # kurtosis of a normal distribution; 96,000 values, σ = 0.03
    assert (starts.position[:, ~moves] == own.position[~moves]).all()


@pytest.mark.fail_slow(60)  # compiles kernels of `exact`
def test_start_that_overlaps_is_refused_by_exact_alone() -> None:
    scene = loads(GAS)
    found = sandbox.ensemble(scene, 30, vary={"ball.*.position": 0.2}, engine="exact")
    assert {"ok", "refused"} == set(found.status.tolist())
    assert np.isnan(found.position[found.status == "refused"]).all()
    assert np.isfinite(found.position[found.status == "ok"]).all()
    assert (sandbox.ensemble(scene, 30, vary={"ball.*.position": 0.2}, engine="reference").status == "ok").all()


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ({}, "nothing is varied"),
        ({"velocity": 0.1}, r"'velocity' does not name a quantity of bodies; a path is such as ball\.\*\.velocity"),
        ({"ball.*.mass": 0.1}, "position, velocity, angle, angular_velocity"),
        ({"box.*.velocity": 0.1}, "no bodies of 'box'; it has ball, grid"),
        ({"ball.cue.velocity": 0.1}, "no body is named 'cue'"),
        ({"ball.anchor.velocity": 0.1}, "fixed or driven"),
        ({"ball.*.velocity": -0.1}, "at least 0, not -0.1"),
        ({"ball.*.velocity": math.nan}, "finite"),
        ({"ball.*.velocity": "much"}, "finite"),
    ],
)
def test_invalid_variation_is_explained(vary: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        sandbox.ensemble(loads(GAS), 3, vary=vary)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n": 0}, "from 1 to"),
        ({"threads": 0}, "at least 1"),
        ({"keep": "all"}, "'end', 'frames' or 'contacts', is 'all'"),
    ],
)
def test_invalid_argument_is_explained(change: dict[str, object], message: str) -> None:
    given = {"n": 3, "vary": {"ball.*.velocity": 0.1}} | change
    with pytest.raises(ValueError, match=message):
        sandbox.ensemble(loads(GAS), **given)


def test_results_that_exceed_memory_are_refused_before_the_first_run() -> None:
    with pytest.raises(TooLargeError, match="GB are available"):
        sandbox.ensemble(loads(GAS), 10_000_000, vary={"ball.*.velocity": 0.1}, keep="frames")


@pytest.mark.fail_slow(60)  # compiles kernels of `exact`
def test_progress_ends_at_one_and_unknown_engine_is_refused() -> None:
    fractions: list[float] = []
    vary = {"ball.*.velocity": 0.1}
    sandbox.ensemble(loads(GAS), 5, vary=vary, on_progress=lambda progress: fractions.append(progress.fraction))
    assert fractions[-1] == 1.0
    assert fractions == sorted(fractions)
    with pytest.raises(sandbox.UnknownEngineError, match="newton"):
        sandbox.ensemble(loads(GAS), 5, vary=vary, engine="newton")


def test_two_ensembles_at_once_do_not_disturb_each_other() -> None:
    scene, vary = loads(GAS), {"ball.*.velocity": 0.3}
    alone = sandbox.ensemble(scene, 20, vary=vary, engine="reference")
    found, ready = [], Event()

    def compute() -> None:
        ready.wait()
        found.append(sandbox.ensemble(scene, 20, vary=vary, engine="reference", threads=2))

    workers = [Thread(target=compute) for _ in range(3)]
    for worker in workers:
        worker.start()
    ready.set()
    for worker in workers:
        worker.join()
    assert len(found) == 3
    assert all(each.position.tobytes() == alone.position.tobytes() for each in found)
