"""Scenes at the limits of valid values: they run, diverge with a reason, or are refused."""

import pytest

from tests.hostile.ordeal import INTERPRETER_FLAGS, cases_of, lambdas_of, run_isolated

pytestmark = pytest.mark.fail_slow(60)  # fuzzing and inputs at the ends of their ranges

CASES = """
radius 1e-9 beside 1e9 | done | fall(ball(0, radius=1e-9), ball(2e9, radius=1e9), ball(0, y=5, radius=1e-9))
radius 1e-9 hits 1e9 | done | free(ball(0, radius=1e-9, velocity=[1e9, 0], e=1), ball(1e9 + 1, radius=1e9, e=1))
mass 1e-15 hits 1e30 | done | free(ball(0, mass=1e-15, velocity=[9, 0], e=1), ball(3, mass=1e30, e=1))
mass 1e30 hits 1e-15 | done | free(ball(0, mass=1e30, velocity=[9, 0], e=1), ball(3, mass=1e-15, e=1))
mass 1e-15 under 1e30 | done | over(ball(0, y=1, mass=1e-15), ball(0, y=3, mass=1e30))
plane at 1e15 | done | fall(ball(1e15, y=1e15 + 2), plane=[{"point": [1e15, 1e15], "normal": [0, 1]}])
slanted plane at 1e15 | done | fall(ball(1e15, y=1e15 + 8), plane=[{"point": [1e15, 1e15], "normal": [1, 1]}])
ball 1e15 behind a plane | SceneError | free(ball(0, y=-1e15), plane=[floor])
balls 2e16 apart over a plane | Divergence | free(ball(1e16), ball(-1e16), plane=[floor])
bullet through a wall | done | free(ball(0, radius=0.01, velocity=[1e12, 0]), wall=[{"points": [[5, -1], [5, 1]]}])
bullet at a ball | done | free(ball(0, velocity=[1e12, 0], e=1), ball(1e10 + 1))
bullet along a plane | Divergence | free(ball(0, velocity=[1e12, 0]), plane=[floor])
bullet and pin of 1e-9 | done | free(ball(0, radius=1e-9, velocity=[1e12, 0]), post=[{"position": [9, 0], \
  "radius": 1e-9}])
spin of 1e12 on a rubbing plane | done | over(ball(0, y=1, angular_velocity=1e12, friction=1e3), plane=[{**floor, \
  "friction": 1e3}])
spin of 1e12 in the air | done | free(ball(0, angular_velocity=1e12), ball(5))
gravity of 1e9 into a plane | Divergence | over(ball(0, y=1), world={"gravity": [0, -1e9]})
gravity of 1e9 from 1 km | Divergence | over(ball(0, y=1000), world={"gravity": [0, -1e9]})
gravity of 1e9 along a plane | Divergence | over(ball(0, y=1), world={"gravity": [1e9, 0]})
linear drag of 1e9 | done | fall(ball(0, velocity=[1e12, 0]), world={**down, "linear_drag": 1e9})
linear drag of 1e9, meeting | done | fall(ball(0, velocity=[1e12, 0]), ball(9), world={**down, "linear_drag": 1e9})
quadratic drag of 1e9 | done | fall(ball(0, velocity=[1e12, 0]), world={**down, "quadratic_drag": 1e9})
quadratic drag of 1e9, meeting | done | fall(ball(0, velocity=[1e12, 0]), ball(9), world={**down, \
  "quadratic_drag": 1e9})
both drags and a wind of 1e12 | done | fall(ball(0), ball(9), world={**down, "linear_drag": 1e9, \
  "quadratic_drag": 1e9, "wind": [-1e12, 0]})
dt of 10 | done | over(ball(0, y=1), ball(1), solver={"dt": 10})
dt of 1e-9 | done | over(ball(0), ball(1), world={**down, "duration": 1}, solver={"dt": 1e-9})
1,000 substeps of 1e-12 | done | over(ball(0, y=0.5), ball(1, y=0.5), world={**down, "duration": 1e-3}, \
  solver={"dt": 1e-9, "substeps": 1000})
10,000 iterations | done | over(ball(0, y=1), ball(1, y=1), solver={"iterations": 10_000})
one iteration, no bias, no slop | done | over(ball(0, y=1), ball(0.5, y=1), solver={"iterations": 1, "bias": 0, \
  "slop": 0})
slop of 1e9, bias of 1 | done | over(ball(0), ball(0), solver={"slop": 1e9, "bias": 1})
persistence of 1,000 | done | over(ball(0, y=1, e=1, friction=1e3), ball(0.5, y=2, friction=1e3), \
  solver={"persistence": 1000})
coincident centres | done | free(ball(0), ball(0), ball(0))
coincident centres at 1e16 | done | free(ball(1e16), ball(1e16))
deep in a wall and in a post | done | free(ball(0), wall=[{"points": [[0, -1], [0, 1]], "thickness": 9}], \
  post=[{"position": [0, 0], "radius": 9}])
wall of 1e-9 beside one of 2e16 | done | fall(ball(0, y=2), wall=[{"points": [[0, 0], [1e-9, 0]]}, \
  {"points": [[-1e16, -5], [1e16, -5]]}])
1,000 metres behind a plane | done | over(ball(0, y=-1000))
a thousand planes | done | fall(ball(0, y=2), plane=[{"point": [0, -k], "normal": [k, 1]} for k in range(1000)])
nothing at all | done | {"title": ""}
no bodies, only things | done | {"plane": [floor], "wall": [{"points": [[0, 0], [1, 0]]}]}
only a fixed ball | done | fall(ball(0, fixed=True))
only fixed things and particles | done | over(ball(0, fixed=True), ball(0, collides="none"))
no time for a step | done | over(ball(0), world={**down, "duration": 1e-12})
bounds of no size | SceneError | free(ball(0), world={"bounds": [[0, 0], [0, 0]]})
bounds of 2e-308 | done | fall(ball(0), world={"bounds": [[-1e-308, -1e-308], [1e-308, 1e-308]], **down})
"""
"""Name, outcome of twenty steps, and scene."""

