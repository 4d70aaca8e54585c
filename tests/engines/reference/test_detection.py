"""Detection: times of impact, tunnelling, and stability of resting bodies."""

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
from tests.engines.builders import EARTH, FLOOR, ball, scene_of, shipped, simulation_of
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # hundreds of combinations

NON_CONTINUOUS, CONTINUOUS = ["discrete", "bisect"], ["swept", "shrink"]


@given(st.floats(0.05, 3), st.floats(-2, 2), st.floats(0.003, 0.05))
def test_bisect_finds_the_time_of_a_bounce(height, speed, dt):
    scene = scene_of(
        ball(0, 0.5 + height, velocity=[0, speed], restitution=0.8), world=EARTH, plane=[FLOOR], solver={"dt": dt}
    )
    simulation = simulation_of(scene, detection="bisect", integrator="velocity_verlet")
    simulation.contacts()
    landing = (speed + math.sqrt(speed * speed + 2 * 9.81 * height)) / 9.81
    advance(simulation, math.ceil(landing / dt) + 1)
    found = simulation.contacts().time[0]
    assert found == pytest.approx(landing, abs=1e-8)  # 1e-9 of a step, plus rounding of the drop divided by the speed
    down = math.sqrt(speed * speed + 2 * 9.81 * height)
    since = simulation.time - landing
    expected = 0.8 * down - 9.81 * since
    if expected > 0:  # still rising
        assert simulation.frame().velocity[0, 1] == pytest.approx(expected, abs=1e-7)  # as above, times g and e


@given(st.floats(0.5, 3), st.floats(0.003, 0.05))
def test_swept_finds_the_impact_along_the_chord_of_the_step(height, dt):
    scene = scene_of(ball(0, 0.5 + height, restitution=0.8), world=EARTH, plane=[FLOOR], solver={"dt": dt})
    simulation = simulation_of(scene, detection="swept", integrator="velocity_verlet")
    simulation.contacts()
    landing = math.sqrt(2 * height / 9.81)
    advance(simulation, math.ceil(landing / dt) + 1)
    # A chord deviates from the parabola by at most g·h²/8, which the ball covers at this speed.
    bound = 9.81 * dt * dt / 8 / (9.81 * (landing - dt))
    assert abs(simulation.contacts().time[0] - landing) <= bound * 1.01 + 1e-9


def test_bounce_errors_match_the_documented_accuracy():
    """Bisection is accurate to rounding; the chord of a step deviates from the path by g·h²/8: second order."""
    scene = shipped("tutorial/bounce")
    truth = run(scene, "exact").position

    def error(detection, substeps):
        found = run(scene, "reference", integrator="velocity_verlet", detection=detection, substeps=substeps)
        return float(np.abs(found.position - truth).max())

    assert error("bisect", 1) < 2e-11  # m; measured 1.1e-11: 1e-9 of a step at some 10 m/s
    coarse, fine = error("swept", 1), error("swept", 2)
    assert 2e-6 < coarse < 4e-6  # m; measured 3.1e-6
    assert math.log2(coarse / fine) == pytest.approx(2.0, abs=0.2)  # measured 1.99


def test_fast_ball_of_the_tutorial_bounces_within_its_first_step():
    simulation = simulation_of(shipped("tutorial/fast_ball"), detection="swept")
    simulation.contacts()
    simulation.step()
    contacts = simulation.contacts()
    assert contacts.time == pytest.approx([0.045], rel=1e-14)  # 4.5 m at 100 m/s
    assert simulation.frame().position[0, 1] == pytest.approx(0.5 + 5.5, rel=1e-12)  # moves up for the rest of the step


DISTANCE = 0.01 + 0.02 / 2  # m, between the centre of the bullet and the middle of the wall at contact: r + w/2


