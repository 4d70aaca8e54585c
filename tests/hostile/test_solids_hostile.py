"""Extreme solids, joints and forces: they run, diverge with a reason, or are refused; the process never crashes."""

import pytest

from tests.hostile.ordeal import INTERPRETER_FLAGS, cases_of, lambdas_of, run_isolated

pytestmark = pytest.mark.fail_slow(60)  # fuzzing and inputs at the ends of their ranges

CASES = """
a pin of a body to itself | SceneError | joined("pin", between=["a", "a"])
a rod of length 0 | done | joined("rod", length=0)
a rod of next to no length | SceneError | joined("rod", length=1e-12)
a rod between coincident points | SceneError | joined("rod", one)
a pivot of coincident bodies | done | joined("pivot", one, at=[0, 0])
a spring of length 0 | done | joined("spring", one, stiffness=9)
a spring from 0 to 1 | done | joined("spring", between=["a"], stiffness=9, rest_length=1)
a slide that is too long to start with | done | joined("slide", most=0)
joints to fixed bodies | done | dict(ball=held, world=down, joint=[dict(kind=kind, between=pair, \
  **more) for pair in (["a", "b"], ["b", "a"], ["b", "c"]) for kind, more in every])
joints of every kind on one pair | done | dict(ball=two, joint=[dict(kind=kind, between=["a", "b"], \
  **more) for kind, more in every], world=down)
stiffness of 1e30 | Divergence | joined("spring", stiffness=1e30, rest_length=1)
damping of 1e30 | done | joined("spring", [at("a", 0, velocity=[5, 0]), at("b", 5)], stiffness=1e-9, damping=1e30)
rotary stiffness of 1e30 | Divergence | dict(box=[box("a", 0)], joint=[dict(kind="rotary_spring", between=["a"], \
  stiffness=1e30, rest_angle=1)])
masses of 1e30 and 1e-15 on a rod | done | joined("rod", [at("a", 0, mass=1e30), at("b", 5, mass=1e-15)])
a gear of ratio 0 | SceneError | joined("gear", ratio=0)
a gear of ratio 1e6 | done | joined("gear", [at("a", 0, angular_velocity=9), at("b", 5)], ratio=1e6)
a motor of 1e12 rad/s | done | dict(box=[box("a", 0)], joint=[dict(kind="motor", between=["a"], rate=1e12)])
anchors 1e16 m away | any | joined("rod", anchors=[[1e16, 0], [0, 1e16]])
a strength of 1e30 | Divergence | dict(ball=two, attraction=[dict(toward=[1, 1], strength=1e30)])
attraction at a distance of nothing | any | dict(ball=[at("a", 0), at("b", 1e-110)], attraction=[dict(toward="a", \
  strength=1)])
attraction in the very place | done | dict(ball=[at("a", 0)], attraction=[dict(toward=[0, 0], strength=1e30)])
a place at 1e-160 m | done | dict(ball=[at("a", 0)], attraction=[dict(toward=[x, 0], strength=1) for x in (1e-160, \
  1e-110)])
a thrust of 1e30 N a mile off the centre | Divergence | dict(box=[box("a", 0, mass=1e-9)], thrust=[dict(body="a", \
  force=[1e30, 1e30], point=[1e16, 0])], solver=dict(substeps=9))
a box of 1e9 by 1e-9 | any | over(box=[box("a", 5, size=[1e9, 1e-9], angle=0.3), box("b", 9)])
boxes deep in each other | done | over(box=[box(str(k), 0) for k in range(40)])
an outline of 1,001 corners | SceneError | dict(polygon=[dict(points=gon(1001))])
outlines of 1,000 corners | done | over(polygon=[dict(points=gon(1000), position=[0, 2.1 * k]) for k in range(4)])
a star of 1,000 corners | done | over(polygon=[dict(points=gon(1000, 0.5), position=[0, 2])])
an outline that crosses itself | SceneError | dict(polygon=[dict(points=[[0, 0], [1, 1], [1, 0], [0, 1]])])
a part too small for where it is | SceneError | dict(body=[dict(position=[0, 0], box=[dict(size=[1e-6, 1e-6], \
  position=[1e12, 0])])])
10,000 fixed boxes in one place | SceneError | dict(ball=two, box=[dict(size=[1, 1], position=[9, 9], \
  fixed=True) for _ in range(10000)])
900 hollow outlines in one place | SceneError | dict(polygon=[dict(points=hollow) for _ in range(900)])
2,000 rods on one body | done | dict(ball=[at("hub", 0)] + [at(str(k), 3 + k, radius=0.01) for k in range(2000)], \
  world=down, joint=[dict(kind="rod", between=["hub", str(k)]) for k in range(2000)])
1,000 rods on one pair | done | dict(ball=two, joint=[dict(kind="rod", between=["a", "b"]) for _ in range(1000)], \
  world=down)
"""
"""Name, outcome of thirty steps, and scene."""

