"""Scenes at the limits of valid values: they run, diverge with a reason, or are refused."""

import pytest

from tests.hostile.ordeal import INTERPRETER_FLAGS, run_isolated

pytestmark = pytest.mark.full  # fuzzing and inputs at the ends of their ranges

CASES: dict[str, tuple[str, str]] = {
    "radius 1e-9 beside 1e9": (
        '{"ball": [ball(0, radius=1e-9), ball(2e9, radius=1e9), ball(0, y=5, radius=1e-9)], "world": down}',
        "done",
    ),
    "radius 1e-9 hits 1e9": (
        '{"ball": [ball(0, radius=1e-9, velocity=[1e9, 0], restitution=1), ball(1e9 + 1, radius=1e9, restitution=1)]}',
        "done",
    ),
    "mass 1e-15 hits 1e30": (
        '{"ball": [ball(0, mass=1e-15, velocity=[9, 0], restitution=1), ball(3, mass=1e30, restitution=1)]}',
        "done",
    ),
    "mass 1e30 hits 1e-15": (
        '{"ball": [ball(0, mass=1e30, velocity=[9, 0], restitution=1), ball(3, mass=1e-15, restitution=1)]}',
        "done",
    ),
    "mass 1e-15 under 1e30": (
        '{"world": down, "plane": [floor], "ball": [ball(0, y=1, mass=1e-15), ball(0, y=3, mass=1e30)]}',
        "done",
    ),
    "plane at 1e15": (
        '{"world": down, "plane": [{"point": [1e15, 1e15], "normal": [0, 1]}], "ball": [ball(1e15, y=1e15 + 2)]}',
        "done",
    ),
    "slanted plane at 1e15": (
        '{"world": down, "plane": [{"point": [1e15, 1e15], "normal": [1, 1]}], "ball": [ball(1e15, y=1e15 + 8)]}',
        "done",
    ),
    "ball 1e15 behind a plane": ('{"plane": [floor], "ball": [ball(0, y=-1e15)]}', "SceneError"),
    "balls 2e16 apart over a plane": ('{"plane": [floor], "ball": [ball(1e16), ball(-1e16)]}', "Divergence"),
    "bullet through a wall": (
        '{"wall": [{"points": [[5, -1], [5, 1]]}], "ball": [ball(0, radius=0.01, velocity=[1e12, 0])]}',
        "done",
    ),
    "bullet at a ball": ('{"ball": [ball(0, velocity=[1e12, 0], restitution=1), ball(1e10 + 1)]}', "done"),
    "bullet along a plane": ('{"plane": [floor], "ball": [ball(0, velocity=[1e12, 0])]}', "Divergence"),
    "bullet and pin of 1e-9": (
        '{"post": [{"position": [9, 0], "radius": 1e-9}], "ball": [ball(0, radius=1e-9, velocity=[1e12, 0])]}',
        "done",
    ),
    "spin of 1e12 on a rubbing plane": (
        '{"plane": [{**floor, "friction": 1000}], "ball": [ball(0, y=1, angular_velocity=1e12, friction=1000)], '
        '"world": down}',
        "done",  # the ball rolls 166 km away
    ),
    "spin of 1e12 in the air": ('{"ball": [ball(0, angular_velocity=1e12), ball(5)]}', "done"),
    "gravity of 1e9 into a plane": (
        '{"world": {"gravity": [0, -1e9]}, "plane": [floor], "ball": [ball(0, y=1)]}',
        "Divergence",
    ),
    "gravity of 1e9 from 1 km": (
        '{"world": {"gravity": [0, -1e9]}, "plane": [floor], "ball": [ball(0, y=1000)]}',
        "Divergence",
    ),
    "gravity of 1e9 along a plane": (
        '{"world": {"gravity": [1e9, 0]}, "plane": [floor], "ball": [ball(0, y=1)]}',
        "Divergence",
    ),
    "linear drag of 1e9": ('{"world": {**down, "linear_drag": 1e9}, "ball": [ball(0, velocity=[1e12, 0])]}', "done"),
    "linear drag of 1e9, meeting": (
        '{"world": {**down, "linear_drag": 1e9}, "ball": [ball(0, velocity=[1e12, 0]), ball(9)]}',
        "done",
    ),
    "quadratic drag of 1e9": (
        '{"world": {**down, "quadratic_drag": 1e9}, "ball": [ball(0, velocity=[1e12, 0])]}',
        "done",
    ),
    "quadratic drag of 1e9, meeting": (
        '{"world": {**down, "quadratic_drag": 1e9}, "ball": [ball(0, velocity=[1e12, 0]), ball(9)]}',
        "done",
    ),
    "both drags and a wind of 1e12": (
        '{"world": {**down, "linear_drag": 1e9, "quadratic_drag": 1e9, "wind": [-1e12, 0]}, '
        '"ball": [ball(0), ball(9)]}',
        "done",
    ),
    "dt of 10": (
        '{"world": down, "solver": {"dt": 10}, "plane": [floor], "ball": [ball(0, y=1), ball(1)]}',
        "done",  # the balls tunnel through the plane and fall 196 km
    ),
    "dt of 1e-9": (
        '{"world": {**down, "duration": 1}, "solver": {"dt": 1e-9}, "plane": [floor], "ball": [ball(0), ball(1)]}',
        "done",
    ),
    "1,000 substeps of 1e-12": (
        '{"world": {**down, "duration": 1e-3}, "solver": {"dt": 1e-9, "substeps": 1000}, "plane": [floor], '
        '"ball": [ball(0, y=0.5), ball(1, y=0.5)]}',
        "done",
    ),
    "10,000 iterations": (
        '{"world": down, "solver": {"iterations": 10_000}, "plane": [floor], "ball": [ball(0, y=1), ball(1, y=1)]}',
        "done",
    ),
    "one iteration, no bias, no slop": (
        '{"world": down, "solver": {"iterations": 1, "bias": 0, "slop": 0}, "plane": [floor], '
        '"ball": [ball(0, y=1), ball(0.5, y=1)]}',
        "done",
    ),
    "slop of 1e9, bias of 1": (
        '{"world": down, "solver": {"slop": 1e9, "bias": 1}, "plane": [floor], "ball": [ball(0), ball(0)]}',
        "done",
    ),
    "persistence of 1,000": (
        '{"world": down, "solver": {"persistence": 1000}, "plane": [floor], '
        '"ball": [ball(0, y=1, restitution=1, friction=1000), ball(0.5, y=2, friction=1000)]}',
        "done",
    ),
    "coincident centres": ('{"ball": [ball(0), ball(0), ball(0)]}', "done"),
    "coincident centres at 1e16": ('{"ball": [ball(1e16), ball(1e16)]}', "done"),
    "deep in a wall and in a post": (
        '{"wall": [{"points": [[0, -1], [0, 1]], "thickness": 9}], "post": [{"position": [0, 0], "radius": 9}], '
        '"ball": [ball(0)]}',
        "done",
    ),
    "wall of 1e-9 beside one of 2e16": (
        '{"wall": [{"points": [[0, 0], [1e-9, 0]]}, {"points": [[-1e16, -5], [1e16, -5]]}], "world": down, '
        '"ball": [ball(0, y=2)]}',
        "done",
    ),
    "1,000 metres behind a plane": ('{"world": down, "plane": [floor], "ball": [ball(0, y=-1000)]}', "done"),
    "a thousand planes": (
        '{"world": down, "plane": [{"point": [0, -k], "normal": [k, 1]} for k in range(1000)], "ball": [ball(0, y=2)]}',
        "done",
    ),
    "nothing at all": ('{"title": ""}', "done"),
    "no bodies, only things": ('{"plane": [floor], "wall": [{"points": [[0, 0], [1, 0]]}]}', "done"),
    "only a fixed ball": ('{"world": down, "ball": [ball(0, fixed=True)]}', "done"),
    "only fixed things and particles": (
        '{"world": down, "plane": [floor], "ball": [ball(0, fixed=True), ball(0, collides="none")]}',
        "done",
    ),
    "no time for a step": ('{"world": {**down, "duration": 1e-12}, "plane": [floor], "ball": [ball(0)]}', "done"),
    "bounds of no size": ('{"world": {"bounds": [[0, 0], [0, 0]]}, "ball": [ball(0)]}', "SceneError"),
    "bounds of 2e-308": (
        '{"world": {"bounds": [[-1e-308, -1e-308], [1e-308, 1e-308]], **down}, "ball": [ball(0)]}',
        "done",
    ),
}
"""Scene, and outcome of twenty steps of it."""

