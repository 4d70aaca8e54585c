"""Joints, forces and drives of a scene file: every kind is read, and each fault has its line and path."""

from typing import Any

import pytest

from sandbox.scene.compile.drives import mounts
from sandbox.scene.description.joints import Rod
from sandbox.scene.files.load import dumps, from_document, loads
from tests.scene.faults import assert_faults, faults_of

BALL = '[[ball]]\nname="a"\nposition=[0,0]\nradius=1\n'
TWO = BALL + '[[ball]]\nname="b"\nposition=[5,0]\nradius=1\n'
FIXED = TWO.replace("radius=1", "radius=1\nfixed=true")
A, AB = 'between=["a"]\n', 'between=["a","b"]\n'


def test_joint_of_every_kind_is_read() -> None:
    scene = loads(
        TWO + "".join(
            f'[[joint]]\nbetween=["a","b"]\nkind={kind}\n'
            for kind in (
                '"rod"', '"pin"\nlength=3', '"pivot"\nat=[1,1]', '"pivot"\nanchors=[[1,0],[-1,0]]', '"slide"\nmost=9',
                '"groove"\ngroove=[[0,0],[0,1]]', '"rotary_limit"\nleast=-1\nmost=1', '"motor"\nrate=2\nmax_torque=3',
                '"gear"\nratio=-2', '"spring"\nstiffness=5', '"rotary_spring"\nstiffness=5\ndamping=1',
                '"pivot"\nat=[1,1]\nmax_force=0\nmax_bias=0\nbias=1', '"ratchet"\nratchet=-0.1\nphase=2\nmax_force=5',
            )
        )
    )  # fmt: skip
    assert len(scene.joints) == len(scene.joint_arrays) == 13
    assert isinstance(scene.joints[1], Rod)


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        (AB, ["9: joint[0].kind: rod, pin, pivot, slide, groove, rotary_limit, motor, gear, spring, rotary_spring, "]),
        ('kind="spirng"\n' + AB, ["10: joint[0].kind: spirng"]),
        ("kind=5\n" + AB, ["10: joint[0].kind: 5"]),
        ('kind="rod"', ["9: joint[0].between: missing"]),
        ('kind="rod"\nbetween="a"', ["11: joint[0].between: name"]),
        ('kind="rod"\nbetween=[]', ["11: joint[0].between: name"]),
        ('kind="rod"\nbetween=["a","b","a"]', ["11: joint[0].between: "]),
        ('kind="rod"\nbetween=["a",5]', ["11: joint[0].between[1]: is 5"]),
        ('kind="rod"\nbetween=["a","q"]', ["11: joint[0].between[1]: 'q'; bodies: 'a', 'b'"]),
        ('kind="rod"\nbetween=["a","a"]', ["11: joint[0].between: twice"]),
        ('kind="rod"\n' + AB + "lenght=1", ["12: joint[0].lenght: 'length'"]),
        ('kind="pin"\n' + AB + "stiffness=1", ["12: joint[0].stiffness: unknown"]),
        ('kind="rod"\n' + AB + "length=1e-10", ["12: joint[0].length: at least"]),
        ('kind="rod"\n' + AB + "length=true", ["12: joint[0].length: is true"]),
        ('kind="rod"\n' + A, ["11: joint[0].between: (0, 0) m"]),
        ('kind="rod"\n' + AB + "anchors=[[5,0],[0,0]]", ["12: joint[0].anchors: both points"]),
        ('kind="slide"\n' + A, ["9: joint[0].most: missing"]),
        ('kind="slide"\n' + A + "most=1\nleast=2", ["12: joint[0].most: `least`"]),
        ('kind="rotary_limit"\n' + A + "most=1\nleast=2", ["12: joint[0].most: `least`"]),
        ('kind="groove"\n' + A + "groove=[[1,1],[1,1]]", ["12: joint[0].groove: short"]),
        ('kind="groove"\n' + A + "groove=[[1,1]]", ["12: joint[0].groove: has 1"]),
        ('kind="pivot"\n' + A, ["9: joint[0].at: `anchors`"]),
        ('kind="pivot"\n' + A + "at=[0,0]\nanchors=[[0,0],[1,0]]", ["12: joint[0].at: `anchors`"]),
        ('kind="motor"\n' + A + "rate=1\nmax_torque=-1", ["13: joint[0].max_torque: -1"]),
        ('kind="ratchet"\n' + A, ["9: joint[0].ratchet: missing"]),
        ('kind="ratchet"\n' + A + "ratchet=0", ["12: joint[0].ratchet: 1e-06"]),
        (
            'kind="rod"\n' + AB + "max_force=-1\nmax_bias=-1\nbias=1.5",
            ["12: joint[0].max_force: -1", "13: joint[0].max_bias: -1", "14: joint[0].bias: 1.5"],
        ),
        # that of a motor is a torque, and a spring has no error to correct
        ('kind="motor"\n' + A + "rate=1\nmax_force=5", ["13: joint[0].max_force: 'max_torque'"]),
        ('kind="spring"\n' + AB + "stiffness=1\nbias=0.5", ["13: joint[0].bias: unknown"]),
        ('kind="gear"\n' + A + "ratio=0", ["12: joint[0].ratio: at least"]),
        ('kind="gear"\n' + A + "ratio=-1e-9", ["12: joint[0].ratio: at least"]),
        ('kind="spring"\n' + A + "damping=inf", ["9: joint[0].stiffness: missing", "12: joint[0].damping: finite"]),
        *(('kind="rod"\n' + A + f"strength={each}", ["12: joint[0].strength: "]) for each in (0, -1.0, "inf", "true")),
        (
            'kind="motor"\nrate=1\n' + A + '[[joint]]\nname="joint-1"\nkind="motor"\nrate=1\n' + A,
            ["14: joint.joint-1.name: 'joint-1'"],
        ),
    ],
)
def test_faulty_joint_is_refused_with_line_and_path(text: str, faults: list[str]) -> None:
    assert_faults(f"{TWO}[[joint]]\n{text}\n", *faults)


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("[[attraction]]\nstrength=1", ["9: attraction[0].toward: missing"]),
        ("[[attraction]]\nstrength=1\ntoward=[1]", ["11: attraction[0].toward: position"]),
        ("[[attraction]]\nstrength=1\ntoward=5", ["11: attraction[0].toward: position"]),
        ('[[attraction]]\nstrength=1\ntoward="sun"', ["11: attraction[0].toward: 'sun'"]),
        ("[[attraction]]\nstrength=nan\ntoward=[0,0]", ["10: attraction[0].strength: finite"]),
        ('[[thrust]]\nbody="q"\nforce=[1,0]', ["10: thrust[0].body: 'q'"]),
        ('[[thrust]]\nbody="a"\nforce=[1]\nkey="spc"', ["11: thrust[0].force: has 1", "12: thrust[0].key: one of"]),
        ('[[thrust]]\nbody="a"\nforce=[1,0]\nbegin=3\nend=3', ["13: thrust[0].end: `begin`"]),
        (
            '[[thrust]]\nname="t"\nbody="a"\nforce=[1,0]\n[[thrust]]\nname="t"\nbody="b"\nforce=[1,0]',
            ["14: thrust.t.name: 't'"],
        ),
        (
            '[[thrust]]\nname="thrust-2"\nbody="a"\nforce=[1,0]\n[[thrust]]\nbody="b"\nforce=[1,0]',
            ["13: thrust[1].name: 'thrust-2'"],
        ),
    ],
)
def test_faulty_force_is_refused_with_line_and_path(text: str, faults: list[str]) -> None:
    assert_faults(f"{TWO}{text}\n", *faults)


