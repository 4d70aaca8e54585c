"""No two public classes have one name, so that a name in a message, a hint or a search means one class."""

import ast
from collections import defaultdict
from pathlib import Path

import sandbox

ROOT = Path(sandbox.__file__).parent


def _sources() -> list[Path]:
    """Return the top modules of the package, and those of `engines` and `scene`."""
    return [*ROOT.glob("*.py"), *(path for room in ("engines", "scene") for path in (ROOT / room).rglob("*.py"))]


def test_public_classes_have_distinct_names() -> None:
    homes: dict[str, list[str]] = defaultdict(list)
    for path in sorted(_sources()):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].append(str(path.relative_to(ROOT)))
    assert len(homes) > 100
    assert {name: paths for name, paths in homes.items() if len(paths) > 1} == {}
