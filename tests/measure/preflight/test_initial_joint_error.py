"""Joints that are violated at the start, and anchors in the wrong order: `check` warns of both."""

import pytest

from sandbox.measure.preflight import Diagnostic, warnings
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find
from tests.samples import each_shipped_scene

TWO = """
[[ball]]
name = "bob"
position = [0, 9]
radius = 0.3
[[ball]]
name = "other"
position = [3, 9]
radius = 0.3
"""


def initial_warnings(joint: str) -> list[Diagnostic]:
    """Return the warnings about initial joint errors of a scene with two balls and a joint."""
    return [w for w in warnings(loads(f"{TWO}[[joint]]\n{joint}\n")) if w.kind in ("joint_start", "anchors")]


ONE = 'between = ["bob"]\n'
BOTH = 'between = ["bob", "other"]\n'


@pytest.mark.parametrize("kind", ["rod", "spring", "slide", "pivot"])
def test_only_swapped_anchors_of_one_body_are_warned_of(kind: str) -> None:
    more = {"spring": "stiffness = 10\n", "slide": "most = 5\n"}.get(kind, "")
    high = 9.2 if kind == "pivot" else 10  # the two points of a pivot coincide
    right, wrong = f"anchors = [[0, 0.2], [0, {high}]]", f"anchors = [[0, {high}], [0, 0.2]]"
    assert initial_warnings(f'kind = "{kind}"\n{ONE}{more}{right}') == []
    (warning,) = initial_warnings(f'kind = "{kind}"\n{ONE}{more}{wrong}')
    assert (warning.kind, warning.details) == ("anchors", {"joint": "joint-1", "body": "bob", "others": 0})
    assert f"{high} m from its centre" in warning.message


@pytest.mark.parametrize(
    ("joint", "error"),
    [
        (f'kind = "rod"\n{BOTH}length = 2', 1.0),
        (f'kind = "slide"\n{BOTH}most = 2.5', 0.5),
        (f'kind = "slide"\n{BOTH}least = 5\nmost = 6', 2.0),
        (f'kind = "pivot"\n{BOTH}anchors = [[0, 0], [-1, 0]]', 2.0),
        (f'kind = "rotary_limit"\n{ONE}least = 1\nmost = 2', 1.0),
        (f'kind = "gear"\n{BOTH}ratio = 2\nphase = 0.5', 0.5),
    ],
)
def test_initially_violated_joint_is_warned_of_with_its_error(joint: str, error: float) -> None:
    (warning,) = initial_warnings(joint)
    assert warning.kind == "joint_start"
    assert warning.details["error"] == pytest.approx(error)
    assert f"error of {error:.3g} " in warning.message


@pytest.mark.parametrize(
    "joint",
    [
        f'kind = "rod"\n{BOTH}length = 3.001',  # rounded in the file
        f'kind = "rod"\n{BOTH}',
        f'kind = "pivot"\n{ONE}anchors = [[0, -9], [0, 0]]',  # a lever without mass, about the origin
        f'kind = "pivot"\n{ONE}at = [0, 0]',
        f'kind = "spring"\n{BOTH}stiffness = 5\nrest_length = 1',  # stretched, as springs may be
        f'kind = "motor"\n{ONE}rate = 3',
        f'kind = "pivot"\n{ONE}anchors = [[0, 0], [0, 0]]\nmax_bias = 0\nmax_force = 1',  # friction of the ground
    ],
)
def test_initially_satisfied_joint_is_not_warned_of(joint: str) -> None:
    assert initial_warnings(joint) == []


def test_worst_violated_joint_is_named_and_the_others_are_counted() -> None:
    lines = [f'[[joint]]\nkind = "rod"\n{BOTH}length = {length}\ncollide = true\n' for length in (2.9, 1.0, 2.0)]
    (warning,) = [w for w in warnings(loads(TWO + "".join(lines))) if w.kind == "joint_start"]
    assert warning.details == {"joint": "joint-2", "error": pytest.approx(2.0), "others": 2}


@pytest.mark.parametrize("name", [each for each in each_shipped_scene() if "joints/" in each.values[0]])
def test_no_shipped_scene_starts_with_violated_joints(name: str) -> None:
    assert not {"joint_start", "anchors"} & {w.kind for w in warnings(load(find(name)))}
