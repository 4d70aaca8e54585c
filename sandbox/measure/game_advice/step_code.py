"""Lines of a game that set a recommended setting, in place of the line that makes the step."""

import ast
import re
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path

from sandbox.rehearsal.step_settings import SPACE_ATTRIBUTES


@dataclass(frozen=True)
class StepCode:
    """Line of a game that makes the step, and the lines that replace it."""

    file: str
    line: int
    """number of the first line, from 1"""
    old: str
    """the line, or the lines of a longer call; empty if the source could not be read"""
    new: tuple[str, ...]
    """lines that replace it"""


def step_code(file: str, line: int, substeps: int, changed: Mapping[str, float], *, has_forces: bool) -> StepCode:
    """Return the lines that replace a step of a game.

    pymunk resets the forces on a body after each step, so that a force which the game applies for a frame is applied
    again for each substep.

    Args:
        file: source of the game.
        line: of the call of `Space.step`.
        substeps: of the step.
        changed: settings that differ from those of the game, by the names of `RehearsalSettings`.
        has_forces: whether the game applies forces for a step.
    """
    text = _source(file)
    lines = text.splitlines()
    call = _find_call(text, line)
    first, last = (line, line) if call is None else (call[0].lineno, call[0].end_lineno or line)
    old = "\n".join(lines[first - 1 : last]) if first > 0 else ""
    space, dt = ("space", "dt") if call is None else call[1:3]
    used = set(re.findall(r"\w+", text))
    body = [
        f"{space}.{attribute} = {changed[name]:.10g}" for name, attribute in SPACE_ATTRIBUTES.items() if name in changed
    ]
    if "joint_bias" in changed:
        joint = _unused("joint", used)
        body += [f"for {joint} in {space}.constraints:", f"    {joint}.error_bias = {changed['joint_bias']:.10g}"]
    if substeps == 1:
        body.append(f"{space}.step({dt})")
    else:
        if call is not None and any(isinstance(each, ast.Call) for each in ast.walk(call[3])):
            # a call, such as that of `Clock.tick`, is made once
            name = _unused("frame_dt", used)
            body.append(f"{name} = {dt}")
            dt = name
        part = f"{dt} / {substeps}" if dt.isidentifier() or _is_number(dt) else f"({dt}) / {substeps}"
        forces, each = _unused("forces", used), _unused("body", used)
        if has_forces:  # a body without a force is left out: pymunk wakes a sleeping body whose force is set
            body.append(f"{forces} = [({each}, {each}.force, {each}.torque) for {each} in {space}.bodies")
            body[-1] += f" if any({each}.force) or {each}.torque]"
        body.append(f"for _ in range({substeps}):")
        if has_forces:
            force, torque = _unused("force", used), _unused("torque", used)
            body.append(f"    for {each}, {force}, {torque} in {forces}:")
            body.append(f"        {each}.force, {each}.torque = {force}, {torque}")
        body.append(f"    {space}.step({part})")
    return StepCode(file, first, old, tuple(_in_place(text, old, call[0] if call else None, body)))


def _unused(name: str, used: Set[str]) -> str:
    """Return a name that the program does not use: the lines change none of its variables."""
    return name if name not in used else _unused(f"step_{name}", used)


def _in_place(text: str, old: str, call: ast.Call | None, body: Sequence[str]) -> Iterator[str]:
    """Yield the lines that replace a line of the program, with its other statements.

    Examples: `if running: space.step(dt)`, `space.step(dt); time += dt`.
    """
    indent = old[: len(old) - len(old.lstrip())]
    blocks = [] if call is None else list(_statements_of_line(ast.parse(text), call.lineno))
    if call is None or not any(_is_call(each, call) for block in blocks for each in block):
        yield from (indent + each for each in body)
        return
    before = old.encode()[: blocks[0][0].col_offset].decode().rstrip()
    if before:  # such as `else:`
        yield before
        indent += 4 * " "
    for depth, block in enumerate(blocks):
        inner = indent + 4 * depth * " "
        for each in block:
            if _is_call(each, call):
                yield from (inner + line for line in body)
            elif depth + 1 < len(blocks) and each is block[-1]:
                head = old.encode()[each.col_offset : blocks[depth + 1][0].col_offset]
                yield inner + head.decode().rstrip()
            else:
                yield inner + (ast.get_source_segment(text, each) or "")


def _is_call(statement: ast.stmt, call: ast.Call) -> bool:
    """Return whether a statement is a call, and nothing else."""
    return isinstance(statement, ast.Expr) and (statement.value.lineno, statement.value.col_offset) == (
        call.lineno,
        call.col_offset,
    )


def _statements_of_line(tree: ast.Module, line: int) -> Iterator[list[ast.stmt]]:
    """Yield the statements that begin in one line: of a block, then of the block within its last statement."""
    for node in ast.walk(tree):
        for name in ("body", "orelse", "finalbody"):
            block = getattr(node, name, None)
            if isinstance(block, list) and (found := [each for each in block if each.lineno == line]):
                yield found


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


def _find_call(text: str, line: int) -> tuple[ast.Call, str, str, ast.expr] | None:
    """Return the call of `step` in a line, its space and its argument as they are written; None if there is none."""
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
            return node, space, argument, arguments[0]
    return None
