"""Comparisons of scenes with boxes and joints: truths against formulas, and rows of the engines."""

import math

import pytest

from sandbox.engines.registry import ENGINES
from sandbox.measure.analytic import closed_form
from sandbox.measure.analytic.trajectory import solved_run
from sandbox.measure.compare.attribution import setting_changes
from sandbox.measure.compare.comparison import compare
from sandbox.measure.compare.self_convergence import refine
from sandbox.measure.metrics.trajectory_error import default_tolerance
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

PENDULUM = (
    "[world]\ngravity = [0.0, -9.81]\nduration = 1.0\n[solver]\ndt = 0.01\n"
    "[[ball]]\nname = 'bob'\nposition = [1.0, 0.0]\nradius = 0.1\n"
    "[[joint]]\nname = 'rod'\nkind = 'rod'\nbetween = ['bob']\nanchors = [[0, 0], [0, 0]]\n"
)
SLOPE = math.radians(30.0)


def sliding(friction: float) -> Scene:
    """Return a crate of 0.4 m on a slope of 30°, in contact with it."""
    sin, cos = math.sin(SLOPE), math.cos(SLOPE)
    return loads(
        f"[world]\ngravity = [0.0, -9.81]\nduration = 0.5\n[solver]\ndt = 0.005\n"
        f"[[plane]]\nname = 'slope'\npoint = [0, 0]\nnormal = [{-sin!r}, {cos!r}]\nfriction = {friction}\n"
        f"[[box]]\nname = 'crate'\nposition = [{-0.2 * sin!r}, {0.2 * cos!r}]\nangle = {SLOPE!r}\nsize = [0.4, 0.4]\n"
        "friction = 1.0\n"
    )


def tower(boxes: int) -> Scene:
    text = "[world]\ngravity = [0.0, -9.81]\nduration = 0.5\n[solver]\ndt = 0.005\n"
    text += "[[plane]]\nname = 'g'\npoint = [0, 0]\nnormal = [0, 1]\nfriction = 0.5\n"
    for k in range(boxes):
        text += f"[[box]]\nname = 'b{k}'\nposition = [0, {k + 0.5}]\nsize = [1, 1]\nfriction = 1.0\n"
    return loads(text)


def test_refined_truth_of_a_sliding_crate_agrees_with_the_formula() -> None:
    scene = sliding(0.3)
    truth = refine(scene, scene.solver, default_tolerance(scene))
    assert truth.agrees_until == 0.5
    distance = -(truth.trajectory.position[:, 0] - scene.bodies.position[0]) @ (math.cos(SLOPE), math.sin(SLOPE))
    expected = 0.5 * 9.81 * (math.sin(SLOPE) - 0.3 * math.cos(SLOPE)) * truth.trajectory.time**2
    # agreement of successive refinements
    assert distance == pytest.approx(expected, abs=0.1 * default_tolerance(scene))


def test_joint_method_is_a_setting_that_lowers_the_error_of_a_pendulum() -> None:
    found = compare(loads(PENDULUM), ["pymunk", "reference"], tolerance=1e-3, why=True)
    for row in found.rows:
        assert row.status == "ok"
        assert 1e-3 < (row.score.max_position or 0.0) < 0.1
        assert row.momentum_drift is None  # the rod's pull on the world is not recorded
        assert (row.count("missed"), row.count("phantom")) == (0, 0)
    tried = {(effect.setting, effect.value): effect for effect in found.rows[1].why}
    assert tried["joints", "rattle"].ratio < 0.2
    assert found.rows[1].verdict is not None
    assert "joints = rattle" in found.rows[1].verdict


def test_joint_method_is_tried_only_in_scenes_with_joints() -> None:
    jointed, free = loads(PENDULUM), sliding(0.3)
    names = [
        {name for name, _, _ in setting_changes(ENGINES["reference"].resolve(s, s.solver))} for s in (jointed, free)
    ]
    assert names[0] - names[1] == {"joints"}


def test_tower_has_lasting_contacts_and_no_energy_drift() -> None:
    scene = tower(3)
    found = compare(scene, ["pymunk"])
    (row,) = found.rows
    assert (row.status, row.count("matched"), row.count("missed"), row.count("phantom")) == ("ok", 3, 0, 0)
    assert row.first_divergence is None
    assert row.energy_drift is None
    assert row.momentum_drift == pytest.approx(0.0, abs=1e-9)  # Σ impulses of the ground = weight · time, to rounding


@pytest.mark.parametrize(
    "extra",
    [
        "[[joint]]\nkind = 'spring'\nbetween = ['a']\nstiffness = 1.0\n",
        "[[thrust]]\nbody = 'a'\nforce = [1.0, 0.0]\n",
        "[[attraction]]\ntoward = [9.0, 9.0]\nstrength = 1.0\n",
    ],
    ids=["joined", "thrust", "attracted"],
)
@pytest.mark.parametrize("collides", ["none", "all"])
def test_body_with_joint_attraction_or_thrust_has_no_closed_form(extra: str, collides: str) -> None:
    text = (
        "[world]\ngravity = [0, -10]\nduration = 0.5\n[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\n"
        f"[[ball]]\nname = 'a'\nposition = [0, 5]\nradius = 0.5\ncollides = '{collides}'\n"
    )
    free, bound = loads(text), loads(text + extra)
    assert solved_run(free, free.solver) is not None
    assert solved_run(bound, bound.solver) is None
    assert closed_form(run(free, audit=False), free, 0) is not None
    assert closed_form(run(bound, audit=False), bound, 0) is None


def test_closed_form_of_a_falling_box_is_valid_until_a_corner_touches() -> None:
    scene = loads(
        "[world]\ngravity = [0, -10]\nduration = 1.0\n[solver]\ndt = 0.001\n"
        "[[plane]]\npoint = [0, 0]\nnormal = [0, 1]\n"
        "[[box]]\nname = 'b'\nposition = [0, 3]\nangle = 0.7853981633974483\nsize = [1, 1]\n"
    )
    assert solved_run(scene, scene.solver) is None  # it may hit the plane, and is no ball
    form = closed_form(run(scene, audit=False), scene, 0)
    last = form.valid.nonzero()[0][-1] * 0.001
    # It falls until its centre is half a diagonal above the ground: ½·10·t² = 3 − √½.
    assert last == pytest.approx(math.sqrt((3.0 - math.sqrt(0.5)) / 5.0), abs=0.0011)  # a step
