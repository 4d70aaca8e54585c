"""Expected faults of a scene, each with its path, a part of the message, and the line if given."""

from typing import Any

import pytest

from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import from_document, loads


def faults_of(scene: str | dict[str, Any]) -> list[Fault]:
    """Return the faults of a faulty scene, given as text or as a document."""
    with pytest.raises(SceneError) as caught:
        loads(scene) if isinstance(scene, str) else from_document(scene)
    return list(caught.value.faults)


def fault_paths(scene: str | dict[str, Any]) -> list[str]:
    """Return the paths of the faults of a faulty scene."""
    return [fault.path for fault in faults_of(scene)]


def assert_faults(scene: str | dict[str, Any], *expected: str) -> None:
    """Check that a scene has exactly the expected faults, in order.

    Each is "PATH: PART" or "LINE: PATH: PART", with a part of the message.
    """
    found = faults_of(scene)
    assert len(found) == len(expected), found
    for fault, each in zip(found, expected, strict=True):
        line, path, part = each.split(": ", 2) if each[0].isdecimal() else ("", *each.split(": ", 1))
        assert fault.path == path, fault
        assert line in ("", str(fault.line)), fault
        assert part in fault.message
