"""Laws of joints in every way: momentum, bounds that hold, forces that are stated, and what lets go."""

import math

import numpy as np
import pytest

from sandbox.engines.reference.integrators import INTEGRATORS
from sandbox.engines.reference.joints import METHODS, UNSUPPORTED, JointSolver
from sandbox.scene.compile.joint_arrays import LinkKind
from tests.engines.reference.joint_rig import BIAS, G, Rig, compile_joints, link

HOW = [
    *((how, "semi_implicit_euler") for how in METHODS),
    ("impulses", "explicit_euler"),
    ("rattle", "velocity_verlet"),
]


def tumbling(how, integrator, *more):
    """Return three bodies in a row, joined off their centres, tumbling freely."""
    held = compile_joints(
        link(LinkKind.ROD, 0, 1, 0.6, anchor_a=(0.2, 0.0), anchor_b=(-0.2, 0.0)),
        link(LinkKind.ROD, 1, 2, 0.6, anchor_a=(0.2, 0.0), anchor_b=(-0.2, 0.0)),
        link(LinkKind.ROTARY_LIMIT, 0, 1, -0.3, 0.3),
        *more,
    )
    rates = [[1, 2, 3], [0, -1, 0], [0.5, 1, -2]]
    pose = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    moment = [0.1, 0.2, 0.15]
    return Rig(held, pose, rates, mass=[1, 2, 3], moment=moment, how=how, integrator=integrator, gravity=0)


@pytest.mark.parametrize(("how", "integrator"), HOW)
def test_free_bodies_keep_their_momentum(how, integrator):
    rig = tumbling(how, integrator, link(LinkKind.PIVOT, 1, 2, anchor_a=(0.5, 0.2), anchor_b=(-0.5, 0.2)))
    before = rig.momentum
    rig.run(2.0, 1 / 240)
    assert rig.momentum == pytest.approx(before, rel=1e-12)  # rounding of 480 steps


@pytest.mark.parametrize(("how", "integrator"), [way for way in HOW if way[0] in ("impulses", "rattle")])
def test_pushes_along_the_lines_of_the_start_keep_angular_momentum(how, integrator):
    rig = tumbling(how, integrator)
    before = rig.angular_momentum
    rig.run(2.0, 1 / 240)
    assert rig.angular_momentum == pytest.approx(before, rel=1e-12)  # rounding of 480 steps


@pytest.mark.parametrize("how", ["relaxation", "xpbd"])
def test_pushes_along_the_lines_of_the_end_lose_angular_momentum_with_the_step(how):
    """As backward Euler does, whose scheme they are: x' × v' is x × v but for h v' × v."""
    lost = []
    for n in (480, 960):
        rig = tumbling(how, "semi_implicit_euler")
        before = rig.angular_momentum
        lost.append(rig.run(0.5, 1 / n).angular_momentum - before)
    assert abs(lost[0]) < 0.1 * abs(before)  # measured 2 % and less
    assert lost[0] / lost[1] == pytest.approx(2.0, abs=0.4)  # first order, and the time the limit is met


@pytest.mark.parametrize(("how", "integrator"), HOW)
def test_a_rotary_limit_holds(how, integrator):
    """A beam on a pivot falls onto its limit at −½ and stays: the torque there is its weight's."""
    held = compile_joints(
        link(LinkKind.PIVOT, -1, 0, anchor_b=(-0.5, 0.0)),
        link(LinkKind.ROTARY_LIMIT, -1, 0, -0.5, 1.0),
    )
    rig = Rig(held, [0.5, 0, 0], moment=1 / 12, how=how, integrator=integrator, iterations=50)
    for _ in range(960):
        rig.step(1 / 240)
        assert rig.pose[0, 2] > -0.5 - 0.03  # falls past by a step's turn, 4.2 rad/s · h, at most
    assert rig.pose[0, 2] == pytest.approx(-0.5, abs=2e-3)  # impulses hold where bias balances a step of falling
    assert rig.solver.load(rig.x)[1, 0] == pytest.approx(G * 0.5 * math.cos(0.5), rel=0.05)  # of the last step