SHORTHAND = """
down = {"gravity": [0, -9.81]}
floor = {"point": [0, 0], "normal": [0, 1]}
def ball(x, y=0.0, **more):
    return {"position": [x, y], "radius": 1, **more}
"""


@INTERPRETER_FLAGS
def test_extreme_scene_runs_diverges_or_is_refused(flags: tuple[str, ...]) -> None:
    whole = "{" + ", ".join(f"{name!r}: lambda: {document}" for name, (document, _) in CASES.items()) + "}"
    code = f"""
def attempt(document, states):
    simulation = start(from_document(document))
    simulation.contacts()
    try:
        steps(simulation, 20)
    finally:
        states.append(simulation.state_hash())
        states.append(is_finite(simulation))
    if simulation.contacts().impulse.size and not np.isfinite(simulation.contacts().impulse).all():
        sys.exit("an impulse is not finite")
found = {{}}
for name, document in {whole}.items():
    states = []
    first = outcome(attempt, document(), states)
    again = outcome(attempt, document(), states)
    found[name] = [first, first == again and states[:2] == states[2:], states[1] if states else True]
report(found)
"""
    found = run_isolated(SHORTHAND + code, flags)
    assert {name: outcome for name, (outcome, _, _) in found.items()} == {name: end for name, (_, end) in CASES.items()}
    for name, (outcome, repeated, finite) in found.items():
        assert repeated, name
        assert finite or outcome == "Divergence", name


