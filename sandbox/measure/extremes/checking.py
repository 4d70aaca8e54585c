"""Checking: whether what is to be set can be set, before anything runs."""

from collections.abc import Sequence

from sandbox.measure.extremes.axis import Axis
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import from_document


def check_overrides(overrides: Sequence[str], axes: Sequence[Axis]) -> None:
    """Make sure that every override suits every axis's scenes, and leaves the axis something to vary.

    Raises:
        SceneError: with all that is wrong, each once.
    """
    faults: dict[str, Fault] = {}
    for override in overrides:
        for axis in axes:
            try:
                scenes = [from_document(axis.document(level), "--set", (override,)) for level in axis.quick[:2]]
            except SceneError as error:
                for fault in error.faults:
                    faults.setdefault(fault.message, Fault("--set", None, f"{override} ({axis.name})", fault.message))
                continue
            if len(scenes) == 2 and scenes[0] == scenes[1]:
                message = f"sets the value that the axis {axis.name!r} varies; remove it, or choose other --axes"
                faults.setdefault(message, Fault("--set", None, override, message))
    if faults:
        raise SceneError(tuple(faults.values()))
