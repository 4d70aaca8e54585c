"""Drives in a scene file: faults, round trip, and moment about the hinge."""

from typing import Any

import pytest

from sandbox.scene.compile.drives import mounts
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import dumps, from_document, loads

BAR = '[[box]]\nname = "bar"\nposition = [1, 0]\nsize = [2, 1]\n'
TORQUE = {"kind": "torque", "body": "bar", "pivot": [0, 0], "stops": [0, 1], "torque": 1}
STROKE = {"kind": "stroke", "body": "bar", "pivot": [0, 0], "stops": [0, 1], "rate": 1}
PLUNGER = {"kind": "plunger", "body": "bar", "direction": [0, 1], "travel": 1, "speed": 1}
BOX = {"name": "bar", "position": [1, 0], "size": [2, 1]}


def faults(document: dict[str, Any]) -> list[str]:
    with pytest.raises(SceneError) as caught:
        from_document(document)
    return [f"{fault.path}: {fault.message}" for fault in caught.value.faults]


@pytest.mark.parametrize(
    ("box", "drive", "message"),
    [
        ({}, {**TORQUE, "body": "car"}, "drive[0].body: no body is named 'car'"),
        ({"fixed": True}, TORQUE, "drive[0].body: 'bar' is fixed"),
        ({"velocity": [1, 0]}, PLUNGER, "drive[0].body: 'bar' has an initial velocity"),
        ({"angle": 2}, STROKE, "drive[0].stops: 'bar' starts at 2 rad"),
        ({}, {**STROKE, "stops": [1, 1]}, "drive[0].stops: must be two different angles"),
        ({}, {**PLUNGER, "direction": [0, 0]}, "drive[0].direction: [0.0, 0.0] has no direction"),
        # 1 kg at 1 m
        ({}, {**TORQUE, "moment": 0.9}, "drive[0].moment: must be greater than 1 kg·m²"),
    ],
)
def test_faulty_drive_is_refused_with_a_message(box: dict[str, Any], drive: dict[str, Any], message: str) -> None:
    (found,) = faults({"box": [{**BOX, **box}], "drive": [drive]})
    assert found.startswith(message)


def test_body_with_two_drives_or_a_thrust_is_refused() -> None:
    thrust = {"body": "bar", "force": [1, 0]}
    found = faults({"box": [BOX], "drive": [{**TORQUE, "name": "a"}, {**STROKE, "name": "a"}], "thrust": [thrust]})
    assert any(each.startswith("drive.a.name: another drive is also named 'a'") for each in found)
    assert sum("already has a drive" in each for each in found) == 1
    assert sum("has a thrust" in each for each in found) == 2


def test_drive_of_a_generated_body_is_refused() -> None:
    grid = {"name": "g", "origin": [0, 0], "spacing": [3, 3], "columns": 2, "rows": 1, "radius": 1}
    (found,) = faults({"grid": [grid], "drive": [{**PLUNGER, "body": "g-1"}]})
    assert found.startswith("drive[0].body: 'g-1' is made by a generator")


def test_fault_in_a_number_names_its_line_and_range() -> None:
    with pytest.raises(SceneError) as caught:
        loads(BAR + '[[drive]]\nkind = "stroke"\nbody = "bar"\npivot = [0, 0]\nstops = [0, 1]\nrate = 0\n')
    (fault,) = caught.value.faults
    assert (fault.line, fault.path) == (10, "drive[0].rate")
    assert fault.message == "must be greater than 0, is 0"


def test_unknown_kind_and_unknown_key_of_a_drive_are_refused() -> None:
    assert faults({"box": [BOX], "drive": [{**STROKE, "kind": "strike"}]}) == [
        'drive[0].kind: is "strike"; kinds of drive: torque, stroke, plunger'
    ]
    assert faults({"box": [BOX], "drive": [{**STROKE, "rat": 1}]}) == [
        "drive[0].rat: unknown key; did you mean 'rate'?"
    ]


@pytest.mark.parametrize("drive", [TORQUE, STROKE, PLUNGER], ids=lambda drive: drive["kind"])
def test_drive_round_trips_through_toml(drive: dict[str, Any]) -> None:
    scene = from_document({"box": [BOX], "drive": [{**drive, "name": "d", "key": "left shift"}]})
    assert loads(dumps(scene)) == scene


def test_moment_about_the_hinge_is_the_given_one() -> None:
    """I = 2 kg·m² about the hinge, 1 m from the centre of 1 kg, leaves 1 kg·m² about the centre."""
    scene = from_document({"box": [BOX], "drive": [{**TORQUE, "moment": 2}]})
    assert scene.bodies.moment[0] == pytest.approx(1.0, rel=1e-15)
    assert mounts(scene)["bar"].hinge == (-1.0, 0.0)


def test_value_of_a_drive_can_be_set_by_its_path() -> None:
    from sandbox.scene.files.overrides import assign

    document, where = assign({"box": [BOX], "drive": [{**TORQUE, "name": "left"}]}, "drive.left.torque", 3.0)
    assert where == ("drive", 0, "torque")
    drive = from_document(document).drives[0]
    assert drive.kind == "torque"
    assert drive.torque == 3.0
