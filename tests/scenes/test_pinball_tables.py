"""The shipped pinball tables: reachable regions, plunger, flippers, bumpers, slingshots, ramps, resting positions."""

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
import shapely
import shapely.affinity
from shapely import LineString, Point, Polygon, unary_union

from sandbox.action import Drive, Toggle
from sandbox.engines.common.restitution import rebound
from sandbox.engines.registry import start
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import GROUND
from sandbox.scene.description.forces import PlungerDrive
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from tests.engines.stepping import advance

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

TABLES = ("pinball/classic", "pinball/full")
RADIUS = 0.01349
GEOMETRY_ERROR = 2e-4
"""m, more than the summed errors of flattened arcs and of shapely's polygonal discs."""
BOTTOM = 0.09
"""m; a ball below is drained, on both tables."""

every_table = pytest.mark.parametrize("name", TABLES)


@cache
def table(name: str) -> Scene:
    return load(find(name))


def part_names(scene: Scene, role: str) -> list[str]:
    return [each.name for each in scene.play.parts if each.role == role]


@cache
def solid(name: str, layer: str = GROUND) -> Polygon:
    """Return the region of walls and posts in a layer, without one-way gates; m."""
    scene = table(name)
    walls = [
        LineString((*wall.points, wall.points[0]) if wall.closed else wall.points).buffer(0.5 * wall.thickness)
        for wall in scene.walls
        if layer in wall.layers and not wall.one_way
    ]
    posts = [Point(post.position).buffer(post.radius, 64) for post in scene.posts if layer in post.layers]
    return unary_union(walls + posts)


@cache
def reachable(name: str) -> Polygon:
    """Return the region that the centre of a ball can reach from the plunger; m."""
    scene = table(name)
    blocked = solid(name).buffer(RADIUS - GEOMETRY_ERROR, 64)
    free = shapely.box(-0.1, 0.0, 0.7, 1.2).difference(blocked)
    lane = next(each.at for each in scene.play.parts if each.role == "plunger")
    (region,) = [each for each in getattr(free, "geoms", [free]) if each.contains(Point(lane))]
    return region


def shot(name: str, position: tuple[float, float], velocity: tuple[float, float], *overrides: str) -> Any:
    """Start a ball at a position on a table; return the simulation and the index of the ball."""
    scene = load(find(name), [f"ball.ball.position={[*position]}", f"ball.ball.velocity={[*velocity]}", *overrides])
    return start(scene, "pymunk", scene.solver), scene.bodies.names.index("ball")


def path_of(simulation: Any, index: int, seconds: float) -> np.ndarray[Any, Any]:
    """Return x, y, vx, vy of a ball after each step, (T, 4) m and m/s."""
    rows = []
    for _ in range(round(seconds / 0.01)):
        simulation.step()
        frame = simulation.frame()
        rows.append((*frame.position[index], *frame.velocity[index]))
    return np.asarray(rows)


@every_table
def test_ball_can_reach_every_lane_and_the_drain_and_stays_in_the_cabinet(name: str) -> None:
    scene, free = table(name), reachable(name)
    cabinet = next(Polygon(wall.points) for wall in scene.walls if wall.name == "cabinet")
    assert cabinet.contains(free)
    zones = {zone.name: zone for zone in scene.zones}
    for each in (*part_names(scene, "rollover"), *part_names(scene, "kicker")):
        position = zones[each].position
        assert position is not None
        assert free.contains(Point(position)), each
    for each in (*part_names(scene, "drain"), *part_names(scene, "spinner")):
        points = zones[each].points
        assert points is not None
        assert free.intersects(LineString(points)), each


@every_table
def test_ball_can_touch_everything_that_scores(name: str) -> None:
    scene, free = table(name), reachable(name).buffer(RADIUS + 2.0 * GEOMETRY_ERROR)
    walls = {wall.name: LineString(wall.points).buffer(0.5 * wall.thickness) for wall in scene.walls}
    posts = {post.name: Point(post.position).buffer(post.radius) for post in scene.posts}
    for role in ("bumper", "slingshot", "standup", "drop"):
        for each in part_names(scene, role):
            assert free.intersects(walls.get(each, posts.get(each))), each


@every_table
def test_lower_third_is_symmetric(name: str) -> None:
    scene = table(name)
    axis = float(np.mean([body.position[0] for body in scene.polygons if str(body.name).endswith("flipper")]))
    low = shapely.box(0.0, 0.12, 2.0 * axis, 0.4)
    shape = solid(name).intersection(low)
    flipped = shapely.transform(shape, lambda points: points * (-1.0, 1.0) + (2.0 * axis, 0.0))
    # the faces of cabinet and lane are at equal distances from the axis; 1e-6 m²: rounding of polygons
    assert shape.symmetric_difference(flipped).area < 1e-6