def shot(detection, travel, lead=1e-6, **settings):
    """Shoot a bullet that moves `travel` m a step and ends a step `lead` m before contact.

    Return its farthest x and its final velocity in x. Discrete detection finds the contact if a step ends with the
    centre within the last r + w/2 before the middle of the wall; beyond the middle the bullet is pushed out on the
    other side. So it tunnels if v·h > r + w/2.
    """
    dt = travel / 100.0
    start_x = 1.0 - DISTANCE - lead - 3 * travel
    bullet = {"name": "bullet", "position": [start_x, 0.0], "velocity": [100.0, 0.0], "radius": 0.01, "mass": 0.01}
    wall = {"points": [[1.0, -1.0], [1.0, 1.0]], "thickness": 0.02, "restitution": 0.5}
    simulation = simulation_of(scene_of(bullet, wall=[wall], solver={"dt": dt}), detection=detection, **settings)
    farthest = start_x
    for _ in range(8):
        simulation.step()
        farthest = max(farthest, float(simulation.frame().position[0, 0]))
    return farthest, float(simulation.frame().velocity[0, 0])


@pytest.mark.parametrize("fraction", [0.5, 0.99])
@pytest.mark.parametrize("detection", DETECTIONS)
def test_no_detection_tunnels_if_the_travel_per_step_is_below_the_contact_distance(detection, fraction):
    farthest, speed = shot(detection, fraction * DISTANCE)
    assert farthest < 1.0
    assert speed == pytest.approx(-50.0, rel=1e-12)  # some roundings


@pytest.mark.parametrize("fraction", [1.01, 100.0])
@pytest.mark.parametrize("detection", NON_CONTINUOUS)
def test_detection_at_the_end_of_a_step_tunnels_above_the_contact_distance(detection, fraction):
    farthest, speed = shot(detection, fraction * DISTANCE)
    assert farthest > 1.0
    assert speed == 100.0


@pytest.mark.parametrize(
    ("detection", "fraction"),
    [(detection, fraction) for detection in CONTINUOUS for fraction in (1.01, 10.0)] + [("swept", 1e4)],
)
@pytest.mark.parametrize("integrator", ["explicit_euler", "semi_implicit_euler", "rk4"])
def test_swept_and_shrink_stop_the_bullet_at_every_speed(detection, fraction, integrator):
    farthest, speed = shot(detection, fraction * DISTANCE, integrator=integrator)
    assert farthest <= 1.0 - DISTANCE / 4  # shrink: at most half a radius deep
    assert speed == pytest.approx(-50.0, rel=1e-12)  # some roundings


OBSTACLES = {
    "thin wall": ({"wall": [{"points": [[5, -1], [5, 1]], "restitution": 1.0}]}, 4.5),
    "wall's end": ({"wall": [{"points": [[5, 0], [9, 0]], "restitution": 1.0}]}, 4.5),
    "post": ({"post": [{"position": [5, 0], "radius": 0.25, "restitution": 1.0}]}, 4.25),
    "plane": ({"plane": [{"point": [5, 0], "normal": [-1, 0], "restitution": 1.0}]}, 4.5),
}


@pytest.mark.parametrize("speed", [10.0, 1e9])
@pytest.mark.parametrize("name", OBSTACLES)
def test_swept_bounces_off_every_kind_of_static_shape(name, speed):
    obstacle, contact_x = OBSTACLES[name]
    scene = scene_of(ball(0, 0, velocity=[speed, 0], restitution=1.0), **obstacle, solver={"dt": 1.0})
    simulation = simulation_of(scene, detection="swept")
    simulation.contacts()
    simulation.step()
    assert simulation.contacts().time == pytest.approx([contact_x / speed], rel=1e-12)  # some roundings
    frame = simulation.frame()
    assert frame.velocity[0] == pytest.approx([-speed, 0], rel=1e-12, abs=1e-12)  # as above
    assert frame.position[0, 0] == pytest.approx(2 * contact_x - speed, rel=1e-9)  # as above


@pytest.mark.parametrize("speed", [10.0, 1e9])
def test_swept_detects_a_collision_of_two_balls(speed):
    pair = {"material": [{"name": "m"}], "pair": [{"between": ["m", "m"], "restitution": 1.0}]}
    balls = [ball(0, 0, velocity=[speed, 0], material="m"), ball(5, 0, material="m")]
    simulation = simulation_of(scene_of(*balls, **pair, solver={"dt": 1.0}), detection="swept")
    simulation.step()
    # equal masses exchange velocities
    assert simulation.frame().velocity[:, 0] == pytest.approx([0, speed], abs=1e-9 * speed)
    # at and beyond the point of impact
    assert simulation.frame().position[:, 0] == pytest.approx([4, speed + 1], rel=1e-9)


