"""Several faults: a fault hides no other fault, and causes no false one in joints that refer to its element."""

import pytest

from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import loads

BALL = '[[ball]]\nname="a"\nposition=[0,0]\nradius=1\n'


def fault_locations(text: str) -> list[tuple[int | None, str]]:
    with pytest.raises(SceneError) as caught:
        loads(text)
    return [(fault.line, fault.path) for fault in caught.value.faults]


def test_faulty_joint_hides_no_fault_of_other_joints() -> None:
    text = (
        BALL + '[[joint]]\nkind="rod"\nlength=true\nbetween=["a"]\n'
        '[[joint]]\nname="second"\nkind="motor"\nrate=1\nbetween=["zz"]\n'
        '[[joint]]\nkind="nothing"\nbetween=["a"]\n'
        '[[joint]]\nkind="gear"\nratio=0\nbetween=["a"]\n[[attraction]]\nstrength=1\ntoward="yy"\n'
    )
    assert fault_locations(text) == [
        (7, "joint[0].length"),
        (13, "joint.second.between[0]"),
        (15, "joint[2].kind"),
        (19, "joint[3].ratio"),
        (23, "attraction[0].toward"),
    ]


@pytest.mark.parametrize("typo", ['[[bal]]\nname="a"', '[[ball]]\nnaem="a"', "[[ball]]\nname=5", '[[ball]]\nname=""'])
def test_joint_to_a_body_with_a_misspelt_key_has_no_fault(typo: str) -> None:
    joint = '[[joint]]\nkind="motor"\nrate=1\nbetween=["a"]\n[[thrust]]\nbody="a"\nforce=[0,0]\n'
    (found,) = fault_locations(f"{typo}\nposition=[0,0]\nradius=1\n{joint}")
    assert found[0] in (1, 2)


def test_joint_to_a_body_with_a_fault_has_no_fault() -> None:
    assert fault_locations(BALL + 'mass="x"\n[[joint]]\nkind="motor"\nrate=1\nbetween=["a"]\n') == [(5, "ball.a.mass")]


def test_joint_to_a_body_whose_only_part_is_faulty_has_no_fault() -> None:
    body = '[[body]]\nname="h"\nposition=[0,0]\n[[body.capsule]]\nlength=1\nradius=0\n'
    assert fault_locations(body + '[[joint]]\nkind="motor"\nrate=1\nbetween=["h"]\n') == [
        (6, "body.h.capsule[0].radius")
    ]
