"""Imports within the package form no cycle: each module can be read, tested and moved without another that needs it."""

import ast
import graphlib
from pathlib import Path

import sandbox

ROOT = Path(sandbox.__file__).parent


def _modules() -> dict[str, Path]:
    found = {}
    for path in ROOT.rglob("*.py"):
        parts = path.relative_to(ROOT.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def _imports(path: Path, modules: dict[str, Path]) -> set[str]:
    """Return the modules that one imports: at its top, late in functions, or for type checkers alone."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            names = [name if name in modules else node.module for name in inner]
        found.update(name for name in names if name in modules)
    return found


def test_no_two_modules_import_each_other_directly_or_through_others() -> None:
    modules = _modules()
    graph = {name: _imports(path, modules) - {name} for name, path in modules.items()}
    assert len(graph) > 100
    assert graph["sandbox.engines.registry"]
    # The package itself names its modules as text, and imports them for type checkers only.
    inside = {name: needs - {"sandbox"} for name, needs in graph.items() if name != "sandbox"}
    graphlib.TopologicalSorter(inside).prepare()  # a CycleError names the modules


def test_a_cycle_is_found(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("def f():\n    import b\n")
    (tmp_path / "b.py").write_text("from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from a import f\n")
    modules = {name: tmp_path / f"{name}.py" for name in "ab"}
    assert {name: _imports(path, modules) for name, path in modules.items()} == {"a": {"b"}, "b": {"a"}}