def test_swept_resolves_successive_impacts_within_one_step():
    """Two walls 9 m apart leave 8 m of travel: at 100 m/s for 1 s the ball bounces 12 times and ends 4 m on."""
    walls = [{"points": [[x, -1], [x, 1]], "restitution": 1.0} for x in (0, 9)]
    scene = scene_of(ball(0.5, 0, velocity=[100.0, 0]), wall=walls, solver={"dt": 1.0})
    simulation = simulation_of(scene, detection="swept")
    simulation.contacts()
    simulation.step()
    assert len(simulation.contacts()) == 12
    assert simulation.frame().position[0, 0] == pytest.approx(0.5 + 4.0, abs=1e-10)  # a dozen roundings of 100 m
    assert simulation.frame().velocity[0, 0] == 100.0


@pytest.mark.parametrize("radius", [1e-5, 1e-4, 1e-3])
def test_swept_stops_a_grain_that_falls_on_a_thin_shelf(radius):
    """It moves many times its radius in a step, at the speed that gravity gives it within one or two steps."""
    shelf = {"points": [[-1, 0], [1, 0]]}
    scene = scene_of(ball(0, radius + 5e-4, radius=radius), world=EARTH, wall=[shelf], solver={"dt": 0.01})
    simulation = simulation_of(scene, detection="swept")
    for _ in range(20):
        simulation.step()
        assert simulation.frame().position[0, 1] > 0.0


def test_impact_at_the_end_of_a_step_is_resolved_while_another_ball_rests():
    scene = scene_of(
        ball(0, 0.4999),
        ball(8.5, 5, velocity=[1.0, 0.0], restitution=1.0),
        plane=[FLOOR],
        wall=[{"points": [[10, 0], [10, 10]], "restitution": 1.0}],
        solver={"dt": 1.0},
    )
    frame = advance(simulation_of(scene, detection="swept"), 2).frame()
    assert frame.position.tolist() == [[0.0, 0.4999], [8.5, 5.0]]
    assert frame.velocity[1].tolist() == [-1.0, 0.0]


@pytest.mark.parametrize("integrator", ["explicit_euler", "velocity_verlet", "rk4"])
@pytest.mark.parametrize("speed", [0.6, -30.0, 100.0])
def test_shrink_limits_travel_per_substep_to_half_the_smallest_radius(integrator, speed):
    """Includes a ball whose step ends near its start: the path length counts, not only the displacement."""
    balls = [ball(0, 3, velocity=[0, speed], radius=0.02), ball(2, 3, velocity=[1, 0], radius=0.01)]
    scene = scene_of(*balls, world=EARTH, plane=[FLOOR], solver={"dt": 0.1})
    simulation, travels = simulation_of(scene, detection="shrink", integrator=integrator), []
    simulation.watch(lambda time, start, end, pairs: travels.append(float(np.hypot(*(end - start).T).max())))
    advance(simulation, 2)
    assert max(travels) <= 0.005 * (1 + 1e-12)  # rounding of coordinates of some metres
    assert len(travels) > 3


def test_shrink_does_not_subdivide_steps_with_little_motion():
    scene = scene_of(ball(0, 3, velocity=[1, 0]), plane=[FLOOR], solver={"dt": 0.01})
    simulation, times = simulation_of(scene, detection="shrink"), []
    simulation.watch(lambda *args: times.append(args[0]))
    advance(simulation, 10)
    assert len(times) == 10


