"""Mutants: copies of a module with one small fault, drawn with a fixed seed."""

import ast
import random
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

MODULES = (
    "sandbox/engines/reference/step.py",
    "sandbox/engines/reference/velocity_solver.py",
    "sandbox/engines/reference/sequential_impulses.py",
    "sandbox/engines/exact/prediction.py",
    "sandbox/engines/exact/common/roots.py",
    "sandbox/measure/missed_contacts/detector.py",
    "sandbox/measure/metrics/trajectory_error.py",
    "sandbox/measure/compare/ground_truth.py",
    "sandbox/batch/store.py",
    "sandbox/scene/files/toml_changes.py",
)
"""Mutated modules: the core of the engines, of truth and errors, of stored runs and of edited scene files."""

_OPERATORS: dict[type[ast.AST], type[Any]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Pow: ast.Mult,
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.And: ast.Or,
    ast.Or: ast.And,
}
"""Each operator and the one that replaces it."""

_NAMES = {"min": "max", "max": "min", "any": "all", "all": "any"}


@dataclass(frozen=True)
class Mutant:
    """A module with one fault."""

    path: str
    """file of the module, relative to the repository"""
    line: int
    """line of the fault"""
    last_line: int
    """last line of the changed text"""
    kernel: str | None
    """compiled function that contains the fault; None in plain Python"""
    runs_at_import: bool
    """whether the fault is outside of functions"""
    before: str
    """changed text"""
    after: str
    """text in its place"""
    source: str
    """text of the whole module with the fault"""

    @property
    def module(self) -> str:
        """Dotted name of the module."""
        return module_name(self.path)

    @cached_property
    def name(self) -> str:
        """Place and change, on one line."""
        before, after = (" ".join(text.split()) for text in (self.before, self.after))
        return f"{self.path}:{self.line}: {before} → {after}"


def module_name(path: str) -> str:
    """Return the dotted name of the module in a file."""
    return path.removesuffix(".py").replace("/", ".")


def draw_mutants(root: Path, path: str, count: int, seed: int = 0) -> list[Mutant]:
    """Return some mutants of a module below `root`, in the order of their lines; equal for equal sources and seed."""
    source = (root / path).read_text(encoding="utf-8")
    found = list(_mutants(path, source))
    drawn = random.Random(f"{seed} {path}").sample(found, min(count, len(found)))
    return sorted(drawn, key=lambda mutant: (mutant.line, mutant.after))


def is_kernel(function: ast.FunctionDef) -> bool:
    """Return whether a function is compiled by numba."""
    return any(ast.unparse(each).endswith("kernel") for each in function.decorator_list)


def _mutants(path: str, source: str) -> Iterator[Mutant]:
    """Yield each mutant of a module: a changed operator, constant, name or sign, or a statement left out."""
    starts = [0]
    for line in source.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    tree = ast.parse(source)
    inside = {id(each) for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) for each in ast.walk(node)}
    for node, kernel in _nodes(tree):
        for after in _changed(node):
            begin = starts[node.lineno - 1] + node.col_offset
            end = starts[(node.end_lineno or node.lineno) - 1] + (node.end_col_offset or 0)
            text = source.encode()
            mutated = b"".join((text[:begin], after.encode(), text[end:])).decode()
            before = text[begin:end].decode()
            last_line, at_import = node.end_lineno or node.lineno, id(node) not in inside
            yield Mutant(path, node.lineno, last_line, kernel, at_import, before, after, mutated)


def _nodes(tree: ast.Module) -> Iterator[tuple[ast.expr | ast.stmt, str | None]]:
    """Yield the nodes that run, each with the kernel that it belongs to: no annotations, decorators and docstrings."""
    left: list[tuple[ast.AST, str | None]] = [(tree, None)]
    while left:
        node, kernel = left.pop()
        if isinstance(node, ast.expr | ast.stmt):
            yield node, kernel
        if isinstance(node, ast.FunctionDef):
            kernel = node.name if kernel is None and is_kernel(node) else kernel
            left.extend((each, kernel) for each in (*node.args.defaults, *node.args.kw_defaults, *node.body) if each)
        elif isinstance(node, ast.AnnAssign):
            left.extend((each, kernel) for each in (node.target, node.value) if each)
        elif isinstance(node, ast.ClassDef):
            left.extend((each, kernel) for each in node.body)
        elif not isinstance(node, ast.JoinedStr | ast.Raise):  # texts of messages
            left.extend((each, kernel) for each in ast.iter_child_nodes(node))


def _changed(node: ast.expr | ast.stmt) -> Iterator[str]:
    """Yield texts for the place of a node."""
    if isinstance(node, ast.BinOp) and not isinstance(node.left, ast.Constant | ast.JoinedStr):
        if type(node.op) in _OPERATORS:
            yield f"({ast.unparse(ast.BinOp(node.left, _OPERATORS[type(node.op)](), node.right))})"
    elif isinstance(node, ast.Compare):
        for k, operator in enumerate(node.ops):
            ops = [*node.ops[:k], _OPERATORS[type(operator)](), *node.ops[k + 1 :]]
            yield f"({ast.unparse(ast.Compare(node.left, ops, node.comparators))})"
    elif isinstance(node, ast.BoolOp):
        yield f"({ast.unparse(ast.BoolOp(_OPERATORS[type(node.op)](), node.values))})"
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
        yield f"({ast.unparse(node.operand)})"
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
        value = node.value
        yield repr(not value) if isinstance(value, bool) else repr(value + 1) if abs(value) < 2 else repr(value * 2)
    elif isinstance(node, ast.Name) and node.id in _NAMES:
        yield _NAMES[node.id]
    elif isinstance(node, ast.If | ast.While) and not isinstance(node.test, ast.Compare | ast.BoolOp | ast.UnaryOp):
        yield ast.unparse(type(node)(ast.UnaryOp(ast.Not(), node.test), node.body, node.orelse)).replace(
            "\n", "\n" + " " * node.col_offset
        )
    elif isinstance(node, ast.AugAssign) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)):
        yield "pass"
    elif isinstance(node, ast.Break | ast.Continue):
        yield "continue" if isinstance(node, ast.Break) else "break"