@every_table
def test_ball_rolls_down_the_slope_as_a_sphere_does(name: str) -> None:
    simulation, ball = shot(name, (0.494, 0.5), (0.0, 0.0))
    (x, y, _, vy) = path_of(simulation, ball, 0.5)[-1]
    simulation.close()
    # energy of a rolling sphere: m g s sin θ = ½ m v² (1 + 2/5)
    speed = math.sqrt(10.0 / 7.0 * 9.81 * (0.5 - y) * math.sin(0.11345))
    assert abs(vy) == pytest.approx(speed, rel=3e-3)  # first-order scheme: h/t = 0.002
    assert x == pytest.approx(0.494, abs=1e-9)


@every_table
@pytest.mark.parametrize("pull", [0.3, 0.7, 1.0])
def test_strong_plunge_passes_the_arch_and_a_weak_one_returns(name: str, pull: float) -> None:
    scene = table(name)
    (drive,) = [drive for drive in scene.drives if isinstance(drive, PlungerDrive)]
    simulation, ball = start(scene, "pymunk", scene.solver), scene.bodies.names.index("ball")
    path_of(simulation, ball, 0.2)
    simulation.apply(Drive(time=0.2, drive="plunger", level=pull))
    path_of(simulation, ball, 1.2)
    simulation.apply(Drive(time=1.4, drive="plunger", level=0.0))
    path = path_of(simulation, ball, 2.0)
    simulation.close()
    speed = pull * drive.speed
    assert path[:, 3].max() == pytest.approx(speed, rel=0.02)  # gravity takes 0.8 % per step at a pull of 0.3
    if pull > 0.5:
        assert path[:, 1].max() > 1.04  # the arch's top is at 1.062, the ball's centre a radius below
        assert path[:, 0].min() < 0.05  # then reaches the left side
    else:
        assert path[:, 0].min() > 0.476  # never leaves the lane
        # ½ v² / a above the release; 5 mm: the ball moves 2 mm in a step and rests above the tip
        assert path[:, 1].max() == pytest.approx(0.1136 + 0.5 * speed**2 / 0.7933, abs=5e-3)


@pytest.mark.parametrize("side", ["left", "right"])
@every_table
def test_flipper_turns_to_its_raised_stop_and_back(name: str, side: str) -> None:
    scene = table(name)
    simulation, flipper = start(scene, "pymunk", scene.solver), scene.bodies.names.index(f"{side} flipper")
    rest, raised = (-0.541, 0.349) if side == "left" else (math.pi + 0.541, math.pi - 0.349)
    assert scene.bodies.angle[flipper] == pytest.approx(rest, abs=1e-12)
    simulation.apply(Drive(time=0.0, drive=f"{side} flipper", level=1.0))
    advance(simulation, 10)
    assert simulation.frame().angle[flipper] == pytest.approx(raised, abs=0.01)  # settled: a stroke takes 34 ms
    simulation.apply(Drive(time=0.1, drive=f"{side} flipper", level=0.0))
    advance(simulation, 30)
    assert simulation.frame().angle[flipper] == pytest.approx(rest, abs=0.01)  # the return takes 118 ms
    simulation.close()


@every_table
def test_gate_stops_a_ball_from_above(name: str) -> None:
    simulation, ball = shot(name, (0.485, 0.87), (0.0, -0.5))
    path = path_of(simulation, ball, 2.0)
    simulation.close()
    assert not ((path[:, 0] > 0.476) & (path[:, 1] < 0.79)).any()
    assert path[-1, 0] < 0.476


@every_table
@pytest.mark.parametrize("speed", [0.2, 1.0, 3.0])
def test_bumper_adds_its_kick_speed_to_the_rebound(name: str, speed: float) -> None:
    scene = table(name)
    post = next(post for post in scene.posts if post.name == "middle bumper")
    (x, y), distance = post.position, post.radius + RADIUS + 0.002
    simulation, ball = shot(name, (x, y - distance), (0.0, speed), "world.gravity=[0.0, 0.0]")
    path = path_of(simulation, ball, 0.03)
    simulation.close()
    assert path[-1, 3] == pytest.approx(-(0.3 * speed + 0.81), rel=1e-9)
    assert path[-1, 2] == pytest.approx(0.0, abs=1e-9)


@every_table
@pytest.mark.parametrize("fraction", [0.25, 0.5, 0.75])
def test_slingshot_kick_has_a_parabolic_profile(name: str, fraction: float) -> None:
    scene = table(name)
    face = next(wall for wall in scene.walls if wall.name == "left slingshot")
    a, b = np.asarray(face.points)
    along = (b - a) / np.hypot(*(b - a))
    out = np.array([-along[1], along[0]]) if along[1] < 0.0 else np.array([along[1], -along[0]])
    x, y = (a + fraction * (b - a) + out * (0.5 * face.thickness + RADIUS + 0.001)).tolist()
    u, v = (-0.5 * out).tolist()
    simulation, ball = shot(name, (x, y), (u, v), "world.gravity=[0.0, 0.0]")
    path = path_of(simulation, ball, 0.03)
    simulation.close()
    exit_speed = float(path[-1, 2:] @ out)
    expected = rebound(0.8, 0.3, 0.5 + 2.16 * 4.0 * fraction * (1.0 - fraction))
    assert exit_speed == pytest.approx(expected, rel=2e-3)  # the contact point is that of a substep later