SHORTHAND = """
down = {"gravity": [0, -9.81]}
floor = {"point": [0, 0], "normal": [0, 1]}
def ball(x, y=0.0, e=0.0, **more):
    return {"position": [x, y], "radius": 1, "restitution": e, **more}
def free(*balls, **more):
    return {"ball": list(balls), **more}
def fall(*balls, **more):
    return {"ball": list(balls), "world": down, **more}
def over(*balls, **more):
    return {"ball": list(balls), "world": down, "plane": [floor], **more}
"""


@INTERPRETER_FLAGS
def test_extreme_scene_runs_diverges_or_is_refused(flags: tuple[str, ...]) -> None:
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
for name, document in {lambdas_of(CASES)}.items():
    states = []
    first = outcome(attempt, document(), states)
    again = outcome(attempt, document(), states)
    found[name] = [first, first == again and states[:2] == states[2:], states[1] if states else True]
report(found)
"""
    found = run_isolated(SHORTHAND + code, flags)
    assert {name: outcome for name, (outcome, _, _) in found.items()} == {name: end for name, end, _ in cases_of(CASES)}
    for name, (outcome, repeated, finite) in found.items():
        assert repeated, name
        assert finite or outcome == "Divergence", name


@INTERPRETER_FLAGS
def test_extreme_scene_is_run_audited_and_summarised(flags: tuple[str, ...]) -> None:
    """The same scenes through `run`, with audit, energies and a last partial step."""
    valid = "\n".join(line for line in CASES.splitlines() if "| SceneError |" not in line)
    code = f"""
found = {{}}
for name, document in {lambdas_of(valid)}.items():
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