def test_exhausted_simulation_can_be_read_but_not_stepped():
    scene = scene_of(ball(0, 3, velocity=[1e9, 0]), plane=[FLOOR], solver={"dt": 0.1})
    simulation = simulation_of(scene, detection="shrink")
    with pytest.raises(Exhaustion, match="a substep would be divided into 4e\\+08 parts; the limit is 40,000"):
        simulation.step()
    assert simulation.frame().position[0].tolist() == [0, 3]
    with pytest.raises(RuntimeError, match="ended"):
        simulation.step()


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("detection", DETECTIONS)
def test_ball_in_a_narrow_wedge_neither_hangs_nor_diverges(detection, e):
    walls = [{"points": [[-0.2, 4], [0, 0], [0.2, 4]], "restitution": e, "friction": 0.1}]
    scene = scene_of(ball(0.003, 3, velocity=[0.3, -5], radius=0.1), world=EARTH, wall=walls, solver={"dt": 0.01})
    simulation = simulation_of(scene, detection=detection)
    for _ in range(100):
        simulation.step()
        assert np.hypot(*simulation.frame().velocity[0]) < 12.0  # bound for a fall from 3 m with 5 m/s


@pytest.mark.parametrize("gap", [0.0, 1e-12, 1e-6, 1e-3])
@pytest.mark.parametrize("detection", DETECTIONS)
def test_ball_that_rattles_between_fixed_balls_stays_between_them(detection, gap):
    pair = {"material": [{"name": "m"}], "pair": [{"between": ["m", "m"], "restitution": 1.0}]}
    x = 1.0 + gap
    balls = [
        ball(-x, 0, fixed=True, material="m", name="left"),
        ball(0, 0, velocity=[3.0, 0.0], material="m", name="middle"),
        ball(x, 0, fixed=True, material="m", name="right"),
    ]
    simulation = simulation_of(scene_of(*balls, **pair, solver={"dt": 0.01}), detection=detection)
    advance(simulation, 3)
    frame = simulation.frame()
    assert abs(frame.position[1, 0]) < 0.5
    assert np.abs(frame.velocity[1]).max() <= 3.0 * (1 + 1e-12)  # some hundred roundings


def test_step_beyond_the_impact_limit_ends_with_one_discrete_detection():
    """A ball that would bounce 3,000 times in a step bounces MAX_IMPACTS times."""
    walls = [{"points": [[x, -1], [x, 1]], "restitution": 1.0} for x in (0, 1.01)]
    scene = scene_of(ball(0.505, 0, velocity=[300.0, 0]), wall=walls, solver={"dt": 0.1})
    simulation, impacts = simulation_of(scene, detection="swept"), []
    simulation.watch(lambda *args: impacts.append(args[0]))
    simulation.step()
    assert len(impacts) == MAX_IMPACTS + 1
    assert abs(simulation.frame().velocity[0, 0]) == 300.0


def resting_scene(*others):
    """Return a scene with a column of three balls and a lone ball, all bouncy."""
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
def test_settled_bodies_do_not_move(detection, integrator):
    simulation = advance(simulation_of(resting_scene(), detection=detection, integrator=integrator), 1500)
    before = simulation.frame().position
    advance(simulation, 1000)
    assert np.abs(simulation.frame().position - before).max() < 1e-9  # m; a settled column moves by rounding
    assert np.abs(simulation.frame().velocity).max() < 1e-9  # m/s, likewise


@pytest.mark.parametrize("detection", DETECTIONS)
def test_resting_bodies_stay_at_rest_while_another_bounces(detection):
    simulation = advance(simulation_of(resting_scene(BOUNCING), detection=detection), 1500)
    before = simulation.frame().position[:4]
    simulation.contacts()
    fastest = 0.0
    for _ in range(1000):
        simulation.step()
        fastest = max(fastest, float(np.abs(simulation.frame().velocity[:4]).max()))
    # In a step that an impact divides, ten iterations leave the column slightly short of its support.
    assert np.abs(simulation.frame().position[:4] - before).max() < 1e-6
    assert fastest < 0.005  # m/s, as above, for one step: a tenth of what gravity adds in a step
    pairs = [tuple(pair) for pair in simulation.contacts().pair.tolist()]
    # Each lasting contact has one row; the other ball bounces about four times.
    assert [pairs.count(pair) for pair in [(0, -1), (0, 1), (1, 2), (3, -1)]] == [1, 1, 1, 1]
    assert pairs.count((4, -1)) >= 3


