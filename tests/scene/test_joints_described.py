"""Joints, attractions and thrusts in scene files: kinds and faults."""

import pytest

from sandbox.scene.description.joints import Rod
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import loads

TWO = '[[ball]]\nname="a"\nposition=[0,0]\nradius=1\n[[ball]]\nname="b"\nposition=[5,0]\nradius=1\n'
KINDS = "rod, pin, pivot, slide, groove, rotary_limit, motor, gear, spring, rotary_spring, pulley, ratchet"
FIXED = TWO.replace("radius=1", "radius=1\nfixed=true")


def faults(text: str) -> list[str]:
    with pytest.raises(SceneError) as caught:
        loads(text, "s.toml")
    return [str(fault) for fault in caught.value.faults]


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
    assert len(scene.joints) == len(scene.links) == 13
    assert isinstance(scene.joints[1], Rod)


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        ('between=["a","b"]', [f"s.toml:9: joint[0].kind: is missing; kinds of joint: {KINDS}"]),
        ('kind="spirng"\nbetween=["a","b"]', ['s.toml:10: joint[0].kind: is "spirng"; kinds of joint']),
        ('kind=5\nbetween=["a","b"]', ["s.toml:10: joint[0].kind: "]),
        ('kind="rod"', ["s.toml:9: joint[0].between: is missing"]),
        ('kind="rod"\nbetween="a"', ["s.toml:11: joint[0].between: must be the name of"]),
        ('kind="rod"\nbetween=[]', ["s.toml:11: joint[0].between: must be the name of one"]),
        ('kind="rod"\nbetween=["a","b","a"]', ["s.toml:11: joint[0].between: "]),
        ('kind="rod"\nbetween=["a",5]', ["s.toml:11: joint[0].between[1]: must be text in quotes, is 5"]),
        ('kind="rod"\nbetween=["a","q"]', ["s.toml:11: joint[0].between[1]: no body is named 'q'; bodies: 'a', 'b'"]),
        ('kind="rod"\nbetween=["a","a"]', ["s.toml:11: joint[0].between: names one body twice"]),
        (
            'kind="rod"\nbetween=["a","b"]\nlenght=1',
            ["s.toml:12: joint[0].lenght: unknown key; did you mean 'length'?"],
        ),
        ('kind="pin"\nbetween=["a","b"]\nstiffness=1', ["s.toml:12: joint[0].stiffness: unknown key; "]),
        ('kind="rod"\nbetween=["a","b"]\nlength=1e-10', ["s.toml:12: joint[0].length: must be at least"]),
        ('kind="rod"\nbetween=["a","b"]\nlength=true', ["s.toml:12: joint[0].length: must be a number, is true"]),
        ('kind="rod"\nbetween=["a"]', ["s.toml:11: joint[0].between: both points start at (0, 0) m"]),
        ('kind="rod"\nbetween=["a","b"]\nanchors=[[5,0],[0,0]]', ["s.toml:12: joint[0].anchors: both points"]),
        ('kind="slide"\nbetween=["a"]', ["s.toml:9: joint[0].most: is missing"]),
        (
            'kind="slide"\nbetween=["a"]\nmost=1\nleast=2',
            ["s.toml:12: joint[0].most: must not be smaller than `least`"],
        ),
        (
            'kind="rotary_limit"\nbetween=["a"]\nmost=1\nleast=2',
            ["s.toml:12: joint[0].most: must not be smaller than `least`"],
        ),
        ('kind="groove"\nbetween=["a"]\ngroove=[[1,1],[1,1]]', ["s.toml:12: joint[0].groove: is too short"]),
        ('kind="groove"\nbetween=["a"]\ngroove=[[1,1]]', ["s.toml:12: joint[0].groove: must be an array of 2, has 1"]),
        (
            'kind="pivot"\nbetween=["a"]',
            ["s.toml:9: joint[0].at: must have either `at`, a point in the world, or `anchors`"],
        ),
        (
            'kind="pivot"\nbetween=["a"]\nat=[0,0]\nanchors=[[0,0],[1,0]]',
            ["s.toml:12: joint[0].at: must have either `at`"],
        ),
        (
            'kind="motor"\nbetween=["a"]\nrate=1\nmax_torque=-1',
            ["s.toml:13: joint[0].max_torque: must be at least 0, is -1"],
        ),
        ('kind="ratchet"\nbetween=["a"]', ["s.toml:9: joint[0].ratchet: is missing"]),
        ('kind="ratchet"\nbetween=["a"]\nratchet=0', ["s.toml:12: joint[0].ratchet: must be at least 1e-06 rad"]),
        (
            'kind="rod"\nbetween=["a","b"]\nmax_force=-1\nmax_bias=-1\nbias=1.5',
            [
                "s.toml:12: joint[0].max_force: must be at least 0, is -1",
                "s.toml:13: joint[0].max_bias: must be at least 0, is -1",
                "s.toml:14: joint[0].bias: must be between 0 and 1, is 1.5",
            ],
        ),
        (
            'kind="motor"\nbetween=["a"]\nrate=1\nmax_force=5',  # that of a motor is a torque
            ["s.toml:13: joint[0].max_force: unknown key; did you mean 'max_torque'?"],
        ),
        (
            'kind="spring"\nbetween=["a","b"]\nstiffness=1\nbias=0.5',  # a spring has no error to correct
            ["s.toml:13: joint[0].bias: unknown key"],
        ),
        ('kind="gear"\nbetween=["a"]\nratio=0', ["s.toml:12: joint[0].ratio: must be at least"]),
        ('kind="gear"\nbetween=["a"]\nratio=-1e-9', ["s.toml:12: joint[0].ratio: must be at least"]),
        (
            'kind="spring"\nbetween=["a"]\nstiffness=-1\ndamping=inf',
            [
                "s.toml:12: joint[0].stiffness: must be greater than 0, is -1",
                "s.toml:13: joint[0].damping: must be a finite number",
            ],
        ),
        (
            'kind="spring"\nbetween=["a"]\nstiffness=1e31',
            ["s.toml:12: joint[0].stiffness: must be at most 1e+30, is 1e+31"],
        ),
    ],
)
def test_faulty_joint_is_refused_with_line_and_path(text: str, messages: list[str]) -> None:
    found = faults(f"{TWO}[[joint]]\n{text}\n")
    assert len(found) == len(messages), found
    for message, start in zip(found, messages, strict=True):
        assert message.startswith(start)


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        ("[[attraction]]\nstrength=1", ["s.toml:9: attraction[0].toward: is missing"]),
        (
            "[[attraction]]\nstrength=1\ntoward=[1]",
            ["s.toml:11: attraction[0].toward: must be a position, such as"],
        ),
        (
            "[[attraction]]\nstrength=1\ntoward=5",
            ["s.toml:11: attraction[0].toward: must be a position, such as"],
        ),
        ('[[attraction]]\nstrength=1\ntoward="sun"', ["s.toml:11: attraction[0].toward: no body is named 'sun'"]),
        ("[[attraction]]\nstrength=nan\ntoward=[0,0]", ["s.toml:10: attraction[0].strength: must be a finite number"]),
        ('[[thrust]]\nbody="q"\nforce=[1,0]', ["s.toml:10: thrust[0].body: no body is named 'q'"]),
        (
            '[[thrust]]\nbody="a"\nforce=[1]\nkey="spc"',
            ["s.toml:11: thrust[0].force: must be an array of 2, has 1", "s.toml:12: thrust[0].key: must be one of"],
        ),
        ('[[thrust]]\nbody="a"\nforce=[1,0]\nbegin=3\nend=3', ["s.toml:13: thrust[0].end: must be later than `begin`"]),
        (
            '[[thrust]]\nname="t"\nbody="a"\nforce=[1,0]\n[[thrust]]\nname="t"\nbody="b"\nforce=[1,0]',
            ["s.toml:14: thrust.t.name: another thrust is also named 't'"],
        ),
        (
            '[[thrust]]\nname="thrust-2"\nbody="a"\nforce=[1,0]\n[[thrust]]\nbody="b"\nforce=[1,0]',
            ["s.toml:13: thrust[1].name: another thrust is also named 'thrust-2'"],
        ),
    ],
)
def test_faulty_force_is_refused_with_line_and_path(text: str, messages: list[str]) -> None:
    found = faults(f"{TWO}{text}\n")
    assert len(found) == len(messages), found
    for message, start in zip(found, messages, strict=True):
        assert message.startswith(start)


