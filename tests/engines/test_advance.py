"""`advance` makes the same steps as `step`, bit for bit, on every engine, in every scene, for every split."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.engines.common.kernel import COMPILED
from sandbox.engines.contract import Divergence
from sandbox.engines.reference import compiled_stepper
from sandbox.engines.reference.compiled_stepper import OPTIONAL_KERNELS
from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.registry import ENGINES, able
from sandbox.engines.switching import SwitchableSimulation, start
from sandbox.frame_table import FrameTable
from sandbox.measure.missed_contacts import Audit
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.trajectory import Frame
from tests.engines.stepping import advanced, assert_same_frames, stepped

pytestmark = pytest.mark.fail_slow(60)  # many runs of seconds

BOX = """
[[plane]]
point = [0, 0]
normal = [0, 1]

[[plane]]
point = [-1, 0]
normal = [1, 0]

[[plane]]
point = [1, 0]
normal = [-1, 0]
"""

SCENES = {
    "one ball": BOX + "[[ball]]\nposition = [0.1, 1.0]\nvelocity = [2.0, 0.0]\nradius = 0.1\n",
    "balls that settle": BOX + "[[grid]]\nradius = 0.1\norigin = [-0.5, 0.2]\ncolumns = 4\nrows = 3\n"
    "spacing = [0.21, 0.21]\njitter = 0.005\nrestitution = 0.3\nfriction = 0.4\n",
    "elastic gas": "[world]\ngravity = [0, 0]\n" + BOX + "[[plane]]\npoint = [0, 2]\nnormal = [0, -1]\n"
    "[[grid]]\nradius = 0.05\norigin = [-0.8, 0.2]\ncolumns = 5\nrows = 5\nspacing = [0.3, 0.3]\n"
    "velocity_jitter = 3.0\nrestitution = 1.0\nfriction = 0.0\n",
    "boxes": BOX + "[[box]]\nposition = [0, 0.3]\nsize = [0.4, 0.4]\nangle = 0.2\n"
    "[[box]]\nposition = [0.05, 0.9]\nsize = [0.4, 0.4]\nangle = -0.3\n",
    "boxes and walls": "[world]\nlinear_drag = 0.1\nbounds = [[-2, -1], [2, 3]]\n"
    + BOX
    + "[[wall]]\npoints = [[-0.9, 0.5], [0, 0.3], [0.8, 0.6]]\nthickness = 0.05\n"
    "[[box]]\nposition = [-0.6, 1.2]\nsize = [0.3, 0.2]\nangular_velocity = 3.0\nrestitution = 0.4\n"
    "[[capsule]]\nposition = [0.4, 1.0]\nlength = 0.3\nradius = 0.05\nangle = 1.0\nrestitution = 0.4\n"
    "[[ball]]\nposition = [0.1, 1.4]\nradius = 0.1\nvelocity = [0.5, 0]\n"
    "[[body]]\nposition = [0.0, 1.9]\nrestitution = 0.4\n[[body.polygon]]\npoints = [[0, 0], [0.2, 0], [0.1, 0.2]]\n"
    "[[body.ball]]\nposition = [-0.1, 0]\nradius = 0.06\n",
    "boxes that leave": "[world]\nbounds = [[-1, -1], [1, 1]]\n[[box]]\nposition = [0, 0]\nsize = [0.2, 0.1]\n"
    "velocity = [4, 2]\nangular_velocity = 5\n[[box]]\nposition = [0.5, 0]\nsize = [0.1, 0.1]\nvelocity = [-1, 0]\n",
    "thrusts": "[world]\nbounds = [[-4, -4], [4, 4]]\nlinear_drag = 0.2\n"
    + BOX
    + "[[box]]\nname = 'ship'\nposition = [0, 1]\nsize = [0.3, 0.2]\n"
    "[[ball]]\nname = 'rocket'\nposition = [0.6, 1]\nradius = 0.1\n"
    "[[thrust]]\nbody = 'ship'\nforce = [0.1, 0.9]\npoint = [0.05, -0.1]\n"
    "[[thrust]]\nbody = 'ship'\nforce = [0.3, 0.0]\npoint = [0.0, 0.1]\nbegin = 0.1\nend = 0.25\n"
    "[[thrust]]\nbody = 'rocket'\nforce = [0.0, 0.5]\npoint = [0.02, 0.0]\nbegin = 0.05\n",
    "thrust on a ball": "[[ball]]\nname = 'rocket'\nposition = [0.6, 1]\nradius = 0.1\n"
    "[[thrust]]\nbody = 'rocket'\nforce = [0.0, 0.5]\npoint = [0.02, 0.0]\nend = 0.3\n",
    "chain": BOX + "[[ball]]\nname = 'a'\nposition = [0.2, 2]\nradius = 0.08\n"
    "[[ball]]\nname = 'b'\nposition = [0.4, 2]\nradius = 0.08\nvelocity = [0, 1]\n"
    "[[ball]]\nname = 'c'\nposition = [0.6, 2]\nradius = 0.08\n"
    "[[joint]]\nkind = 'rod'\nbetween = ['a']\n[[joint]]\nkind = 'pivot'\nbetween = ['a', 'b']\nat = [0.3, 2]\n"
    "[[joint]]\nkind = 'slide'\nbetween = ['b', 'c']\nmost = 0.25\n",
    "jointed boxes": "[world]\nbounds = [[-5, -5], [5, 5]]\n"
    + BOX
    + "[[box]]\nname = 'trunk'\nposition = [0, 1]\nsize = [0.2, 0.4]\nangular_velocity = 2\n"
    "[[box]]\nname = 'arm'\nposition = [0.3, 1.15]\nsize = [0.4, 0.1]\n[[ball]]\nname = 'head'\nposition = [0, 1.3]\n"
    "radius = 0.1\n[[joint]]\nkind = 'pivot'\nbetween = ['trunk', 'arm']\nat = [0.1, 1.15]\n"
    "[[joint]]\nkind = 'pivot'\nbetween = ['trunk', 'head']\nat = [0, 1.2]\n"
    "[[joint]]\nkind = 'rotary_limit'\nbetween = ['trunk', 'arm']\nleast = -0.5\nmost = 0.5\n",
    "no bodies": BOX,
    "bounds and lifetimes": "[world]\nbounds = [[-3, -3], [3, 3]]\n"
    "[[ball]]\nposition = [0, 0]\nvelocity = [9, 0]\nradius = 0.1\n[[ball]]\nposition = [0, 1]\nradius = 0.1\n"
    "[[emitter]]\nposition = [0, 2]\ncount = 5\nlifetime = 0.17\nvelocity_min = [-1, -1]\n"
    "velocity_max = [1, 1]\ncollides = 'none'\n",
    "particles beside a ball": BOX + "[[ball]]\nposition = [0, 0.5]\nradius = 0.1\n"
    "[[ball]]\nposition = [0.5, 0.5]\nradius = 0.1\ncollides = 'none'\n",
    "drag, walls and posts": "[world]\nlinear_drag = 0.1\nquadratic_drag = 0.2\nwind = [1, 0]\n"
    + BOX
    + "[[wall]]\npoints = [[-0.9, 0.5], [0, 0.3], [0.8, 0.6]]\n[[post]]\nposition = [0.1, 0.8]\nradius = 0.05\n"
    "[[grid]]\nradius = 0.06\norigin = [-0.7, 1.0]\ncolumns = 6\nrows = 5\nspacing = [0.2, 0.2]\njitter = 0.02\n"
    "velocity_jitter = 1.0\nrestitution = 0.6\nfriction = 0.3\n",
    "damping, walls and posts": "[world]\ndamping = 0.5\n"
    + BOX
    + "[[wall]]\npoints = [[-0.9, 0.5], [0, 0.3], [0.8, 0.6]]\n[[post]]\nposition = [0.1, 0.8]\nradius = 0.05\n"
    "[[grid]]\nradius = 0.06\norigin = [-0.7, 1.0]\ncolumns = 6\nrows = 5\nspacing = [0.2, 0.2]\njitter = 0.02\n"
    "velocity_jitter = 1.0\nrestitution = 0.6\nfriction = 0.3\n",
    "damping, drag and thrust": "[world]\ndamping = 0.4\nlinear_drag = 0.2\nwind = [1, 0]\n"
    + BOX
    + "[[box]]\nname = 'ship'\nposition = [0, 1]\nsize = [0.3, 0.2]\nangular_velocity = 3.0\n"
    "[[box]]\nposition = [0.1, 0.3]\nsize = [0.3, 0.2]\nangle = 0.3\nfriction = 0.4\n"
    "[[thrust]]\nbody = 'ship'\nforce = [0.1, 0.9]\npoint = [0.05, -0.1]\n",
    "spring": "[[ball]]\nname = 'mass'\nposition = [1.1, 0]\nradius = 0.1\n"
    "[[joint]]\nkind = 'spring'\nbetween = ['mass']\nrest_length = 1.0\nstiffness = 40\n",
}
"""Scenes of the kinds for which an engine has a path of its own."""


@pytest.fixture(autouse=True)
def _compiled_steps() -> None:
    """Compile the optional kernels at once; they are otherwise compiled only after a while."""
    for kernel in OPTIONAL_KERNELS:
        kernel.spent = math.inf


def small_scene(name: str) -> Scene:
    return loads(SCENES[name])


CASES = [(name, engine) for name in SCENES for engine in able(small_scene(name))]


def started(scene: Scene, engine: str, **changes: object) -> SwitchableSimulation:
    return start(scene, engine, scene.solver.replace(**changes))


@pytest.mark.parametrize(("name", "engine"), CASES)
@settings(max_examples=8)
@given(
    splits=st.lists(st.integers(1, 40), min_size=1, max_size=4),
    every=st.integers(1, 5),
    substeps=st.integers(1, 4),
    audited=st.booleans(),
    with_energy=st.booleans(),
)
def test_advance_equals_steps(
    name: str, engine: str, splits: list[int], every: int, substeps: int, audited: bool, with_energy: bool
) -> None:
    scene = small_scene(name)
    changes = {"substeps": substeps} if engine != "exact" else {}
    results = []
    for way in (stepped, advanced):
        simulation = started(scene, engine, **changes)
        audit = Audit(simulation.setup)
        if audited:
            simulation.watch(audit)
        is_accounted = with_energy and ENGINES[engine].knows_impulses
        if is_accounted:
            simulation.account()
        table, observed = way(simulation, splits, every)
        energy = list(simulation.account().values()) if is_accounted else []
        results.append((table, [*observed, *(array.tobytes() for array in audit.missed())], energy))
    (one, seen, energy), (other, seen_other, energy_other) = results
    assert seen == seen_other
    if engine == "pymunk":  # it sums over contacts in the order of its memory
        assert energy == pytest.approx(energy_other, rel=1e-9, abs=1e-12)
    else:
        assert energy == energy_other
    assert_same_frames(one, other)


BROAD_PHASES = ("all_pairs", "circles", "grid", "sweep")
COMPILED_SCENES = (
    "drag, walls and posts", "damping, walls and posts", "damping, drag and thrust", "boxes and walls", "thrusts",
    "thrust on a ball", "chain", "jointed boxes",
)  # fmt: skip


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("name", COMPILED_SCENES)
def test_compiled_steps_of_the_reference(name: str, integrator: str) -> None:
    """Every scene with every integrator, and each of these with every broad phase in turn."""
    scene = small_scene(name)
    broad_phase = BROAD_PHASES[(COMPILED_SCENES.index(name) + list(INTEGRATORS).index(integrator)) % 4]
    ways = [(stepped, [100]), (advanced, [37, 63])]
    changes = {"integrator": integrator, "broad_phase": broad_phase, "substeps": 2}
    (one, seen), (other, seen_other) = (way(started(scene, "reference", **changes), split, 1) for way, split in ways)
    assert_same_frames(one, other)
    # The contacts were taken twice, so that those that lasted have one row more.
    assert seen[:5] == seen_other[:5]


@pytest.mark.parametrize(
    "substeps", [512, 513, 1000]
)  # a call reserves 64 rows for the contacts of each; it has 512·64
@pytest.mark.parametrize("name", ["balls that settle", "boxes"])
def test_compiled_steps_of_many_substeps_end(name: str, substeps: int) -> None:
    ways = [(stepped, [20]), (advanced, [20])]
    (one, seen), (other, seen_other) = (
        way(started(small_scene(name), "reference", substeps=substeps), split, 1) for way, split in ways
    )
    assert_same_frames(one, other)
    assert seen == seen_other


@pytest.mark.parametrize(("name", "kernel"), [("balls that settle", "advance_balls"), ("boxes", "advance_pieces")])
def test_compiled_steps_are_used(name: str, kernel: str, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    compiled = getattr(compiled_stepper, kernel)
    monkeypatch.setattr(compiled_stepper, kernel, lambda *given: calls.append(1) or compiled(*given))
    advanced(started(small_scene(name), "reference"), [50], 1)
    assert bool(calls) == COMPILED


@pytest.mark.parametrize("codes", ["INTEGRATOR_CODES", "BROAD_PHASE_CODES"])
@pytest.mark.parametrize("name", ["balls that settle", "boxes"])
def test_methods_without_compiled_code_use_the_readable_step(
    name: str, codes: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = small_scene(name)
    one, seen = advanced(started(scene, "reference"), [50], 1)
    monkeypatch.setattr(compiled_stepper, codes, {})
    for kernel in ("advance_balls", "advance_pieces"):
        monkeypatch.setattr(compiled_stepper, kernel, None)  # must not be called
    other, seen_other = advanced(started(scene, "reference"), [50], 1)
    assert seen == seen_other
    assert_same_frames(one, other)


def test_spring_that_diverges_warns_of_nothing() -> None:
    text = (
        "[solver]\ndt = 1.0\n[[ball]]\nname = 'mass'\nposition = [1.1, 0]\nradius = 0.1\n[[plane]]\npoint = [0, -9]\n"
    )
    spring = "normal = [0, 1]\n[[joint]]\nkind = 'spring'\nbetween = ['mass']\nrest_length = 1.0\nstiffness = 1e9\n"
    scene = loads(text + spring)
    for engine in able(scene):
        table, seen = advanced(started(scene, engine), [400], 1)
        assert "Divergence" in str(seen[1])
        assert table.steps < 400


EVENTFUL = [case for case in CASES if case[0] != "no bodies"]


@pytest.mark.parametrize(("name", "engine"), EVENTFUL)
@settings(max_examples=5)
@given(steps=st.integers(1, 60), substeps=st.integers(1, 3))
def test_only_the_last_step_until_an_event_has_one(name: str, engine: str, steps: int, substeps: int) -> None:
    """With `until_event`, contacts and removals belong to the last step, and the states are those of `step`."""
    one, other = (started(small_scene(name), engine, dt=0.01, substeps=substeps) for _ in range(2))
    assert len(one.contacts()) == len(other.contacts())
    while steps > 0:
        table, gone = FrameTable(steps, len(one.bodies)), set(other.retired)
        one.advance(steps, table, until_event=True)
        for k in range(table.steps):
            other.step()
            contacts = other.contacts()
            if k < table.steps - 1:
                assert not len(contacts)
                assert set(other.retired) == gone
            assert table.frame(k, other.frame().present).state_hash() == _without_visits(other).state_hash()
        assert one.contacts().pair.tolist() == contacts.pair.tolist()
        assert one.state_hash() == other.state_hash()
        steps -= table.steps


def _without_visits(simulation: SwitchableSimulation) -> Frame:
    """Return the frame with what a frame table keeps."""
    return replace(simulation.frame(), visits=None, drives=None, passing=None)


@pytest.mark.parametrize("engine", ENGINES)
def test_table_without_rows_is_refused(engine: str) -> None:
    simulation = started(small_scene("one ball"), engine)
    table = FrameTable(3, 1)
    with pytest.raises((ValueError, IndexError)):
        simulation.advance(5, table)


@pytest.mark.parametrize("engine", ENGINES)
def test_table_is_widened_for_bodies_that_were_added(engine: str) -> None:
    simulation = started(small_scene("one ball"), engine)
    table = FrameTable(3, 0)
    simulation.advance(3, table)
    assert table.position.shape[1] >= 1
    np.testing.assert_array_equal(table.position[2, 0], simulation.frame().position[0])


@pytest.mark.parametrize("every", [1, 7])
@pytest.mark.parametrize("engine", ENGINES)
def test_divergence_within_an_advance(engine: str, every: int) -> None:
    # From 1e12 m/s, 1e10 m/s faster each step: beyond the bound of 1e13 m/s within 900 steps. Box2D's bound is that of
    # positions, 10 km for this slop: from 1 km at 10 m/s it is reached after 900 steps.
    begin, speed, more = (-1e3, -10.0, 0.0) if engine == "box2d" else (0.0, -1e12, -1e9)
    dt = 1 if engine == "box2d" else 10
    text = f"[world]\ngravity = [0, {more}]\n[solver]\ndt = {dt}\n"
    scene = loads(
        text + f"[[ball]]\nposition = [0, {begin}]\nvelocity = [0, {speed}]\nradius = 0.1\n"
        f"[[ball]]\nposition = [9, {begin}]\nvelocity = [0, {speed}]\nradius = 0.1\n"
    )  # pymunk has no bound for particles
    one, seen = stepped(started(scene, engine), [1000], every)
    other, seen_other = advanced(started(scene, engine), [1000], every)
    assert "Divergence" in str(seen[1])
    assert 800 < one.steps < 1000
    assert seen == seen_other
    assert_same_frames(one, other)
    simulation = started(scene, engine)
    with pytest.raises(Divergence):
        simulation.advance(1000, FrameTable(1001, 1))
    with pytest.raises(RuntimeError, match="has ended"):
        simulation.advance(1, FrameTable(1, 1))