@pytest.mark.parametrize(("how", "integrator"), HOW)
def test_a_slack_slide_does_nothing(how, integrator):
    held = compile_joints(link(LinkKind.SLIDE, -1, 0, 0.1, 2.0))
    with_it = Rig(held, [1, 0], [[0.3, 1, 0]], how=how, integrator=integrator).run(0.5, 1 / 240)
    free = Rig(compile_joints(), [1, 0], [[0.3, 1, 0]], how=how, integrator=integrator).run(0.5, 1 / 240)
    assert np.array_equal(with_it.x, free.x)


@pytest.mark.parametrize(("how", "integrator"), HOW)
def test_a_slide_holds_as_a_string_and_keeps_off(how, integrator):
    held = compile_joints(link(LinkKind.SLIDE, -1, 0, 0.4, 1.0))
    rig = Rig(held, [0.8, 0.0], [[0.0, 2.0, 0]], how=how, integrator=integrator)
    for _ in range(960):
        rig.step(1 / 240)
        length = math.hypot(*rig.pose[0, :2])
        # Impulses act after the bound is passed, by a step's way at most; the others put it right in the step.
        slack = 6.0 / 240 if how == "impulses" else 1e-12
        assert 0.4 - slack < length < 1.0 + slack
    inside = Rig(held, [0.0, 0.5], how=how, integrator=integrator).run(2.0, 1 / 240)
    assert math.hypot(*inside.pose[0, :2]) == pytest.approx(0.4, abs=1e-2)  # stands on the lower bound, dead upright


@pytest.mark.parametrize(("how", "integrator"), HOW)
@pytest.mark.parametrize("kind", [LinkKind.ROD, LinkKind.PIVOT])
def test_a_joint_gives_no_more_than_its_most_force(how, integrator, kind):
    """Straight down, it falls with g − F/m."""
    figures = (1.0,) if kind == LinkKind.ROD else ()
    anchor = (0.0, 0.0) if kind == LinkKind.ROD else (0.0, 1.0)
    held = compile_joints(link(kind, -1, 0, *figures, anchor_b=anchor, most_force=4.0))
    rig = Rig(held, [0, -1], mass=2.0, how=how, integrator=integrator).run(1.0, 1 / 100)
    assert rig.rates[0, 1] == pytest.approx(-(G - 2.0), rel=1e-12)  # rounding of 100 steps
    assert rig.solver.load(rig.x)[0] == pytest.approx([0.0, 4.0], abs=1e-12)  # as above


@pytest.mark.parametrize(("how", "integrator"), HOW)
def test_a_hanging_load_is_the_weight(how, integrator):
    held = compile_joints(
        link(LinkKind.ROD, -1, 0, 1.0), link(LinkKind.PIVOT, 0, 1, anchor_a=(0, -0.5), anchor_b=(0, 0.5))
    )
    rig = Rig(held, [[0, -1], [0, -2]], mass=[1, 2], moment=1.0, how=how, integrator=integrator, iterations=60)
    rig.run(2.0, 1 / 240)
    assert rig.solver.load(rig.x)[:, 1] == pytest.approx([3 * G, 2 * G], rel=1e-3)  # settled, as far as 60 passes go
    assert rig.solver.load(rig.x)[:, 0] == pytest.approx(0.0, abs=1e-12)  # rounding


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("how", METHODS)
def test_what_hangs_at_rest_has_the_velocity_that_its_positions_have_yet_to_follow(how, integrator):
    rig = Rig(compile_joints(link(LinkKind.ROD, -1, 0, 1.0)), [0, -1], how=how, integrator=integrator).run(2, 1 / 240)
    unseen = 1.0 - INTEGRATORS[integrator].fraction if how in ("relaxation", "xpbd") else 0.0
    assert rig.rates[0, 1] == pytest.approx(-unseen * G / 240, abs=1e-12)  # rounding over h
    assert rig.pose[0, 1] == pytest.approx(
        -1.0, abs=1e-12
    )  # impulses have undone the first step's fall, at .9 a 1/60 s


