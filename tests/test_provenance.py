"""Versions: the sources that decide a run are part of them, and so of the ids of stored runs."""

import json
import os
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import sandbox
from sandbox.provenance import DISPLAY, PACKAGE, versions

TOLD = """
import json, sandbox
from sandbox.batch.store import run_id
from sandbox.provenance import versions

scene = sandbox.loads('[[ball]]\\nname = "a"\\nposition = [0, 1]\\nradius = 0.5')
id = run_id(scene, "reference", scene.solver, 0, versions())
print(json.dumps([id, versions()["sandbox"], sandbox.__version__, sandbox.__file__]))
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """Return a copy of the package that may be edited."""
    return Path(shutil.copytree(PACKAGE, tmp_path / "sandbox", ignore=shutil.ignore_patterns("__pycache__")))


def told(package: Path) -> tuple[str, str]:
    """Return the id of a run and the version of the sandbox, both as a copy of the package says."""
    environment = os.environ | {"PYTHONPATH": str(package.parent), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", TOLD]
    done = subprocess.run(
        command, cwd=package.parent, env=environment, capture_output=True, text=True, check=True, timeout=120
    )
    number, found, plain, file = json.loads(done.stdout)
    assert Path(file).parent == package
    assert plain == version("sandbox2d")
    return number, found


def test_edited_integrator_is_another_version_and_another_id(package: Path) -> None:
    before = told(package)
    assert before[1] == versions()["sandbox"]
    module = sys.modules[type(sandbox.INTEGRATORS["rk4"]).__module__]
    edited = package / Path(str(module.__file__)).relative_to(PACKAGE)
    edited.write_text(f"{edited.read_text(encoding='utf-8')}\n# edited\n", encoding="utf-8")
    after = told(package)
    assert after[0] != before[0]
    assert after[1] != before[1]
    assert after[1].startswith(f"{version('sandbox2d')}+src.")


def test_what_only_displays_and_the_times_of_files_do_not_count(package: Path) -> None:
    before = told(package)
    for room in DISPLAY:
        (package / room / "new.py").write_text("")
    for file in package.rglob("*.py"):
        os.utime(file, (0, 0))
    assert told(package) == before
    (package / "engines" / "new.py").write_text("")
    assert told(package) != before
