"""Public classes and type aliases have distinct names, so that a name in a message or a hint means one type."""

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

import sandbox

pytestmark = pytest.mark.fail_slow(60)  # reads all modules

ROOT = Path(sandbox.__file__).parent


def _types(tree: ast.Module) -> Iterator[str]:
    """Yield the names of the public classes, type aliases and type variables of a module.

    An alias has capital and small letters, such as `FloatArray`; the name of a constant has no small letters.
    """
    branches = [body for node in tree.body if isinstance(node, ast.If) for body in (node.body, node.orelse)]
    for node in [*tree.body, *(each for branch in branches for each in branch)]:
        match node:
            case ast.ClassDef(name=name):
                pass
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                if not name[0].isupper() or name.isupper():
                    continue
            case _:
                continue
        if not name.startswith("_"):
            yield name


def test_public_types_have_distinct_names() -> None:
    paths_of: dict[str, list[str]] = defaultdict(list)
    for path in sorted(ROOT.rglob("*.py")):
        for name in _types(ast.parse(path.read_text(encoding="utf-8"))):
            paths_of[name].append(str(path.relative_to(ROOT)))
    assert len(paths_of) > 800
    duplicates = [f"{name}: {', '.join(paths)}" for name, paths in sorted(paths_of.items()) if len(paths) > 1]
    assert not duplicates, "\n".join(duplicates)


def test_types_are_found_by_their_definition() -> None:
    text = "class A: ...\nBx = int\nCx: TypeAlias = int\nD_MAX = 3\nif True:\n    Ex = int\n_Fx = int\nclass _G: ...\n"
    assert [*_types(ast.parse(text))] == ["A", "Bx", "Cx", "Ex"]