SCENES = """
down = {"gravity": [0, -9.81]}
floor = {"point": [0, -20], "normal": [0, 1], "restitution": 0.5, "friction": 0.5}

def at(name, x, **more):
    return {"name": name, "position": [x, 0], "radius": 1, **more}

def box(name, x, **more):
    return {"name": name, "position": [x, 0], "size": [1, 1], **more}

def gon(count, inner=1.0):
    turns = [2 * math.pi * k / count for k in range(count)]
    return [[(inner if k % 2 else 1) * math.cos(t), (inner if k % 2 else 1) * math.sin(t)] for k, t in enumerate(turns)]

def over(**more):
    return dict(plane=[floor], world=down, **more)

one, two = [at("a", 0), at("b", 0)], [at("a", 0), at("b", 5)]
held = [at("a", 0, fixed=True), at("b", 5), at("c", 9, fixed=True, collides="none")]
hollow = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [3, 2], [3, 3], [0, 3]]

def joined(kind, balls=two, between=("a", "b"), **more):
    return dict(ball=balls, joint=[dict(kind=kind, between=list(between), **more)], world=down)

every = [
    ("rod", {}), ("pin", {}), ("pivot", {"at": [1, 1]}), ("slide", {"most": 3}),
    ("groove", {"groove": [[0, 0], [1, 0]]}), ("rotary_limit", {"least": -1, "most": 1}),
    ("motor", {"rate": 1}), ("gear", {"ratio": 2}),
    ("spring", {"stiffness": 9, "damping": 1}), ("rotary_spring", {"stiffness": 9}),
    ("ratchet", {"ratchet": 1}), ("pivot", {"at": [1, 1], "max_force": 1, "max_bias": 0, "bias": 0}),
]

def ends(document):
    simulation = None
    def go():
        nonlocal simulation
        simulation = start(from_document(document))
        simulation.contacts()
        steps(simulation, 30)
    how = outcome(go)
    return how, simulation is None or how != "done" or is_finite(simulation)
"""

ACTIONS = """
joint = [dict(kind=kind, between=["a", "b"], **more) for kind, more in every] + [dict(kind="rod", between=["a", "c"])]
scene = dict(ball=two + [at("c", 9)], joint=joint, world=down, plane=[floor],
             attraction=[dict(toward="a", strength=9)], thrust=[dict(name="t", body="b", force=[1, 0])])
found = []
for action in (
    [Remove(time=0, body="a")], [Remove(time=0, body="b"), Remove(time=0, body="c")],
    [Move(time=0, body="a", position=(1e15, 0.0))], [Move(time=0, body="a", position=(0.0, 1e6))],
    [Move(time=0, body="b", position=(0.0, 0.0))], [Impulse(time=0, body="a", impulse=(1e10, 0.0))],
    [Force(time=0, body="c", force=(1e9, 0.0), torque=1e9)],
):
    simulation = start(from_document(scene))
    simulation.contacts()
    def go():
        steps(simulation, 5)
        for each in action:
            simulation.apply(each)
        steps(simulation, 50)
    found.append([outcome(go), is_finite(simulation)])

crowd = [dict(position=[3 * (k % 10), 3 * (k // 10)], size=[1, 1]) for k in range(300)]
simulation = start(from_document(dict(box=crowd, world=down)))
L = ((0.0, 0.0), (30.0, 0.0), (30.0, 90.0), (0.0, 90.0))
far = tuple((x + 1e6, y) for x, y in L)
crossed = ((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0))
for points, position in ((L, (0.0, 0.0)), (far, (-1e6, 0.0)), (crossed, (0.0, 0.0))):
    found.append([outcome(simulation.apply, Spawn(time=0, polygon=dict(points=points, position=position))), True])
steps(simulation, 5)
small = tuple((0.1 * x, 0.01 * y) for x, y in L)
found.append([outcome(simulation.apply, Spawn(time=0, polygon=dict(points=small))), True])
steps(simulation, 5)
found.append(["done", is_finite(simulation)])

stiff = dict(kind="spring", between=["a", "b"], stiffness=1e6, rest_length=1)
ran = run(from_document(dict(ball=two, joint=[stiff], solver=dict(dt=0.01))))
found.append([ran.info["status"], bool(ran.info["reason"])])
report(found)
"""


@INTERPRETER_FLAGS
def test_extreme_solids_and_joints_have_the_expected_outcome(flags: tuple[str, ...]) -> None:
    code = SCENES + f"\nreport({{name: ends(make()) for name, make in {lambdas_of(CASES)}.items()}})\n"
    found = run_isolated(code, flags, timeout=120)
    for name, outcome, _ in cases_of(CASES):
        ending, finite = found[name]
        assert ending == outcome or (outcome == "any" and ending in ("done", "Divergence", "SceneError")), (
            name,
            ending,
        )
        assert finite, name


@INTERPRETER_FLAGS
def test_actions_on_joined_bodies_have_the_expected_outcome(flags: tuple[str, ...]) -> None:
    found = run_isolated(SCENES + ACTIONS, flags)
    assert all(finite for _, finite in found), found
    endings = [ending for ending, _ in found]
    assert all(ending in ("done", "Divergence", "ActionError") for ending in endings[:7]), endings
    assert endings[:2] == ["done", "done"]
    assert endings[7:11] == ["ActionError", "ActionError", "ActionError", "done"]
    assert endings[12] == "diverged"


@pytest.mark.parametrize("joint", ["rod", "pivot"])
def test_diverging_run_prints_nothing(joint: str) -> None:
    """Pymunk prints exceptions of callbacks and continues; `run_isolated` asserts an empty stderr."""
    code = f"""
more = {{"at": [1, 0]}} if {joint!r} == "pivot" else {{}}
d = dict(ball=two, joint=[dict(kind={joint!r}, between=["a", "b"], **more)],
         attraction=[dict(toward="a", strength=1e30), dict(toward=[0, 0], strength=-1e30)],
         thrust=[dict(body="b", force=[1e30, 0], point=[0, 1e9])], solver=dict(substeps=50))
report(ends(d)[0])
"""
    assert run_isolated(SCENES + code) == "Divergence"
