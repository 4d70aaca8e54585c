"""Sparse scenes: no bodies, one body, only static bodies, or removed bodies that other elements refer to."""

import numpy as np
import pytest

from sandbox.action import Remove, Switch, Throttle
from sandbox.engines.switching import SwitchableSimulation
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document
from tests.engines.stepping import advance
from tests.laws.features import FEATURES, JOINTS, document

pytestmark = pytest.mark.nightly  # about 45 s together


def test_removed_body_attracts_no_more_and_thrusts_keep_their_throttles() -> None:
    """The engines agree after a body is removed, with and without a switch."""
    whole = document("two", "thrusts")
    whole["attraction"] = [{"toward": "a", "strength": 1e3}, {"toward": [0.0, 50.0], "strength": 1.0}]
    whole["world"]["gravity"] = [0.0, 0.0]
    scene = from_document(whole)
    velocities = []
    for engine, other in (
        ("pymunk", "pymunk"),
        ("pymunk", "reference"),
        ("reference", "pymunk"),
        ("reference", "reference"),
    ):
        switched = SwitchableSimulation(scene, engine)
        switched.apply(Throttle(time=0.0, thrust="u", level=0.5))
        switched.apply(Remove(time=0.0, body="a"))
        switched.apply(Switch(time=0.0, engine=other, settings={"dt": 0.001}))
        advance(switched, 100)
        velocities.append(switched.frame().velocity[1])
    assert velocities[0][0] > 0.0
    np.testing.assert_allclose(velocities, [velocities[0]] * 4, rtol=1e-2, atol=1e-6)


@pytest.mark.parametrize(
    ("kind", "others"),
    [
        (kind, others)
        for kind in JOINTS
        for others in ((), ("fixed",), ("stroke",), ("plunger",))
        if others or f"{kind} to the world" in FEATURES  # a pulley joins two bodies
    ],
)
def test_joint_between_immovable_bodies_is_refused_by_name(kind: str, others: tuple[str, ...]) -> None:
    whole = document("two", f"{kind} between two" if others else f"{kind} to the world")
    drive = {"kind": "stroke", "stops": [0, 1], "rate": 1.0}
    whole["drive"] = [{**drive, "body": "a", "pivot": [0.0, 3.0]}]
    if others == ("fixed",):
        whole["ball"][1]["fixed"] = True
    elif others == ("stroke",):
        whole["drive"].append({**drive, "body": "b", "pivot": [2.0, 3.0]})
    elif others == ("plunger",):
        whole["drive"].append({"kind": "plunger", "body": "b", "direction": [0, 1], "travel": 1.0, "speed": 1.0})
    with pytest.raises(SceneError, match="'a'") as raised:
        from_document(whole)
    assert [fault.path for fault in raised.value.faults] == ["joint.j.between"]
