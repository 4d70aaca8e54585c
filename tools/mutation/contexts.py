"""Records which tests execute which lines of the mutated modules, as a pytest plugin: `-p tools.mutation.contexts`.

Coverage tools cannot see into compiled kernels, and slow every other module down. Here only the mutated modules are
instrumented: each statement of a Python function notes its line. A kernel is noted as a whole, by its name, when Python
calls it or a kernel that calls it. Child processes note theirs for the test that started them.

`MUTATION_CONTEXTS` is the folder of the records, one file a process and one line of JSON a test, which `read_contexts`
reads. For child processes a file `mutation.pth` in site-packages has the line `import tools.mutation.child`.
"""

import ast
import importlib.machinery
import importlib.util
import json
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, NamedTuple

from tools.mutation.mutants import MODULES, Mutant, is_kernel, module_name

VARIABLE = "MUTATION_CONTEXTS"
"""Environment variable with the folder of the records."""

HITS_NAME = "__mutation_hits__"

KERNEL_MODULE = "sandbox.engines.common.kernel"

Hit = tuple[str, int | str]
"""A module and a line, or a module and the name of a kernel."""

HITS: set[Hit] = set()
"""What has been executed since the start of the test."""


class Context(NamedTuple):
    """What a test executes, and its cost."""

    seconds: float
    """s, from the start of its fixtures to their end"""
    cpu: float
    """s, of all processor cores, child processes included"""
    hits: frozenset[Hit]

    def executes(self, mutant: Mutant) -> bool:
        """Return whether the test executes the changed text of a mutant; or its module, if that runs at import."""
        if mutant.runs_at_import:
            return any(module == mutant.module for module, _ in self.hits)
        if mutant.kernel is not None:
            return (mutant.module, mutant.kernel) in self.hits
        return any((mutant.module, line) in self.hits for line in range(mutant.line, mutant.last_line + 1))


def read_contexts(folder: Path) -> dict[str, Context]:
    """Return the context of each test in a folder of records."""
    found: dict[str, Context] = {}
    for file in sorted(folder.rglob("*.jsonl")):
        for line in file.read_text(encoding="utf-8").splitlines(keepends=True):
            if not line.endswith("\n"):
                continue  # the process was killed while it wrote
            row = json.loads(line)
            known = found.get(row["test"], Context(0.0, 0.0, frozenset()))
            hits = known.hits.union((module, at) for module, at in row["hits"])
            found[row["test"]] = Context(known.seconds + row["seconds"], known.cpu + row.get("cpu", 0.0), hits)
    return found


class _Instrument(ast.NodeTransformer):
    """Puts a note of its line before each statement of each function that is not a kernel."""

    def __init__(self, module: str) -> None:
        self.module = module
        self.depth = 0

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        if is_kernel(node):
            return node
        self.depth += 1
        self.generic_visit(node)
        self.depth -= 1
        return node

    def generic_visit(self, node: ast.AST) -> ast.AST:
        super().generic_visit(node)
        if self.depth:
            for field in ("body", "orelse", "finalbody"):
                statements = getattr(node, field, None)
                if isinstance(statements, list):
                    setattr(node, field, [each for old in statements for each in (*self._note(old), old)])
        return node

    def _note(self, statement: ast.stmt) -> Iterator[ast.stmt]:
        note = ast.parse(f"{HITS_NAME}.add(({self.module!r}, {statement.lineno}))").body[0]
        for each in ast.walk(note):
            ast.copy_location(each, statement)
        yield note


class _Loader(importlib.machinery.SourceFileLoader):
    """Loads an instrumented module, and neither reads nor writes its compiled file."""

    def get_code(self, fullname: str) -> CodeType:
        tree = _Instrument(fullname).visit(ast.parse(Path(self.path).read_text(encoding="utf-8")))
        return compile(tree, self.path, "exec")

    def exec_module(self, module: ModuleType) -> None:
        setattr(module, HITS_NAME, HITS)
        super().exec_module(module)


class _KernelLoader(importlib.machinery.SourceFileLoader):
    """Loads the module that compiles kernels, and notes their calls."""

    def exec_module(self, module: ModuleType) -> None:
        super().exec_module(module)
        if module.COMPILED:
            _note_kernel_calls()


class _Finder:
    """Finds the modules to be instrumented."""

    loaders = {KERNEL_MODULE: _KernelLoader} | {module_name(path): _Loader for path in MODULES}

    def find_spec(self, fullname: str, path: Any, _target: ModuleType | None = None) -> Any:
        spec = importlib.machinery.PathFinder.find_spec(fullname, path) if fullname in self.loaders else None
        if spec is None or spec.origin is None:
            return None
        loader = self.loaders[fullname](fullname, spec.origin)
        return importlib.util.spec_from_file_location(fullname, spec.origin, loader=loader)


_REACHED: dict[int, frozenset[Hit]] = {}


def _reached(dispatcher: Any) -> frozenset[Hit]:
    """Return the kernels of the mutated modules that a kernel calls, itself included."""
    if id(dispatcher) in _REACHED:
        return _REACHED[id(dispatcher)]
    found, seen, left = set(), set(), [dispatcher.py_func]
    while left:
        function = left.pop()
        if function in seen:
            continue
        seen.add(function)
        if function.__module__ in _Finder.loaders:
            found.add((function.__module__, function.__name__))
        names = function.__globals__
        modules = [names[name] for name in function.__code__.co_names if isinstance(names.get(name), ModuleType)]
        for name in function.__code__.co_names:
            values = (names.get(name), *(getattr(module, name, None) for module in modules))
            left.extend(value.py_func for value in values if hasattr(value, "py_func"))
    return _REACHED.setdefault(id(dispatcher), frozenset(found))


def _note_kernel_calls() -> None:
    from numba.core.registry import CPUDispatcher

    dispatcher: Any = CPUDispatcher
    plain = dispatcher.__call__

    def call(self: Any, *given: Any, **named: Any) -> Any:
        HITS.update(_reached(self))
        return plain(self, *given, **named)

    dispatcher.__call__ = call


def record(test: str, seconds: float, cpu: float) -> None:
    """Append the record of a test to the file of this process."""
    row = {"test": test, "seconds": round(seconds, 4), "cpu": round(cpu, 3), "hits": sorted(map(list, HITS), key=str)}
    with (Path(os.environ[VARIABLE]) / f"{os.getpid()}.jsonl").open("a", encoding="utf-8") as out:
        out.write(json.dumps(row) + "\n")


_START: list[float] = []


def _clocks() -> list[float]:
    return [time.perf_counter(), sum(os.times()[:4])]


def pytest_runtest_logstart() -> None:
    """Begin the record of a test."""
    HITS.clear()
    _START[:] = _clocks()


def pytest_runtest_logfinish(nodeid: str) -> None:
    """Write the record of a test; the process that distributes tests to others runs none."""
    if HITS or "PYTEST_XDIST_WORKER" in os.environ:
        record(nodeid, *(end - start for start, end in zip(_START, _clocks(), strict=True)))


if VARIABLE in os.environ:
    sys.meta_path.insert(0, _Finder())
