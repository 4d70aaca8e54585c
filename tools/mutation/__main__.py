"""Measures how many mutants of the core the tests detect: `python -m tools.mutation --help`.

First record which tests execute what, then test mutants:

    MUTATION_CONTEXTS=folder pytest -m "not nightly" -p tools.mutation.contexts
    python -m tools.mutation folder --out mutants.jsonl

For each mutant the tests that execute its line run, the cheapest first, until one fails. `--survivors-of FILE` tests
only the mutants that survived there: so a larger suite, of another checkout given by `--root`, sees only those that a
smaller one did not detect.
"""

import argparse
import json
import os
import queue
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from tools.mutation.contexts import Context, read_contexts
from tools.mutation.mutants import MODULES, Mutant, draw_mutants

IGNORED = shutil.ignore_patterns(".git", ".venv", "build", "kernels-*", ".hypothesis", ".mypy_cache", "*_cache")

UNCOMPILED = ("tests/engines/reference/", "tests/engines/exact/")
"""Tests that pass without compilation too: they need not wait until all kernels are compiled for a mutant."""

MAX_UNCOMPILED_COST = 0.5
"""s, of a compiled test that runs without compilation: uncompiled it may take a hundred times as long"""

LIMIT = 900.0
"""s, added to five times the recorded time of a mutant's tests; after that it counts as detected: an endless loop"""


class Checkout:
    """A copy of a repository in which one mutant after another is tested."""

    def __init__(self, root: Path, folder: Path) -> None:
        """Copy a repository, unless it is to be mutated in place."""
        self.folder = folder
        if folder != root:
            shutil.copytree(root, folder, ignore=IGNORED, symlinks=True)

    def run(self, tests: list[str], limit: float, **environment: str) -> tuple[str, str]:
        """Run tests until one fails; return "passed", "failed" or "timeout", and the first that failed."""
        chosen = self.folder / "mutation_tests.txt"
        chosen.write_text("\n".join(tests), encoding="utf-8")
        command = [sys.executable, "-m", "pytest", "-p", "tools.mutation.selection", "-q", "-x", "-n", "0", "-m", ""]
        command += ["-p", "no:cacheprovider", "--hypothesis-seed=0", *sorted({test.split("::")[0] for test in tests})]
        path = {"PYTHONPATH": str(self.folder), "MUTATION_TESTS": str(chosen), "CI": ""}  # without time budgets
        with subprocess.Popen(
            command,
            cwd=self.folder,
            env=os.environ | path | environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        ) as process:
            try:
                output, _ = process.communicate(timeout=limit)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.communicate()
                return "timeout", ""
        failed = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - |$)", output, re.MULTILINE)
        if process.returncode not in (0, 5):
            return "failed", failed[1] if failed else output[-300:]
        return "passed", ""

    def keep_kernels(self) -> None:
        """Let compiled kernels stay valid although a module of plain Python beside them has changed."""
        script = "from sandbox.engines.common.kernel import cache_folder; print(cache_folder())"
        old = max((self.folder / "sandbox").rglob("kernels-*"), key=lambda each: each.stat().st_mtime, default=None)
        if old is not None:
            os.utime(old)  # or the script deletes it, if it is an hour old, as that of earlier sources
        found = subprocess.run(
            [sys.executable, "-c", script], cwd=self.folder, capture_output=True, text=True, check=True
        ).stdout
        new = Path(found.strip())
        if old is not None and old != new:
            shutil.rmtree(new)
            old.rename(new)

    def test(self, mutant: Mutant, contexts: dict[str, Context], stages: list[str]) -> dict[str, Any]:
        """Return the fate of a mutant after the stages "uncompiled" and "compiled", or one of them."""
        file = self.folder / mutant.path
        original, status = file.read_bytes(), file.stat()
        file.write_text(mutant.source, encoding="utf-8")
        tests = sorted(
            (test for test, context in contexts.items() if context.executes(mutant)), key=lambda t: contexts[t].seconds
        )
        is_engine = "/engines/" in mutant.path
        start, keeps_kernels = time.monotonic(), mutant.kernel is None and is_engine and "compiled" in stages
        try:
            fate, killer = "passed", ""
            cheap = [t for t in tests if t.startswith(UNCOMPILED) and contexts[t].seconds < MAX_UNCOMPILED_COST]
            if is_engine and cheap and "uncompiled" in stages:
                fate, killer = self.run(cheap, 150.0, NUMBA_DISABLE_JIT="1")
                if "Timeout" in killer or fate == "timeout":
                    fate = "passed"
            if keeps_kernels:
                self.keep_kernels()
            if fate == "passed" and tests and ("compiled" in stages or not is_engine):
                fate, killer = self.run(tests, LIMIT + 5.0 * sum(contexts[test].seconds for test in tests))
        finally:
            file.write_bytes(original)
            os.utime(file, ns=(status.st_atime_ns, status.st_mtime_ns))  # compiled kernels are valid by these times
            if keeps_kernels:
                self.keep_kernels()
        return {
            "mutant": mutant.name,
            "detected": fate != "passed",
            "by": killer or fate,
            "tests": len(tests),
            "seconds": round(time.monotonic() - start, 1),
        }