@pytest.mark.parametrize("joint", ["joint=5\n", "joint=[5]\n", "attraction={}\n"])
def test_joint_that_is_not_an_array_of_tables_is_refused(joint: str) -> None:
    (found,) = faults(joint + TWO)
    assert found.startswith("s.toml:1: ")
    assert "a table" in found or "tables, each under a heading" in found


def test_names_of_joints_are_unique() -> None:
    joint = '[[joint]]\nname="x"\nkind="motor"\nrate=1\nbetween=["a"]\n'
    (found,) = faults(TWO + joint + joint)
    assert found.startswith("s.toml:15: joint.x.name: another joint is also named 'x'")


def test_joint_between_fixed_bodies_is_refused() -> None:
    found = faults(FIXED + '[[joint]]\nkind="rod"\nbetween=["a","b"]\n[[joint]]\nkind="rod"\nbetween=["b"]\n')
    assert [each.split(": ")[1] for each in found] == ["joint[0].between", "joint[1].between"]
    assert all("all its bodies are fixed" in each for each in found)


@pytest.mark.parametrize("strength", ["0", "-1.0", "inf", "true"])
def test_strength_that_is_not_a_positive_force_is_refused(strength: str) -> None:
    (found,) = faults(f'{TWO}[[joint]]\nkind="rod"\nstrength={strength}\nbetween=["a"]\n')
    assert found.startswith("s.toml:11: joint[0].strength: ")