@pytest.mark.parametrize(("fraction", "made"), [(0.6, False), (0.9, False), (1.4, True), (2.5, True), (4.0, True)])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_ramp_carries_only_a_fast_enough_ball_to_its_exit(fraction: float, made: bool, side: float) -> None:
    scene = table("pinball/full")
    ramp = "left ramp" if side < 0.0 else "right ramp"
    rails = [np.asarray(wall.points) for wall in scene.walls if str(wall.name).startswith(ramp) and ramp in wall.layers]
    mouth = 0.5 * (rails[0][0] + rails[1][0])
    along = rails[0][1] - rails[0][0]
    along /= np.hypot(*along)
    x, y = (mouth - 0.02 * along).tolist()
    # Energy: ½ v² = (5/7) g (sin θ · height + rise) from there to the top of the turn along its outer rail.
    height = max(rail[:, 1].max() for rail in rails) - RADIUS - y
    needed = math.sqrt(10.0 / 7.0 * 9.81 * (math.sin(0.11345) * height + 0.03))
    u, v = (fraction * needed * along).tolist()
    simulation, _ = shot("pinball/full", (x, y), (u, v))
    simulation.contacts()  # recording starts at the first call
    touched = set[str]()
    for _ in range(300):
        simulation.step()
        touched |= {scene.fixed_names[-1 - other] for _, other in simulation.contacts().pair.tolist() if other < 0}
    simulation.close()
    assert ramp in touched
    assert (f"{ramp} exit" in touched) == made
    if not made:
        assert f"{ramp} foot" in touched


@pytest.mark.parametrize("up", [True, False])
def test_dropped_target_lets_the_ball_pass_to_the_wall_behind(up: bool) -> None:
    scene = table("pinball/full")
    target = next(wall for wall in scene.walls if wall.name == "left drops 2")
    middle = np.mean(target.points, axis=0)
    out = np.array([-0.462, -0.8868])  # normal of the bank
    (x, y), (u, v) = (middle + 0.03 * out).tolist(), (-2.0 * out).tolist()
    simulation, _ = shot("pinball/full", (x, y), (u, v))
    simulation.contacts()
    simulation.apply(Toggle(time=0.0, thing="left drops 2", solid=up))
    touched = set[str]()
    for _ in range(4):
        simulation.step()
        touched |= {scene.fixed_names[-1 - other] for _, other in simulation.contacts().pair.tolist() if other < 0}
    simulation.close()
    assert touched & {"left drops 2", "left roof"} == ({"left drops 2"} if up else {"left roof"})


@pytest.mark.nightly
@every_table
def test_ball_dropped_anywhere_reaches_the_drain_or_a_holding_zone(name: str) -> None:
    scene = table(name)
    positions = free_positions(name)
    document = to_document(scene)
    document["ball"] = [
        # they collide with fixed elements, not with each other
        {"position": position, "radius": RADIUS, "mass": 0.08, "material": "steel", "collides": "fixed"}
        for position in positions
    ]
    document["play"] = {}
    document["world"]["bounds"] = [[-0.05, BOTTOM], [0.57, 1.12]]
    dropped = from_document(document)
    simulation = start(dropped, "pymunk", dropped.solver)
    frame = advance(simulation, 2500).frame()
    simulation.close()
    count = len(positions)
    holes = [zone.position for zone in scene.zones if zone.holds]
    for k in np.flatnonzero(frame.present[:count]):
        (x, y), speed = frame.position[k], math.hypot(*frame.velocity[k])
        held = any(hole is not None and math.dist((x, y), hole) < 1e-6 for hole in holes)
        in_lane = x > 0.476 and y < 0.13
        assert held or in_lane or speed > 0.02, (positions[k], (x, y))
    assert count > 300
    assert np.count_nonzero(frame.present[:count]) < 0.1 * count


def free_positions(name: str) -> list[list[float]]:
    """Return free positions of a ball all over a table, m: a grid with random offsets, to avoid unstable equilibria."""
    scene, random, pitch = table(name), np.random.default_rng(1), 0.02
    flippers = []
    for body in scene.polygons:
        turn = shapely.affinity.rotate(Polygon(body.points), body.angle, origin=(0.0, 0.0), use_radians=True)
        flippers.append(shapely.affinity.translate(turn, *body.position))
    blocked = unary_union([solid(name), *flippers, *(LineString(w.points) for w in scene.walls if w.one_way)])
    free = reachable(name).difference(blocked.buffer(RADIUS + GEOMETRY_ERROR))
    grid = np.stack(np.meshgrid(np.arange(0.01, 0.51, pitch), np.arange(0.12, 1.06, pitch)), axis=-1).reshape(-1, 2)
    jittered = grid + random.uniform(-0.5, 0.5, grid.shape) * pitch
    return [[x, y] for x, y in jittered.tolist() if free.contains(Point(x, y))]
