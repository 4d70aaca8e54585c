"""Lines of a game that set a recommended setting, in place of the line that makes the step."""

import ast
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class StepCode:
    """Line of a game that makes the step, and the lines that replace it."""

    file: str
    line: int
    """number of the line, from 1"""
    old: str
    """the line; empty if the source could not be read"""
    new: tuple[str, ...]
    """lines that replace it"""


_ATTRIBUTES = {
    "iterations": "iterations",
    "slop": "collision_slop",
    "bias": "collision_bias",
    "persistence": "collision_persistence",
}


def step_code(file: str, line: int, substeps: int, changed: Mapping[str, float], *, has_forces: bool) -> StepCode:
    """Return the lines that replace a step of a game.

    pymunk resets the forces on a body after each step, so that a force which the game applies for a frame is applied
    again for each substep.

    Args:
        file: source of the game.
        line: of the call of `Space.step`.
        substeps: of the step.
        changed: settings that differ from those of the game, by the names of `StepSettings`.
        has_forces: whether the game applies forces for a step.
    """
    text = _source(file)
    lines = text.splitlines()
    old = lines[line - 1] if 0 < line <= len(lines) else ""
    space, dt = _call(text, line) or ("space", "dt")
    indent = old[: len(old) - len(old.lstrip())]
    body = [f"{space}.{attribute} = {changed[name]:.10g}" for name, attribute in _ATTRIBUTES.items() if name in changed]
    if "joint_bias" in changed:
        body += [f"for joint in {space}.constraints:", f"    joint.error_bias = {changed['joint_bias']:.10g}"]
    if substeps == 1:
        body.append(f"{space}.step({dt})")
    else:
        part = f"{dt} / {substeps}" if dt.isidentifier() or _is_number(dt) else f"({dt}) / {substeps}"
        if has_forces:
            body.append(f"forces = [(body, body.force, body.torque) for body in {space}.bodies]")
        body.append(f"for _ in range({substeps}):")
        if has_forces:
            body += ["    for body, force, torque in forces:", "        body.force, body.torque = force, torque"]
        body.append(f"    {space}.step({part})")
    return StepCode(file, line, old, tuple(indent + each for each in body))


def _source(file: str) -> str:
    try:
        return Path(file).read_text(encoding="utf-8")
    except (OSError, ValueError):  # a program without a source that can be read: the lines use general names
        return ""


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _call(text: str, line: int) -> tuple[str, str] | None:
    """Return the space and the argument of the call of `step` in a line, as they are written; None if there is none."""
    try:
        tree = ast.parse(text)
    except SyntaxError:
        return None
    for node in ast.walk(tree):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "step"):
            continue
        if not node.lineno <= line <= (node.end_lineno or node.lineno):
            continue
        arguments = [*node.args, *(each.value for each in node.keywords)]
        space = ast.get_source_segment(text, node.func.value)
        argument = ast.get_source_segment(text, arguments[0]) if arguments else None
        if space is not None and argument is not None:
            return space, argument
    return None