def main() -> None:
    """Test mutants and print how many were detected."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument("contexts", type=Path, nargs="+", help="folders of records of the tests")
    parser.add_argument("--root", type=Path, default=Path(), help="checkout with the tests and modules")
    parser.add_argument(
        "--out", type=Path, required=True, help="file for results, one line a mutant; continued if there"
    )
    parser.add_argument("--survivors-of", type=Path, help="test only the mutants that survived in this file")
    parser.add_argument("--count", type=int, default=15, help="mutants of each module")
    parser.add_argument("--modules", nargs="*", default=MODULES, help="mutated modules")
    parser.add_argument(
        "--stages",
        nargs="+",
        choices=("uncompiled", "compiled"),
        default=["uncompiled", "compiled"],
        help="for mutants of engines: their cheap tests without compilation, then all tests",
    )
    parser.add_argument("--in-place", action="store_true", help="mutate this checkout, one mutant after another")
    parser.add_argument("--workers", type=int, default=2, help="copies of the checkout, each with kernels to compile")
    given = parser.parse_args()
    contexts: dict[str, Context] = {}
    for folder in given.contexts:
        contexts |= read_contexts(folder)
    mutants = [mutant for path in given.modules for mutant in draw_mutants(given.root, path, given.count)]
    if given.survivors_of:
        survived = {row["mutant"] for row in _rows(given.survivors_of) if not row["detected"]}
        mutants = [mutant for mutant in mutants if mutant.name in survived]
    done = {row["mutant"] for row in _rows(given.out)}
    left: queue.SimpleQueue[Mutant] = queue.SimpleQueue()
    for mutant in mutants:
        if mutant.name not in done:
            left.put(mutant)

    def work(folder: Path) -> None:
        checkout = Checkout(given.root.resolve(), folder)
        if checkout.run(sorted(contexts, key=lambda test: contexts[test].seconds)[:50], LIMIT)[0] != "passed":
            print("tests fail without a mutant: nothing is measured", file=sys.stderr)
            return
        while True:
            try:
                mutant = left.get_nowait()
            except queue.Empty:
                return
            row = checkout.test(mutant, contexts, given.stages)
            print("detected" if row["detected"] else "SURVIVED", row["mutant"], row["by"], sep="  ", flush=True)
            with given.out.open("a", encoding="utf-8") as out:
                out.write(json.dumps(row) + "\n")

    with tempfile.TemporaryDirectory() as work_folder:
        folders = [Path(work_folder) / str(k) for k in range(given.workers)]
        folders = [given.root.resolve()] if given.in_place else folders
        threads = [threading.Thread(target=work, args=(folder,)) for folder in folders]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    rows = _rows(given.out)
    print(f"{sum(row['detected'] for row in rows)} of {len(rows)} mutants detected")


def _rows(file: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in file.read_text("utf-8").splitlines()] if file.exists() else []


if __name__ == "__main__":
    main()