@pytest.mark.parametrize(("how", "integrator"), HOW)
def test_what_is_torn_lets_go_and_the_rest_keeps_its_impulses(how, integrator):
    held = compile_joints(link(LinkKind.ROD, -1, 0, 1.0), link(LinkKind.ROD, -1, 1, 1.0))
    rig = Rig(held, [[0, -1], [0, -1]], how=how, integrator=integrator).run(1.0, 1 / 100)
    kept = rig.solver.impulse()[1].copy()
    assert kept[1] != 0.0
    rig.solver.rebuild(rig.solver.inverse_mass, rig.solver.inverse_moment, np.array([1]))
    # The line of a rod is found anew when it is next prepared: until then, what it keeps is a sum along it.
    assert abs(rig.solver.rows.impulse[0, 0]) == pytest.approx(np.hypot(*kept), rel=1e-15)
    rig.rates[:] = 0.0
    rig.run(0.5, 1 / 100)
    assert rig.rates[0, 1] == pytest.approx(-G * 0.5, rel=1e-12)  # free fall, rounding of 50 steps
    assert rig.pose[1, :2] == pytest.approx([0.0, -1.0], abs=1e-3)
    assert not rig.solver.impulse()[0].any()


@pytest.mark.parametrize(("how", "integrator"), HOW)
def test_joints_between_what_is_fixed_do_nothing(how, integrator):
    kinds = [(LinkKind.ROD, 0.3), (LinkKind.PIVOT, 0), (LinkKind.SLIDE, 0, 0.1), (LinkKind.ROTARY_LIMIT, 1, 2)]
    held = compile_joints(*(link(kind, 0, 1, *figures) for kind, *figures in kinds))
    rig = Rig(held, [[0, 0], [1, 0]], mass=math.inf, how=how, integrator=integrator)
    before = rig.x.copy()
    rig.run(0.1, 0.01)
    assert np.array_equal(rig.x, before)


@pytest.mark.parametrize(("how", "integrator"), HOW)
def test_a_rod_of_no_length_between_coincident_ends_does_no_harm(how, integrator):
    rig = Rig(compile_joints(link(LinkKind.ROD, -1, 0, 1.0)), [0, 0], gravity=0, how=how, integrator=integrator).run(
        0.1, 0.01
    )
    assert np.array_equal(rig.x, np.zeros((2, 1, 3)))  # no line to push along, as in Munk2D


def test_a_single_short_step_between_long_ones_is_no_blow():
    """A shorter step starts from less; the long one after it does not start from more than that."""
    held = compile_joints(*(link(LinkKind.ROD, k - 1, k, 0.1) for k in range(20)))
    rig = Rig(held, [[0.0, -0.1 * (k + 1)] for k in range(20)], mass=np.linspace(1, 5, 20)).run(3.0, 1 / 120)
    quiet = np.abs(rig.rates).max()
    rig.step(1e-6)
    rig.step(1 / 120)
    assert np.abs(rig.rates).max() < quiet + 2 * G / 120  # at most a step of falling where passes are too few


@pytest.mark.parametrize("kind", UNSUPPORTED)
def test_kinds_that_are_lacking_are_refused_by_name(kind):
    with pytest.raises(ValueError, match=kind.name.lower()):
        JointSolver(compile_joints(link(kind, -1, 0)), np.ones(1), np.ones(1), BIAS, 10, "impulses")


def test_an_unknown_way_is_refused():
    with pytest.raises(ValueError, match="glue"):
        JointSolver(compile_joints(), np.ones(1), np.ones(1), BIAS, 10, "glue")
