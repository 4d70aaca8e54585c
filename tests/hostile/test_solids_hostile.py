"""Extreme solids, joints and forces: they run, diverge with a reason, or are refused; the process never crashes."""

import pytest

from tests.hostile.ordeal import INTERPRETER_FLAGS, run_isolated

pytestmark = pytest.mark.full  # fuzzing and inputs at the ends of their ranges

CASES: dict[str, tuple[str, str]] = {
    "a pin of a body to itself": ('dict(ball=two, joint=[dict(kind="pin", between=["a", "a"])])', "SceneError"),
    "a rod of length 0": ('dict(ball=two, joint=[dict(kind="rod", between=["a", "b"], length=0)])', "done"),
    "a rod of next to no length": (
        'dict(ball=two, joint=[dict(kind="rod", between=["a", "b"], length=1e-12)])',
        "SceneError",
    ),
    "a rod between coincident points": (
        'dict(ball=[at("a", 0), at("b", 0)], joint=[dict(kind="rod", between=["a", "b"])])',
        "SceneError",
    ),
    "a pivot of coincident bodies": (
        'dict(ball=[at("a", 0), at("b", 0)], joint=[dict(kind="pivot", between=["a", "b"], at=[0, 0])], world=down)',
        "done",
    ),
    "a spring of length 0": (
        'dict(ball=[at("a", 0), at("b", 0)], joint=[dict(kind="spring", between=["a", "b"], stiffness=9)], world=down)',
        "done",
    ),
    "a spring from 0 to 1": (
        'dict(ball=[at("a", 0)], joint=[dict(kind="spring", between=["a"], stiffness=9, rest_length=1)])',
        "done",
    ),
    "a slide that is too long to start with": (
        'dict(ball=two, joint=[dict(kind="slide", between=["a", "b"], most=0)], world=down)',
        "done",
    ),
    "joints to fixed bodies": (
        'dict(ball=[at("a", 0, fixed=True), at("b", 5), at("c", 9, fixed=True, collides="none")], world=down, '
        'joint=[dict(kind=kind, between=pair, **more) for pair in (["a", "b"], ["b", "a"], ["b", "c"]) '
        "for kind, more in every])",
        "done",
    ),
    "joints of every kind on one pair": (
        'dict(ball=two, joint=[dict(kind=kind, between=["a", "b"], **more) for kind, more in every], world=down)',
        "done",
    ),
    "stiffness of 1e30": (
        'dict(ball=two, joint=[dict(kind="spring", between=["a", "b"], stiffness=1e30, rest_length=1)])',
        "Divergence",
    ),
    "damping of 1e30": (
        'dict(ball=[at("a", 0, velocity=[5, 0]), at("b", 5)], joint=[dict(kind="spring", between=["a", "b"], '
        "stiffness=1e-9, damping=1e30)])",
        "done",
    ),
    "rotary stiffness of 1e30": (
        'dict(box=[box("a", 0)], joint=[dict(kind="rotary_spring", between=["a"], stiffness=1e30, rest_angle=1)])',
        "Divergence",
    ),
    "masses of 1e30 and 1e-15 on a rod": (
        'dict(ball=[at("a", 0, mass=1e30), at("b", 5, mass=1e-15)], world=down, '
        'joint=[dict(kind="rod", between=["a", "b"])])',
        "done",
    ),
    "a gear of ratio 0": ('dict(ball=two, joint=[dict(kind="gear", between=["a", "b"], ratio=0)])', "SceneError"),
    "a gear of ratio 1e6": (
        'dict(ball=[at("a", 0, angular_velocity=9), at("b", 5)], joint=[dict(kind="gear", between=["a", "b"], '
        "ratio=1e6)])",
        "done",
    ),
    "a motor of 1e12 rad/s": ('dict(box=[box("a", 0)], joint=[dict(kind="motor", between=["a"], rate=1e12)])', "done"),
    "anchors 1e16 m away": (
        'dict(ball=two, joint=[dict(kind="rod", between=["a", "b"], anchors=[[1e16, 0], [0, 1e16]])], world=down)',
        "any",
    ),
    "a strength of 1e30": ("dict(ball=two, attraction=[dict(toward=[1, 1], strength=1e30)])", "Divergence"),
    "attraction at a distance of nothing": (
        'dict(ball=[at("a", 0), at("b", 1e-110)], attraction=[dict(toward="a", strength=1)])',
        "any",
    ),
    "attraction in the very place": (
        'dict(ball=[at("a", 0)], attraction=[dict(toward=[0, 0], strength=1e30)])',
        "done",
    ),
    "a place at 1e-160 m": (
        'dict(ball=[at("a", 0)], attraction=[dict(toward=[x, 0], strength=1) for x in (1e-160, 1e-110)])',
        "done",
    ),
    "a thrust of 1e30 N a mile off the centre": (
        'dict(box=[box("a", 0, mass=1e-9)], thrust=[dict(body="a", force=[1e30, 1e30], point=[1e16, 0])], '
        "solver=dict(substeps=9))",
        "Divergence",
    ),
    "a box of 1e9 by 1e-9": (
        'dict(box=[box("a", 5, size=[1e9, 1e-9], angle=0.3), box("b", 9)], plane=[floor], world=down)',
        "any",
    ),
    "boxes deep in each other": ("dict(box=[box(str(k), 0) for k in range(40)], plane=[floor], world=down)", "done"),
    "an outline of 1,001 corners": ("dict(polygon=[dict(points=gon(1001))])", "SceneError"),
    "outlines of 1,000 corners": (
        "dict(polygon=[dict(points=gon(1000), position=[0, 2.1 * k]) for k in range(4)], plane=[floor], world=down)",
        "done",
    ),
    "a star of 1,000 corners": (
        "dict(polygon=[dict(points=gon(1000, 0.5), position=[0, 2])], plane=[floor], world=down)",
        "done",
    ),
    "an outline that crosses itself": ("dict(polygon=[dict(points=[[0, 0], [1, 1], [1, 0], [0, 1]])])", "SceneError"),
    "a part too small for where it is": (
        "dict(body=[dict(position=[0, 0], box=[dict(size=[1e-6, 1e-6], position=[1e12, 0])])])",
        "SceneError",
    ),
    "10,000 fixed boxes in one place": (
        "dict(ball=two, box=[dict(size=[1, 1], position=[9, 9], fixed=True) for _ in range(10000)])",
        "SceneError",
    ),
    "900 hollow outlines in one place": (
        "dict(polygon=[dict(points=[[0, 0], [3, 0], [3, 1], [1, 1], [1, 2], [3, 2], [3, 3], [0, 3]]) "
        "for _ in range(900)])",
        "SceneError",
    ),
    "2,000 rods on one body": (
        'dict(ball=[at("hub", 0)] + [at(str(k), 3 + k, radius=0.01) for k in range(2000)], world=down, '
        'joint=[dict(kind="rod", between=["hub", str(k)]) for k in range(2000)])',
        "done",
    ),
    "1,000 rods on one pair": (
        'dict(ball=two, joint=[dict(kind="rod", between=["a", "b"]) for _ in range(1000)], world=down)',
        "done",
    ),
}

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

two = [at("a", 0), at("b", 5)]
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
    cases = ", ".join(f"{name!r}: lambda: {document}" for name, (document, _) in CASES.items())
    code = SCENES + f"\nreport({{name: ends(make()) for name, make in {{{cases}}}.items()}})\n"
    for name, (ending, finite) in run_isolated(code, flags, timeout=120).items():
        expected = CASES[name][1]
        assert ending == expected or (expected == "any" and ending in ("done", "Divergence", "SceneError")), (
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