@pytest.mark.parametrize("joint", ["joint=5\n", "joint=[5]\n", "attraction=3\n"])
def test_joint_that_is_not_an_array_of_tables_is_refused(joint: str) -> None:
    (fault,) = faults_of(joint + TWO)
    assert fault.line == 1
    assert "table" in fault.message


def test_joint_between_fixed_bodies_is_refused() -> None:
    text = FIXED + '[[joint]]\nkind="rod"\nbetween=["a","b"]\n[[joint]]\nkind="rod"\nbetween=["b"]\n'
    assert_faults(text, "joint[0].between: fixed", "joint[1].between: fixed")


def test_faulty_joint_hides_no_fault_of_other_joints() -> None:
    text = (
        BALL + '[[joint]]\nkind="rod"\nlength=true\nbetween=["a"]\n'
        '[[joint]]\nname="second"\nkind="motor"\nrate=1\nbetween=["zz"]\n'
        '[[joint]]\nkind="nothing"\nbetween=["a"]\n'
        '[[joint]]\nkind="gear"\nratio=0\nbetween=["a"]\n[[attraction]]\nstrength=1\ntoward="yy"\n'
    )
    assert [(fault.line, fault.path) for fault in faults_of(text)] == [
        (7, "joint[0].length"), (13, "joint.second.between[0]"), (15, "joint[2].kind"), (19, "joint[3].ratio"),
        (23, "attraction[0].toward"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "body",
    [
        '[[bal]]\nname="a"\nposition=[0,0]\nradius=1\n', '[[ball]]\nnaem="a"\nposition=[0,0]\nradius=1\n',
        "[[ball]]\nname=5\nposition=[0,0]\nradius=1\n", '[[ball]]\nname=""\nposition=[0,0]\nradius=1\n',
        BALL + 'mass="x"\n', '[[body]]\nname="a"\nposition=[0,0]\n[[body.capsule]]\nlength=1\nradius=0\n',
    ],
)  # fmt: skip
def test_joint_to_a_faulty_body_has_no_fault(body: str) -> None:
    joint = '[[joint]]\nkind="motor"\nrate=1\nbetween=["a"]\n[[thrust]]\nbody="a"\nforce=[0,0]\n'
    (fault,) = faults_of(body + joint)
    assert fault.line is not None and fault.line <= body.count("\n")


TORQUE = {"kind": "torque", "body": "bar", "pivot": [0, 0], "stops": [0, 1], "torque": 1}
STROKE = {"kind": "stroke", "body": "bar", "pivot": [0, 0], "stops": [0, 1], "rate": 1}
PLUNGER = {"kind": "plunger", "body": "bar", "direction": [0, 1], "travel": 1, "speed": 1}
BOX = {"name": "bar", "position": [1, 0], "size": [2, 1]}
GRID = {"name": "g", "origin": [0, 50], "spacing": [3, 3], "columns": 2, "rows": 1, "radius": 1}


@pytest.mark.parametrize(
    ("box", "drive", "fault"),
    [
        ({}, {**TORQUE, "body": "car"}, "drive[0].body: 'car'"),
        ({"fixed": True}, TORQUE, "drive[0].body: fixed"),
        ({"velocity": [1, 0]}, PLUNGER, "drive[0].body: initial velocity"),
        ({"angle": 2}, STROKE, "drive[0].stops: starts at 2 rad"),
        ({}, {**STROKE, "stops": [1, 1]}, "drive[0].stops: different"),
        ({}, {**STROKE, "rate": 0}, "drive[0].rate: greater than 0"),
        ({}, {**STROKE, "kind": "strike"}, "drive[0].kind: torque, stroke, plunger"),
        ({}, {**STROKE, "rat": 1}, "drive[0].rat: 'rate'"),
        ({}, {**PLUNGER, "body": "g-1"}, "drive[0].body: generator"),
        ({}, {**PLUNGER, "direction": [0, 0]}, "drive[0].direction: no direction"),
        # 1 kg at 1 m
        ({}, {**TORQUE, "moment": 0.9}, "drive[0].moment: greater than 1 kg·m²"),
    ],
)
def test_faulty_drive_is_refused(box: dict[str, Any], drive: dict[str, Any], fault: str) -> None:
    assert_faults({"box": [{**BOX, **box}], "grid": [GRID], "drive": [drive]}, fault)


def test_body_with_two_drives_or_a_thrust_is_refused() -> None:
    thrust = {"body": "bar", "force": [1, 0]}
    drives = [{**TORQUE, "name": "a"}, {**STROKE, "name": "a"}]
    found = [str(fault) for fault in faults_of({"box": [BOX], "drive": drives, "thrust": [thrust]})]
    assert any("drive.a.name: " in each for each in found)
    assert sum("already has a drive" in each for each in found) == 1
    assert sum("has a thrust" in each for each in found) == 2


@pytest.mark.parametrize("drive", [TORQUE, STROKE, PLUNGER], ids=lambda drive: drive["kind"])
def test_drive_round_trips_through_toml(drive: dict[str, Any]) -> None:
    scene = from_document({"box": [BOX], "drive": [{**drive, "name": "d", "key": "left shift"}]})
    assert loads(dumps(scene)) == scene


def test_moment_about_the_hinge_is_the_given_one() -> None:
    """I = 2 kg·m² about the hinge, 1 m from the centre of 1 kg, leaves 1 kg·m² about the centre."""
    scene = from_document({"box": [BOX], "drive": [{**TORQUE, "moment": 2}]})
    assert scene.bodies.moment[0] == pytest.approx(1.0, rel=1e-15)
    assert mounts(scene)["bar"].hinge == (-1.0, 0.0)
