"""Versions: the sources that affect a run are part of them, and thereby of the ids of stored runs."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest

import sandbox
from sandbox import provenance
from sandbox.batch.job import Job, identify
from sandbox.provenance import DISPLAY, ENGINE_FOLDERS, PACKAGE, READERS, versions

pytestmark = pytest.mark.fail_slow(60)  # copies the package

ENGINES = "pymunk", "reference", "exact"

SCENE = sandbox.loads('[[ball]]\nname = "a"\nposition = [0, 1]\nradius = 0.5')


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Yield an editable copy of the sources, of which digests are computed."""
    copy = Path(shutil.copytree(PACKAGE, tmp_path / "sandbox", ignore=shutil.ignore_patterns("__pycache__")))
    with monkeypatch.context() as changes:
        changes.setattr(provenance, "PACKAGE", copy)
        forget()
        yield copy
    forget()


def forget() -> None:
    """Forget the versions that this process knows."""
    provenance.versions.cache_clear()
    provenance.source_digest.cache_clear()


def ids_and_version() -> tuple[dict[str, str], str]:
    """Return the id of a run on each engine, and the version of the sandbox."""
    forget()
    return {engine: identify(Job("ball", SCENE, engine))[1] for engine in ENGINES}, versions()["sandbox"]


def changed(before: dict[str, str], after: dict[str, str]) -> set[str]:
    """Return the engines whose runs have another id."""
    return {engine for engine in ENGINES if before[engine] != after[engine]}


@pytest.mark.parametrize(
    ("folder", "engines"),
    [
        ("engines/reference", {"reference"}),
        ("engines/pymunk_adapter", {"pymunk"}),
        ("engines/common", set(ENGINES)),
        ("scene", set(ENGINES)),
        ("measure/compare", set()),
        *((folder, set()) for folder in DISPLAY),
    ],
)
def test_edited_source_changes_the_ids_of_the_engines_that_use_it(
    folder: str, engines: set[str], package: Path
) -> None:
    before = ids_and_version()
    assert before[1].startswith(f"{version('sandbox2d')}+src.")
    edited = next((package / folder).rglob("*.py"))
    edited.write_text(f"{edited.read_text(encoding='utf-8')}\n# edited\n", encoding="utf-8")
    after = ids_and_version()
    assert changed(before[0], after[0]) == engines
    assert (after[1] == before[1]) == (folder in DISPLAY)


def test_file_times_do_not_change_the_version_and_new_modules_do(package: Path) -> None:
    before = ids_and_version()
    for file in package.rglob("*.py"):
        os.utime(file, (0, 0))
    assert ids_and_version() == before
    (package / "engines" / "new.py").write_text("")
    assert changed(before[0], ids_and_version()[0]) == set(ENGINES)


def test_extras_do_not_change_ids(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without numba and Box2D, runs end in the same states, as `tests/laws` show."""
    before = ids_and_version()

    def without(name: str) -> str:
        if name in ("numba", "pyb2d3"):
            raise PackageNotFoundError(name)
        return version(name)

    with monkeypatch.context() as changes:
        changes.setattr(provenance, "version", without)
        after = ids_and_version()
        assert "numba" not in versions()
    forget()
    assert after == before


@pytest.mark.parametrize("engine", ENGINES)
def test_run_uses_no_source_that_its_version_leaves_out(engine: str) -> None:
    """But for the modules by which the registry knows the other engines, which import none of each other."""
    code = (
        "import sys, sandbox\n"
        f"sandbox.run(sandbox.load('two_balls', ['world.duration=0.1']), engine={engine!r})\n"
        "print('\\n'.join(name for name in sys.modules if name.startswith('sandbox.')))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    modules = [f"{name.removeprefix('sandbox.').replace('.', '/')}/" for name in done.stdout.split()]
    assert f"{ENGINE_FOLDERS[engine]}/engine/" in modules
    assert not [name for name in modules if name.startswith(tuple(f"{folder}/" for folder in (*READERS, *DISPLAY)))]
