"""Many bodies: scenes that would take pymunk minutes or hours. Each is refused, or ends in a few seconds."""

import pytest

from tests.hostile.ordeal import INTERPRETER_FLAGS, run_isolated

pytestmark = pytest.mark.nightly  # many bodies


@INTERPRETER_FLAGS
def test_coincident_balls_without_mutual_collisions_are_refused_beyond_a_thousand(flags: tuple[str, ...]) -> None:
    """Pymunk tests every pair: 3,000 balls take two seconds a step, 30,000 take all memory."""
    code = """
def attempt(count):
    plane = {"point": [0, -5], "normal": [0, 1]}
    burst = {"position": [0, 0], "count": count, "velocity_min": [-9, 1], "velocity_max": [9, 9], "collides": "fixed"}
    steps(start(from_document({"plane": [plane], "emitter": [burst]})), 3)
report([outcome(attempt, count) for count in (1_000, 3_000, 1_000_000)])
"""
    assert run_isolated(code, flags) == ["done", "SceneError", "SceneError"]


@INTERPRETER_FLAGS
@pytest.mark.parametrize("spread", [0.0, 0.5])
def test_spawning_onto_one_position_is_refused_at_a_hundred_bodies(spread: float, flags: tuple[str, ...]) -> None:
    code = f"""
simulation = start(from_document({{"ball": [{{"position": [0, 0], "radius": 1}}]}}))
positions = np.random.default_rng(1).uniform(-{spread}, {spread}, (700, 2)).tolist()
found = [outcome(simulation.apply, Spawn(time=0, ball=Ball(position=tuple(at), radius=1.0))) for at in positions]
bodies = len(simulation.bodies)
steps(simulation, 3)
for k in range(2, bodies + 1):
    simulation.apply(Remove(time=0, body=f"spawned-{{k}}"))
simulation.step()
left = int(simulation.frame().present.sum())
report([bodies, found.count("done"), found.count("ActionError"), left, is_finite(simulation)])
"""
    assert run_isolated(code, flags) == [100, 99, 601, 1, True]


@INTERPRETER_FLAGS
def test_moving_onto_one_position_is_refused_at_a_hundred_bodies(flags: tuple[str, ...]) -> None:
    code = """
grid = {"name": "g", "origin": [0, 9], "columns": 300, "spacing": [3, 0], "radius": 1}
simulation = start(from_document({"grid": [grid]}))
moves = [Move(time=0, body=f"g-{k + 1}", position=(0.0, 0.0)) for k in range(300)]
found = [outcome(simulation.apply, move) for move in moves]
steps(simulation, 3)
report([found.count("done"), found.count("ActionError"), is_finite(simulation)])
"""
    assert run_isolated(code, flags) == [100, 200, True]


@INTERPRETER_FLAGS
def test_many_coincident_bodies_can_be_removed_retired_and_freed(flags: tuple[str, ...]) -> None:
    code = """
def burst(bounds, speed):
    return start(from_document({
        "world": {} if bounds is None else {"bounds": bounds},
        "plane": [{"point": [0, -5], "normal": [0, 1]}],
        "grid": [{"name": "g", "origin": [0, 0], "columns": 1_000, "spacing": [0, 0], "radius": 1,
                  "velocity": [speed, 0], "collides": "fixed"}],
    }))
removed = burst(None, 0.0)
removed.step()
for k in range(1_000):
    removed.apply(Remove(time=0, body=f"g-{k + 1}"))
steps(removed, 2)
retired = burst([[-1, -1], [1, 1]], 1e6)
steps(retired, 2)
burst(None, 0.0).step()
report([len(removed.retired), len(retired.retired)])
"""
    assert run_isolated(code, flags) == [1_000, 1_000]


