"""No two public classes or type aliases have one name: a name in a message, a hint or a search means one type."""

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import sandbox

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
    homes: dict[str, list[str]] = defaultdict(list)
    for path in sorted(ROOT.rglob("*.py")):
        for name in _types(ast.parse(path.read_text(encoding="utf-8"))):
            homes[name].append(str(path.relative_to(ROOT)))
    assert len(homes) > 800
    shared = [f"{name}: {', '.join(paths)}" for name, paths in sorted(homes.items()) if len(paths) > 1]
    assert not shared, "\n".join(shared)


def test_types_are_found_by_their_definition() -> None:
    text = "class A: ...\nBx = int\nCx: TypeAlias = int\nD_MAX = 3\nif True:\n    Ex = int\n_Fx = int\nclass _G: ...\n"
    assert [*_types(ast.parse(text))] == ["A", "Bx", "Cx", "Ex"]
