"""Every test can fail: it asserts, expects an exception or a warning, or calls a test helper that does."""

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.fail_slow(60)  # reads all tests

TESTS = Path(__file__).parent
EXPECTING = frozenset({"raises", "warns", "fail", "check_env"})  # of pytest and gymnasium

NO_ASSERTION = {
    "scene/test_nesting.py::test_any_text_is_checked_in_linear_time": "quadratic time exceeds the time limit of a test",
}
"""Tests without an assertion, each with the reason why it can still fail."""


def _called(function: ast.AST) -> Iterator[str]:
    for node in ast.walk(function):
        if isinstance(node, ast.Call):
            if isinstance(node.func, ast.Attribute):
                yield node.func.attr
            elif isinstance(node.func, ast.Name):
                yield node.func.id


def _asserts(function: ast.AST) -> bool:
    """Return whether a function itself asserts or raises AssertionError, or calls a library's function that does."""
    for node in ast.walk(function):
        if isinstance(node, ast.Assert):
            return True
        if isinstance(node, ast.Raise) and node.exc is not None and "AssertionError" in ast.unparse(node.exc):
            return True
    return any(name in EXPECTING or name.startswith("assert_") for name in _called(function))


def without_assertion(sources: dict[str, str]) -> set[str]:
    """Return the tests, as "path::name", of some sources by path that neither assert nor call a helper that asserts.

    A helper is a function of the caller's file or of the file that it is imported from. A method is found by its name;
    if several methods have that name, all of them must assert.
    """
    trees = {path: ast.parse(source) for path, source in sources.items()}
    functions = [
        (path, node) for path, tree in trees.items() for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)
    ]
    named = defaultdict(list)
    for path, node in functions:
        named[node.name].append(node)
        named[path, node.name].append(node)
    imported = {
        (path, alias.asname or alias.name): (f"{node.module.removeprefix('tests.').replace('.', '/')}.py", alias.name)
        for path, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module is not None
        for alias in node.names
    }
    asserting = {id(node) for _, node in functions if _asserts(node)}

    def is_asserting(path: str, name: str) -> bool:
        here = path, name
        nodes = named.get(here) or named.get(imported.get(here, name)) or []
        return bool(nodes) and all(id(node) in asserting for node in nodes)

    while True:  # a helper that calls an asserting helper asserts; each round adds one, so this ends
        left = [(path, node) for path, node in functions if id(node) not in asserting]
        more = {id(node) for path, node in left if any(is_asserting(path, name) for name in _called(node))}
        if not more:
            break
        asserting |= more
    return {f"{path}::{node.name}" for path, node in left if node.name.startswith("test_")}


def test_every_test_can_fail() -> None:
    sources = {path.relative_to(TESTS).as_posix(): path.read_text(encoding="utf-8") for path in TESTS.rglob("*.py")}
    assert without_assertion(sources) == set(NO_ASSERTION)


def test_test_without_assertion_is_detected() -> None:
    source = """
def test_asserts(): assert 1
def test_expects():
    with pytest.raises(ValueError): f()
def test_by_helper(): outer(1)
def outer(x): same(x)
def same(x): assert x == 1
def test_nothing(): twice(1)
class A:
    def twice(self): assert 1
class B:
    def twice(self): return 2
"""
    assert without_assertion({"a.py": source}) == {"a.py::test_nothing"}