@INTERPRETER_FLAGS
@pytest.mark.parametrize("shape", ["line", "spiral"])
def test_wall_of_a_hundred_thousand_points_is_added_quickly(shape: str, flags: tuple[str, ...]) -> None:
    """A line is sorted, which takes pymunk's tree minutes unless the segments are shuffled."""
    code = f"""
turn = np.arange(100_000) * 1e-3
points = {{
    "line": np.column_stack((turn, 0 * turn)),
    "spiral": np.column_stack((turn * np.cos(turn), turn * np.sin(turn))),
}}[{shape!r}]
simulation = start(from_document({{
    "wall": [{{"points": points.tolist(), "restitution": 0.5}}],
    "ball": [{{"position": [50, 0.3], "velocity": [0, -5], "radius": 0.1}}],
}}))
simulation.contacts()
steps(simulation, 10)
report([is_finite(simulation), len(simulation.contacts())])
"""
    finite, contacts = run_isolated(code, flags)
    assert finite
    assert contacts == (1 if shape == "line" else 0)


@INTERPRETER_FLAGS
@pytest.mark.parametrize("kind", ["plane", "wall", "folded wall", "post", "fixed ball"])
def test_coincident_static_elements_are_refused(kind: str, flags: tuple[str, ...]) -> None:
    """Pymunk's tree adds n equal bounding boxes in O(n²): minutes for 100,000."""
    code = f"""
things = {{
    "plane": {{"plane": [{{"point": [k, 0], "normal": [0, 1 + k]}} for k in range(6_000)]}},
    "wall": {{"wall": [{{"points": [[0, 0], [1, 0]]}} for k in range(6_000)]}},
    "folded wall": {{"wall": [{{"points": [[k % 2, 0] for k in range(100_000)]}}]}},
    "post": {{"post": [{{"position": [0, 0], "radius": 1}} for k in range(6_000)]}},
    "fixed ball": {{"ball": [{{"position": [0, 0], "radius": 1, "fixed": True}} for k in range(6_000)]}},
}}
report(outcome(from_document, things[{kind!r}]))
"""
    assert run_isolated(code, flags) == "SceneError"


@INTERPRETER_FLAGS
def test_too_many_points_too_many_bodies_and_too_many_surfaces_are_refused(flags: tuple[str, ...]) -> None:
    code = """
line = [[k * 0.001, 0] for k in range(100_001)]
emitter = {"position": [0, 0], "count": 1_000_000, "velocity_min": [0, 0], "velocity_max": [1, 1]}
ball = {"position": [0, 0], "radius": 1}
simulation = start(from_document({"ball": [ball]}))
spawns = [
    Spawn(time=0, ball=Ball(position=(3.0 * k, 9.0), radius=1.0, restitution=k / 1000, friction=k / 7))
    for k in range(260)
]
found = [outcome(simulation.apply, spawn) for spawn in spawns]
simulation.step()
full = start(from_document({"emitter": [{**emitter, "count": 999_999}], "ball": [ball]}))
report([
    outcome(from_document, {"wall": [{"points": line}]}),
    outcome(from_document, {"emitter": [emitter], "ball": [ball]}),
    outcome(from_document, {"ball": [{**ball, "position": [3 * k, 0], "friction": k / 7} for k in range(300)]}),
    outcome(from_document, {"ball": [{**ball, "position": [3 * k, 0], "friction": k / 99} for k in range(20_000)]}),
    outcome(full.apply, Spawn(time=0, ball=Ball(position=(0.0, 0.0), radius=1.0))),
    found.count("done"), found.count("ActionError"), is_finite(simulation),
])
"""
    *refused, done, errors, finite = run_isolated(code, flags)
    assert refused == ["SceneError", "SceneError", "SceneError", "SceneError", "ActionError"]
    assert done == 255  # with the surface of the first ball, 256
    assert errors == 5
    assert finite


@INTERPRETER_FLAGS
def test_broad_phase_is_fast_for_particles_and_for_columns_of_two_sizes(flags: tuple[str, ...]) -> None:
    """Testing every pair of particles without contacts, or of bodies in a column, would take minutes."""
    code = """
burst = {"position": [0, 0], "count": 200_000, "velocity_min": [-9, -9], "velocity_max": [9, 9]}
balls = [{"position": [3 * k, 0], "radius": 1, "velocity": [1, 0]} for k in range(5)]
steps(start(from_document({"emitter": [burst], "ball": balls}), "reference"), 2)
sizes = [{"position": [9, 0], "radius": 9}, *({"position": [99 * k, 99], "radius": 1 + k} for k in range(40))]
steps(start(from_document({"emitter": [burst], "ball": sizes}), "reference"), 2)
column = {"origin": [-99, 0], "rows": 60_000, "columns": 1, "spacing": [1, 3], "radius": 1, "velocity_jitter": 9}
steps(start(from_document({"grid": [column], "ball": sizes[:1]}), "reference"), 2)
report("done")
"""
    assert run_isolated(code, flags) == "done"