@pytest.mark.parametrize("detection", ["bisect", "swept"])
def test_support_impulse_of_a_resting_ball_is_its_weight_during_impacts_of_another(detection):
    simulation = simulation_of(resting_scene(BOUNCING), detection=detection)
    advance(simulation, 1500)
    simulation.contacts()
    advance(simulation, 1000)
    contacts = simulation.contacts()
    (alone,) = contacts.impulse[(contacts.pair == (3, -1)).all(axis=1)]
    # weight of 1 kg over 5 s, up to its residual motion
    assert alone == pytest.approx([0.0, -9.81 * 5.0], rel=1e-9, abs=1e-9)


def test_swept_refuses_to_spawn_a_polygon_unless_it_collides_with_nothing():
    simulation = simulation_of(scene_of(ball(0, 0, velocity=[1.0, 0.0])), detection="swept")
    box = {"position": (1.0, 0.0), "size": (0.5, 0.5)}
    with pytest.raises(ActionError, match="'swept' supports balls only"):
        simulation.apply(Spawn(time=0.0, box=Box(**box)))
    simulation.apply(Spawn(time=0.0, box=Box(**box, collides="none")))
    assert advance(simulation, 100).frame().velocity[0].tolist() == [1.0, 0.0]


@pytest.mark.parametrize(
    ("e", "tilt", "size", "integrator"),
    [
        (0.0, 0.0, [0.6, 0.4], "velocity_verlet"), (0.5, 0.2, [0.6, 0.4], "rk4"),
        (0.7, 0.2, [0.2, 1.5], "semi_implicit_euler"), (1.0, 0.0, [0.2, 1.5], "velocity_verlet"),
        (0.5, 0.0, [2.0, 0.05], "semi_implicit_euler"), (1.0, 0.2, [2.0, 0.05], "velocity_verlet"),
    ],
)  # fmt: skip
def test_box_that_lands_flat_stays_flat(e, tilt, size, integrator):
    world = {"gravity": [9.81 * math.sin(tilt), -9.81 * math.cos(tilt)]}
    for ground in ({"plane": [FLOOR]}, {"wall": [{"points": [[-20, 0], [0.1, 0], [20, 0]]}]}):
        box = {"position": [0, 0.5 + size[1]], "size": size, "restitution": e}
        how = {"detection": "bisect", "integrator": integrator, "iterations": 400}
        simulation = simulation_of(scene_of(world=world, box=[box], **ground), **how)
        for _ in range(300):
            simulation.step()
            # Impacts are solved to rounding. At rest the iterations leave a residue of g·h: 2e-11 of it for a tall box.
            assert abs(simulation.frame().angle[0]) < 1e-9


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_box_that_lands_flat_on_a_box_or_a_polygon_stays_flat(e):
    below = {"position": [0, 0.2], "size": [1.0, 0.4], "restitution": e, "fixed": True}
    roof = {"position": [4, 0.2], "points": [[-0.5, -0.2], [0.5, -0.2], [0.5, 0.2], [-0.5, 0.2]], "fixed": True}
    above = [{"position": [x, 1.2], "size": [0.6, 0.4], "restitution": e} for x in (0.0, 4.0)]
    simulation = simulation_of(
        scene_of(world=EARTH, box=[below, *above], polygon=[roof]), detection="bisect", integrator="velocity_verlet"
    )
    for _ in range(200):
        simulation.step()
        assert np.abs(simulation.frame().angle).max() < 1e-8  # as above


def test_bouncing_elastic_box_conserves_energy():
    box = {"position": [0, 1.0], "size": [0.6, 0.4], "angle": 0.3, "restitution": 1.0}
    simulation = simulation_of(
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
    assert max(energies) <= energies[0] * (1 + 1e-6)  # an impact is found to 1e-9 of a step, which gains up to g·h·v
    assert energies[-1] == pytest.approx(energies[0], rel=0.01)  # resting on one corner for a step loses a little