@INTERPRETER_FLAGS
def test_extreme_scene_is_run_audited_and_summarised(flags: tuple[str, ...]) -> None:
    """The same scenes through `run`, with audit, energies and a last partial step."""
    names = [name for name, (_, expected) in CASES.items() if expected != "SceneError"]
    whole = "{" + ", ".join(f"{name!r}: lambda: {CASES[name][0]}" for name in names) + "}"
    code = f"""
found = {{}}
for name, document in {whole}.items():
    scene = document()
    dt = scene.get("solver", {{}}).get("dt", 0.01)
    scene["world"] = {{"duration": 10.3 * dt, **scene.get("world", {{}})}}
    scene["world"]["duration"] = min(scene["world"]["duration"], 10.3 * dt)
    ended = run(from_document(scene))
    found[name] = [ended.status, ended.reason, len(ended.time)]
report(found)
"""
    for name, (status, reason, frames) in run_isolated(SHORTHAND + code, flags).items():
        assert status in ("ok", "diverged"), name
        assert (reason is None) == (status == "ok"), name
        assert frames >= 2, name


@INTERPRETER_FLAGS
@pytest.mark.parametrize(("key", "fall"), [("linear_drag", 9.81 / 1e9), ("quadratic_drag", (9.81 / 1e9) ** 0.5)])
def test_extreme_drag_is_stable(key: str, fall: float, flags: tuple[str, ...]) -> None:
    """Drag of any strength brings a body to the velocity of the wind in a step, and not beyond it."""
    code = f"""
def speeds(balls):
    simulation = start(from_document({{
        "world": {{{key!r}: 1e9, "wind": [3, 0], "gravity": [0, -9.81]}},
        "solver": {{"dt": 10}},
        "ball": [{{"position": [0, 9 * k], "velocity": [9e11, -1e11], "radius": 1}} for k in range(balls)],
    }}))
    simulation.step()
    first = simulation.frame().velocity.tolist()
    steps(simulation, 50)
    return first + simulation.frame().velocity.tolist()
report(speeds(1) + speeds(2))
"""
    for vx, vy in run_isolated(code, flags):
        assert vx == pytest.approx(3.0, abs=1e-3)  # rounding of 1e12 m/s is 1e-4 m/s
        assert -fall - 1e-3 <= vy <= 1e-3  # as above


@INTERPRETER_FLAGS
def test_collision_of_extreme_masses_has_the_closed_form(flags: tuple[str, ...]) -> None:
    code = """
found = []
for masses in ((1e-15, 1e30), (1e30, 1e-15), (1e-15, 1e-15), (1e30, 1e30)):
    simulation = start(from_document({
        "ball": [{"position": [3 * k, 0], "velocity": [9 - 9 * k, 0], "mass": masses[k], "radius": 1, "restitution": 1}
                 for k in range(2)],
    }))
    steps(simulation, 40)
    found.append(simulation.frame().velocity[:, 0].tolist())
report(found)
"""
    light, heavy, both_light, both_heavy = run_isolated(code, flags)
    # v₁' = (m₁ − m₂)v/M and v₂' = 2m₁v/M, with about ten rounding errors of the iterations.
    assert light == pytest.approx([-9.0, 0.0], rel=1e-13, abs=1e-13)
    assert heavy == pytest.approx([9.0, 18.0], rel=1e-13)  # as above
    assert both_light == pytest.approx([0.0, 9.0], abs=1e-13)  # as above
    assert both_heavy == pytest.approx([0.0, 9.0], abs=1e-13)  # as above