@INTERPRETER_FLAGS
def test_step_with_too_many_iterations_is_refused_or_ends_the_run(flags: tuple[str, ...]) -> None:
    """Moving all bodies onto one position makes many contacts of few bodies."""
    code = """
import os
grid = {"name": "g", "origin": [0, 0], "columns": 20, "spacing": [3, 0], "radius": 1}
scene = from_document({"grid": [grid], "world": {"duration": 0.1}})
refused = [run(scene, name, iterations=10_000, substeps=1_000).info["reason"] for name in ("pymunk", "reference")]
os.environ["SANDBOX_MAX_STEP_WORK"] = "1000"
actions = [Move(time=0, body=f"g-{k + 1}", position=(0.0, 0.0)) for k in range(20)]
moved = run(scene, "reference", actions=actions)
report([*("set SANDBOX_MAX_STEP_WORK=" in each for each in (*refused, moved.reason)), moved.status])
"""
    assert run_isolated(code, flags) == [True, True, True, "failed"]


@INTERPRETER_FLAGS
def test_hits_of_many_balls_on_a_floor_end_the_run_at_a_limit(flags: tuple[str, ...]) -> None:
    """Each hit tests all pairs in contact and all balls, and one hit causes others."""
    code = """
import os
grid = {"name": "g", "origin": [0, 0], "columns": 20, "rows": 20, "spacing": [0.061, 0.061], "radius": 0.03}
cue = {"position": [-1, 0.5], "radius": 0.03, "velocity": [30, 0]}
scene = from_document({"grid": [grid], "ball": [cue], "surface": {"sliding_friction": 0.2}, "world": {"duration": 0.2}})
whole = run(scene, "pymunk")
os.environ["SANDBOX_MAX_PAIRS"] = "50"
cut = run(scene, "pymunk")
report([whole.status, cut.status, "set SANDBOX_MAX_PAIRS=" in cut.reason])
"""
    assert run_isolated(code, flags, timeout=300.0) == ["ok", "failed", True]


@INTERPRETER_FLAGS
def test_many_attractions_are_refused_and_many_one_way_walls_are_not(flags: tuple[str, ...]) -> None:
    code = """
grid = {"name": "g", "origin": [0, 9], "columns": 20_000, "spacing": [3, 0], "radius": 1}
pulls = [{"toward": [k, 0], "strength": 1} for k in range(20_000)]
scene = from_document({"grid": [grid], "attraction": pulls})
walls = [{"points": [[3 * k, 0], [3 * k + 1, 0]], "one_way": True} for k in range(20_000)]
steps(start(from_document({"grid": [grid], "wall": walls}), "reference"), 2)
report([outcome(start, scene, name) for name in ("pymunk", "reference")])
"""
    assert run_isolated(code, flags) == ["Refusal", "Refusal"]


@INTERPRETER_FLAGS
def test_many_bodies_in_many_zones_are_refused(flags: tuple[str, ...]) -> None:
    code = """
zones = [{"position": [0, 0], "radius": 1e4} for k in range(1_000)]
grid = {"origin": [0, 0], "columns": 1_000, "spacing": [3, 3], "radius": 1}
report([
    outcome(from_document, {"zone": zones, "grid": [{**grid, "rows": 1_000}]}),
    outcome(from_document, {"zone": zones, "grid": [{**grid, "rows": 2}]}),
    outcome(from_document, {"zone": zones[:10], "grid": [{**grid, "rows": 2}]}),
])
"""
    assert run_isolated(code, flags) == ["SceneError", "SceneError", "done"]
