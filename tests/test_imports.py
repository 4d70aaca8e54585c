"""Imports within the package form no cycle of modules or of folders; import strings are listed here."""

import ast
import graphlib
import re
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

import sandbox

pytestmark = pytest.mark.fail_slow(60)  # imports all modules in new processes

ROOT = Path(sandbox.__file__).parent


def _modules() -> dict[str, Path]:
    found = {}
    for path in ROOT.rglob("*.py"):
        parts = path.relative_to(ROOT.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def _imports(path: Path, modules: dict[str, Path]) -> set[str]:
    """Return the modules that a module imports: at the top, within functions, or for type checkers only."""
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


@cache
def _graph() -> dict[str, set[str]]:
    """Return the modules that each module imports."""
    modules = _modules()
    return {name: _imports(path, modules) - {name} for name, path in modules.items()}


def test_imports_of_modules_form_no_cycle() -> None:
    graph = _graph()
    assert len(graph) > 100
    assert graph["sandbox.engines.registry"]
    # The package itself names its modules in strings, and imports them for type checkers only.
    inside = {name: needs - {"sandbox"} for name, needs in graph.items() if name != "sandbox"}
    graphlib.TopologicalSorter(inside).prepare()  # a CycleError names the modules


TOLERATED_FOLDER_IMPORTS = {("sandbox", "games", "window")}
"""Imports that are omitted from the graph: package, and the importing and the imported member."""


def _folder_graph(package: str, graph: dict[str, set[str]]) -> dict[str, set[str]]:
    """Return the imports between the direct members of a package: its own modules, and its folders as a whole."""

    def member(module: str) -> str | None:
        if module == package:
            return None if package == "sandbox" else "__init__"
        return module[len(package) + 1 :].partition(".")[0] if module.startswith(f"{package}.") else None

    found: dict[str, set[str]] = defaultdict(set)
    for module, needs in graph.items():
        first = member(module)
        for second in {member(need) for need in needs} - {first, None}:
            if first is not None and second is not None and (package, first, second) not in TOLERATED_FOLDER_IMPORTS:
                found[first].add(second)
    return found


def test_imports_between_members_of_a_package_form_no_cycle() -> None:
    graph = _graph()
    assert "description" in _folder_graph("sandbox.scene", graph)["compile"]
    for package in (name for name, path in _modules().items() if path.name == "__init__.py"):
        graphlib.TopologicalSorter(_folder_graph(package, graph)).prepare()  # a CycleError names the members


def test_import_cycle_of_folders_is_detected() -> None:
    graph = {"p.a.one": {"p.b.one"}, "p.b.two": {"p.a.two"}, "p.a.two": set[str](), "p.b.one": set[str]()}
    with pytest.raises(graphlib.CycleError):
        graphlib.TopologicalSorter(_folder_graph("p", graph)).prepare()


IMPORT_STRINGS = {
    "sandbox": "names of the public interface", "sandbox.cli.json_schemas": "results of commands",
    "sandbox.cli.main": "commands", "sandbox.game_names": "specs of games",
    "sandbox.games.artillery": "parts of the game", "sandbox.games.billiards": "parts of the game",
    "sandbox.games.curling": "parts of the game", "sandbox.games.landing": "parts of the game",
    "sandbox.games.pinball": "parts of the game", "sandbox.gym": "entry points of environments",
    "sandbox.html_repr": "HTML of values in a notebook",
    "sandbox.measure.extremes.isolation": "module that a subprocess runs", "sandbox.notebook": "pages by type",
    "sandbox.rehearsal.rehearse": "module that a subprocess runs",
}  # fmt: skip
"""Modules that contain names of modules of the package as strings, and what for."""


def _import_strings(name: str, path: Path, modules: dict[str, Path]) -> set[str]:
    """Return the modules that a module names in strings `package.module[:name]`, without its own packages."""
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    texts = [node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    named = [re.fullmatch(r"(sandbox(?:\.\w+)+)(?::\w+)?", text) for text in texts]
    found = {match[1] for match in named if match is not None and match[1] in modules}
    return {module for module in found if not name.startswith(f"{module}.")}


def test_modules_with_import_strings_are_listed() -> None:
    modules = _modules()
    assert {name for name, path in modules.items() if _import_strings(name, path, modules)} == set(IMPORT_STRINGS)


def test_imports_within_functions_and_type_checking_are_found(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("def f():\n    import b\n")
    (tmp_path / "b.py").write_text("from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from a import f\n")
    modules = {name: tmp_path / f"{name}.py" for name in "ab"}
    assert {name: _imports(path, modules) for name, path in modules.items()} == {"a": {"b"}, "b": {"a"}}
