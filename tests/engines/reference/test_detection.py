"""Detection: when impacts are found, what is let through, and that rest stays rest."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.action import ActionError, Spawn
from sandbox.engines.contract import Exhaustion
from sandbox.engines.reference.continuous import DETECTIONS, MAX_IMPACTS
from sandbox.measure.run.runner import run
from sandbox.scene.description.bodies import Box
from tests.engines.reference.pieces import EARTH, FLOOR, ball, running, scene_of, shipped, stepped

pytestmark = pytest.mark.full  # hundreds of combinations

UNSEEING, SEEING = ["discrete", "bisect"], ["swept", "shrink"]


@given(st.floats(0.05, 3), st.floats(-2, 2), st.floats(0.003, 0.05))
def test_bisection_finds_the_moment_of_a_bounce(height, speed, dt):
    scene = scene_of(
        ball(0, 0.5 + height, velocity=[0, speed], restitution=0.8), world=EARTH, plane=[FLOOR], solver={"dt": dt}
    )
    simulation = running(scene, detection="bisect", integrator="velocity_verlet")
    simulation.contacts()
    landing = (speed + math.sqrt(speed * speed + 2 * 9.81 * height)) / 9.81
    stepped(simulation, math.ceil(landing / dt) + 1)
    found = simulation.contacts().time[0]
    assert found == pytest.approx(landing, abs=1e-8)  # 1e-9 of a step, and rounding of the drop over the speed
    down = math.sqrt(speed * speed + 2 * 9.81 * height)
    since = simulation.time - landing
    expected = 0.8 * down - 9.81 * since
    if expected > 0:  # still on its way up
        assert simulation.frame().velocity[0, 1] == pytest.approx(expected, abs=1e-7)  # as above, times g and e


@given(st.floats(0.5, 3), st.floats(0.003, 0.05))
def test_swept_finds_it_along_the_straight_line_of_the_step(height, dt):
    scene = scene_of(ball(0, 0.5 + height, restitution=0.8), world=EARTH, plane=[FLOOR], solver={"dt": dt})
    simulation = running(scene, detection="swept", integrator="velocity_verlet")
    simulation.contacts()
    landing = math.sqrt(2 * height / 9.81)
    stepped(simulation, math.ceil(landing / dt) + 1)
    # A chord misses the parabola by g·h²/8 at most, passed at this speed
    most = 9.81 * dt * dt / 8 / (9.81 * (landing - dt))
    assert abs(simulation.contacts().time[0] - landing) <= most * 1.01 + 1e-9


def test_bounces_are_as_right_as_the_readme_says():
    """By bisection to rounding; by the chord of each step to second order, since it passes the parabola by g·h²/8."""
    scene = shipped("tutorial/bounce")
    truth = run(scene, "exact").position

    def error(detection, substeps):
        found = run(scene, "reference", integrator="velocity_verlet", detection=detection, substeps=substeps)
        return float(np.abs(found.position - truth).max())

    assert error("bisect", 1) < 2e-11  # m; measured 1.1e-11: 1e-9 of a step at some 10 m/s
    coarse, fine = error("swept", 1), error("swept", 2)
    assert 2e-6 < coarse < 4e-6  # m; measured 3.1e-6
    assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.2)  # measured 1.99


def test_the_tutorials_fast_ball_is_met_within_its_first_step():
    simulation = running(shipped("tutorial/fast_ball"), detection="swept")
    simulation.contacts()
    simulation.step()
    contacts = simulation.contacts()
    assert contacts.time == pytest.approx([0.045], rel=1e-14)  # 4.5 m at 100 m/s
    assert simulation.frame().position[0, 1] == pytest.approx(0.5 + 5.5, rel=1e-12)  # the rest of the step, up again


BULLET = shipped("benchmark/bullet")
DISTANCE = 0.01 + 0.02 / 2  # m, at which the bullet touches its wall's middle: r + w/2


def shot(detection, way, lead=1e-6, **settings):
    """Shoot the bullet so that it moves `way` a step, and a step ends just before it touches; return how far it came.

    A discrete look sees it when a step ends with its centre in the last r + w/2 before the middle of the wall;
    beyond the middle it is pushed out on the other side. So it passes here when v·h > r + w/2.
    """
    dt = way / 100.0
    start_x = 1.0 - DISTANCE - lead - 3 * way
    bullet = {"name": "bullet", "position": [start_x, 0.0], "velocity": [100.0, 0.0], "radius": 0.01, "mass": 0.01}
    wall = {"points": [[1.0, -1.0], [1.0, 1.0]], "thickness": 0.02, "restitution": 0.5}
    simulation = running(scene_of(bullet, wall=[wall], solver={"dt": dt}), detection=detection, **settings)
    farthest = start_x
    for _ in range(8):
        simulation.step()
        farthest = max(farthest, float(simulation.frame().position[0, 0]))
    return farthest, float(simulation.frame().velocity[0, 0])


@pytest.mark.parametrize("part", [0.5, 0.9, 0.99])
@pytest.mark.parametrize("detection", DETECTIONS)
def test_no_detection_lets_through_what_moves_less_than_the_distance_of_touch(detection, part):
    farthest, speed = shot(detection, part * DISTANCE)
    assert farthest < 1.0
    assert speed == pytest.approx(-50.0, rel=1e-12)  # some roundings


@pytest.mark.parametrize("part", [1.01, 2.5, 10.0, 100.0])
@pytest.mark.parametrize("detection", UNSEEING)
def test_looks_at_the_end_of_a_step_let_through_what_moves_more(detection, part):
    farthest, speed = shot(detection, part * DISTANCE)
    assert farthest > 1.0
    assert speed == 100.0


@pytest.mark.parametrize(
    ("detection", "part"),
    [(detection, part) for detection in SEEING for part in (1.01, 2.5, 10.0, 100.0)] + [("swept", 1e4)],
)
@pytest.mark.parametrize("integrator", ["explicit_euler", "semi_implicit_euler", "rk4"])
def test_swept_and_shrink_stop_it_at_every_speed(detection, part, integrator):
    farthest, speed = shot(detection, part * DISTANCE, integrator=integrator)
    assert farthest <= 1.0 - DISTANCE / 4  # shrink: half a radius deep at most
    assert speed == pytest.approx(-50.0, rel=1e-12)  # some roundings


@pytest.mark.parametrize("detection", SEEING)
def test_the_shipped_bullet_is_stopped(detection):
    simulation = stepped(running(BULLET, detection=detection), 20)
    assert simulation.frame().velocity[0, 0] == pytest.approx(-50.0, rel=1e-12)  # as above


@pytest.mark.parametrize("detection", UNSEEING)
def test_the_shipped_bullet_is_missed(detection):
    assert stepped(running(BULLET, detection=detection), 20).frame().velocity[0, 0] == 100.0


def test_odds_of_a_miss_are_those_of_the_formula():
    """P = 1 − (r + w/2)/(v·h), over where in its step the bullet is."""
    way = 5 * DISTANCE
    passed = [shot("discrete", way, lead)[1] == 100.0 for lead in (np.arange(100) + 0.5) / 100 * way]
    # a step ends `lead` before it touches; it passes unless the next ends in the last r + w/2
    assert sum(passed) == 80


OBSTACLES = {
    "thin wall": ({"wall": [{"points": [[5, -1], [5, 1]], "restitution": 1.0}]}, 4.5),
    "wall's end": ({"wall": [{"points": [[5, 0], [9, 0]], "restitution": 1.0}]}, 4.5),
    "post": ({"post": [{"position": [5, 0], "radius": 0.25, "restitution": 1.0}]}, 4.25),
    "plane": ({"plane": [{"point": [5, 0], "normal": [-1, 0], "restitution": 1.0}]}, 4.5),
}


@pytest.mark.parametrize("speed", [10.0, 1e3, 1e6, 1e9])
@pytest.mark.parametrize("name", OBSTACLES)
def test_swept_turns_back_at_everything_fixed(name, speed):
    obstacle, place = OBSTACLES[name]
    scene = scene_of(ball(0, 0, velocity=[speed, 0], restitution=1.0), **obstacle, solver={"dt": 1.0})
    simulation = running(scene, detection="swept")
    simulation.contacts()
    simulation.step()
    assert simulation.contacts().time == pytest.approx([place / speed], rel=1e-12)  # some roundings
    frame = simulation.frame()
    assert frame.velocity[0] == pytest.approx([-speed, 0], rel=1e-12, abs=1e-12)  # as above
    assert frame.position[0, 0] == pytest.approx(2 * place - speed, rel=1e-9)  # as above


@pytest.mark.parametrize("speed", [10.0, 1e3, 1e6, 1e9])
def test_swept_sees_balls_meet(speed):
    pair = {"material": [{"name": "m"}], "pair": [{"between": ["m", "m"], "restitution": 1.0}]}
    balls = [ball(0, 0, velocity=[speed, 0], material="m"), ball(5, 0, material="m")]
    simulation = running(scene_of(*balls, **pair, solver={"dt": 1.0}), detection="swept")
    simulation.step()
    assert simulation.frame().velocity[:, 0] == pytest.approx([0, speed], abs=1e-9 * speed)  # of equal masses
    assert simulation.frame().position[:, 0] == pytest.approx([4, speed + 1], rel=1e-9)  # where they met, and beyond


def test_swept_meets_one_after_the_other_in_one_step():
    """Between two walls 9 m apart, 8 m of way: 100 m/s for 1 s turns back 12 times and is at 4 m again."""
    walls = [{"points": [[x, -1], [x, 1]], "restitution": 1.0} for x in (0, 9)]
    scene = scene_of(ball(0.5, 0, velocity=[100.0, 0]), wall=walls, solver={"dt": 1.0})
    simulation = running(scene, detection="swept")
    simulation.contacts()
    simulation.step()
    assert len(simulation.contacts()) == 12
    assert simulation.frame().position[0, 0] == pytest.approx(0.5 + 4.0, abs=1e-10)  # a dozen roundings of 100 m
    assert simulation.frame().velocity[0, 0] == 100.0


@pytest.mark.parametrize("radius", [1e-5, 1e-4, 1e-3])
def test_swept_stops_a_grain_that_falls_on_a_thin_shelf(radius):
    """It moves by many times its radius in a step, though hardly faster than gravity makes it in one or two."""
    shelf = {"points": [[-1, 0], [1, 0]]}
    scene = scene_of(ball(0, radius + 5e-4, radius=radius), world=EARTH, wall=[shelf], solver={"dt": 0.01})
    simulation = running(scene, detection="swept")
    for _ in range(20):
        simulation.step()
        assert simulation.frame().position[0, 1] > 0.0


def test_an_impact_just_at_the_end_of_a_step_is_one_while_others_rest():
    scene = scene_of(
        ball(0, 0.4999),
        ball(8.5, 5, velocity=[1.0, 0.0], restitution=1.0),
        plane=[FLOOR],
        wall=[{"points": [[10, 0], [10, 10]], "restitution": 1.0}],
        solver={"dt": 1.0},
    )
    frame = stepped(running(scene, detection="swept"), 2).frame()
    assert frame.position.tolist() == [[0.0, 0.4999], [8.5, 5.0]]
    assert frame.velocity[1].tolist() == [-1.0, 0.0]


@pytest.mark.parametrize("integrator", ["explicit_euler", "velocity_verlet", "rk4"])
@pytest.mark.parametrize("speed", [0.6, -30.0, 100.0])
def test_shrink_moves_nothing_by_more_than_half_the_smallest_radius(integrator, speed):
    """Thrown up so that a step ends near where it began, too: the way counts, not only where it leads."""
    balls = [ball(0, 3, velocity=[0, speed], radius=0.02), ball(2, 3, velocity=[1, 0], radius=0.01)]
    scene = scene_of(*balls, world=EARTH, plane=[FLOOR], solver={"dt": 0.1})
    simulation, ways = running(scene, detection="shrink", integrator=integrator), []
    simulation.watch(lambda time, start, end, pairs: ways.append(float(np.hypot(*(end - start).T).max())))
    stepped(simulation, 2)
    assert max(ways) <= 0.005 * (1 + 1e-12)  # rounding of places of some metres
    assert len(ways) > 3


def test_shrink_cuts_no_step_in_which_little_moves():
    scene = scene_of(ball(0, 3, velocity=[1, 0]), plane=[FLOOR], solver={"dt": 0.01})
    simulation, seen = running(scene, detection="shrink"), []
    simulation.watch(lambda *args: seen.append(args[0]))
    stepped(simulation, 10)
    assert len(seen) == 10


def test_an_exhausted_simulation_can_be_read_and_does_not_go_on():
    scene = scene_of(ball(0, 3, velocity=[1e9, 0]), plane=[FLOOR], solver={"dt": 0.1})
    simulation = running(scene, detection="shrink")
    with pytest.raises(Exhaustion, match="a substep would be divided into 4e\\+08 parts; the limit is 40,000"):
        simulation.step()
    assert simulation.frame().position[0].tolist() == [0, 3]
    with pytest.raises(RuntimeError, match="ended"):
        simulation.step()


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("detection", DETECTIONS)
def test_a_ball_in_a_narrow_wedge_neither_hangs_nor_diverges(detection, e):
    walls = [{"points": [[-0.2, 4], [0, 0], [0.2, 4]], "restitution": e, "friction": 0.1}]
    scene = scene_of(ball(0.003, 3, velocity=[0.3, -5], radius=0.1), world=EARTH, wall=walls, solver={"dt": 0.01})
    simulation = running(scene, detection=detection)
    for _ in range(100):
        simulation.step()
        assert np.hypot(*simulation.frame().velocity[0]) < 12.0  # what a fall from 3 m, and 5 m/s, can give


@pytest.mark.parametrize("gap", [0.0, 1e-12, 1e-6, 1e-3])
@pytest.mark.parametrize("detection", DETECTIONS)
def test_a_ball_that_rattles_between_fixed_ones_stays_between(detection, gap):
    pair = {"material": [{"name": "m"}], "pair": [{"between": ["m", "m"], "restitution": 1.0}]}
    x = 1.0 + gap
    balls = [
        ball(-x, 0, fixed=True, material="m", name="left"),
        ball(0, 0, velocity=[3.0, 0.0], material="m", name="middle"),
        ball(x, 0, fixed=True, material="m", name="right"),
    ]
    simulation = running(scene_of(*balls, **pair, solver={"dt": 0.01}), detection=detection)
    stepped(simulation, 3)
    frame = simulation.frame()
    assert abs(frame.position[1, 0]) < 0.5
    assert np.abs(frame.velocity[1]).max() <= 3.0 * (1 + 1e-12)  # some hundred roundings


def test_past_the_most_impacts_a_step_ends_by_one_discrete_look():
    """A ball that would turn back 3,000 times in a step turns back as often as it may."""
    walls = [{"points": [[x, -1], [x, 1]], "restitution": 1.0} for x in (0, 1.01)]
    scene = scene_of(ball(0.505, 0, velocity=[300.0, 0]), wall=walls, solver={"dt": 0.1})
    simulation, impacts = running(scene, detection="swept"), []
    simulation.watch(lambda *args: impacts.append(args[0]))
    simulation.step()
    assert len(impacts) == MAX_IMPACTS + 1
    assert abs(simulation.frame().velocity[0, 0]) == 300.0


def still_life(*others):
    """A column of three and a lone ball at rest, bouncy ones."""
    balls = [ball(0, 0.4975 + 0.995 * k, name=f"column {k}", material="m") for k in range(3)]
    balls += [ball(3, 0.4975, name="alone", material="m"), *others]
    return scene_of(
        *balls,
        world=EARTH,
        material=[{"name": "m", "restitution": 0.8, "friction": 0.4}],
        plane=[FLOOR],
        solver={"dt": 0.005},
    )


BOUNCING = ball(6, 2.0, name="bouncing", restitution=1.0, friction=0.0)


@pytest.mark.parametrize("detection", DETECTIONS)
@pytest.mark.parametrize("integrator", ["explicit_euler", "semi_implicit_euler", "velocity_verlet"])
def test_what_has_settled_stays_where_it_is(detection, integrator):
    simulation = stepped(running(still_life(), detection=detection, integrator=integrator), 1500)
    before = simulation.frame().position
    stepped(simulation, 1000)
    assert np.abs(simulation.frame().position - before).max() < 1e-9  # m; a settled column moves by rounding
    assert np.abs(simulation.frame().velocity).max() < 1e-9  # m/s, likewise


@pytest.mark.parametrize("detection", DETECTIONS)
def test_what_rests_goes_on_resting_while_something_else_bounces(detection):
    simulation = stepped(running(still_life(BOUNCING), detection=detection), 1500)
    before = simulation.frame().position[:4]
    simulation.contacts()
    fastest = 0.0
    for _ in range(1000):
        simulation.step()
        fastest = max(fastest, float(np.abs(simulation.frame().velocity[:4]).max()))
    # Where a step is cut by an impact, ten iterations leave the column a little short of what carries it.
    assert np.abs(simulation.frame().position[:4] - before).max() < 1e-6
    assert fastest < 0.005  # m/s, as above, for a step: a tenth of what gravity gives in one
    pairs = [tuple(pair) for pair in simulation.contacts().pair.tolist()]
    # What lasts is one row each; the other ball bounced about four times meanwhile.
    assert [pairs.count(pair) for pair in [(0, -1), (0, 1), (1, 2), (3, -1)]] == [1, 1, 1, 1]
    assert pairs.count((4, -1)) >= 3


@pytest.mark.parametrize("detection", ["bisect", "swept"])
def test_a_resting_ball_carries_its_weight_through_anothers_impacts(detection):
    simulation = running(still_life(BOUNCING), detection=detection)
    stepped(simulation, 1500)
    simulation.contacts()
    stepped(simulation, 1000)
    contacts = simulation.contacts()
    (alone,) = contacts.impulse[(contacts.pair == (3, -1)).all(axis=1)]
    assert alone == pytest.approx([0.0, -9.81 * 5.0], rel=1e-9, abs=1e-9)  # 1 kg for 5 s, to how still it is


def test_swept_takes_in_no_polygon_while_it_runs_but_what_meets_nothing():
    simulation = running(scene_of(ball(0, 0, velocity=[1.0, 0.0])), detection="swept")
    box = {"position": (1.0, 0.0), "size": (0.5, 0.5)}
    with pytest.raises(ActionError, match="'swept' supports balls only"):
        simulation.apply(Spawn(time=0.0, box=Box(**box)))
    simulation.apply(Spawn(time=0.0, box=Box(**box, collides="none")))
    assert stepped(simulation, 100).frame().velocity[0].tolist() == [1.0, 0.0]


@pytest.mark.parametrize("integrator", ["velocity_verlet", "semi_implicit_euler", "rk4"])
@pytest.mark.parametrize("size", [[0.6, 0.4], [0.2, 1.5], [2.0, 0.05]])
@pytest.mark.parametrize("tilt", [0.0, 0.2])
@pytest.mark.parametrize("e", [0.0, 0.5, 0.7, 1.0])
def test_a_box_that_falls_flat_stays_flat(e, tilt, size, integrator):
    world = {"gravity": [9.81 * math.sin(tilt), -9.81 * math.cos(tilt)]}
    for ground in ({"plane": [FLOOR]}, {"wall": [{"points": [[-20, 0], [0.1, 0], [20, 0]]}]}):
        box = {"position": [0, 0.5 + size[1]], "size": size, "restitution": e}
        how = {"detection": "bisect", "integrator": integrator, "iterations": 400}
        simulation = running(scene_of(world=world, box=[box], **ground), **how)
        for _ in range(300):
            simulation.step()
            # Impacts are solved to rounding. At rest the passes leave a part of g·h: 2e-11 of it where a box is tall.
            assert abs(simulation.frame().angle[0]) < 1e-9


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_a_box_that_falls_flat_on_a_box_or_a_polygon_stays_flat(e):
    below = {"position": [0, 0.2], "size": [1.0, 0.4], "restitution": e, "fixed": True}
    roof = {"position": [4, 0.2], "points": [[-0.5, -0.2], [0.5, -0.2], [0.5, 0.2], [-0.5, 0.2]], "fixed": True}
    above = [{"position": [x, 1.2], "size": [0.6, 0.4], "restitution": e} for x in (0.0, 4.0)]
    simulation = running(
        scene_of(world=EARTH, box=[below, *above], polygon=[roof]), detection="bisect", integrator="velocity_verlet"
    )
    for _ in range(200):
        simulation.step()
        assert np.abs(simulation.frame().angle).max() < 1e-8  # as above


def test_a_bouncing_box_keeps_its_energy():
    box = {"position": [0, 1.0], "size": [0.6, 0.4], "angle": 0.3, "restitution": 1.0}
    simulation = running(
        scene_of(world=EARTH, box=[box], plane=[FLOOR]), detection="bisect", integrator="velocity_verlet"
    )
    moment = (0.6**2 + 0.4**2) / 12
    energies = []
    for _ in range(300):
        simulation.step()
        f = simulation.frame()
        energies.append(
            0.5 * (f.velocity[0] @ f.velocity[0]) + 0.5 * moment * f.angular_velocity[0] ** 2 + 9.81 * f.position[0, 1]
        )
    assert max(energies) <= energies[0] * (1 + 1e-6)  # an impact is found to 1e-9 of a step, of which g·h·v is gained
    assert energies[-1] == pytest.approx(energies[0], rel=0.01)  # what rests for a step on one corner loses a little
