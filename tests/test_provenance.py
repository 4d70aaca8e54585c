"""Versions: the sources that affect a run are part of them, and thereby of the ids of stored runs."""

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

pytestmark = pytest.mark.fail_slow(60)  # copies the package

PRINT_VERSIONS = """
import json, sandbox
from sandbox.batch.store import run_id
from sandbox.provenance import versions

scene = sandbox.loads('[[ball]]\\nname = "a"\\nposition = [0, 1]\\nradius = 0.5')
id = run_id(scene, "reference", scene.solver, 0, versions())
print(json.dumps([id, versions()["sandbox"], sandbox.__version__, sandbox.__file__]))
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """Return an editable copy of the package."""
    return Path(shutil.copytree(PACKAGE, tmp_path / "sandbox", ignore=shutil.ignore_patterns("__pycache__")))


def id_and_version(package: Path) -> tuple[str, str]:
    """Return the id of a run and the version of the sandbox, both computed by a copy of the package."""
    environment = os.environ | {"PYTHONPATH": str(package.parent), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-c", PRINT_VERSIONS]
    done = subprocess.run(
        command, cwd=package.parent, env=environment, capture_output=True, text=True, check=True, timeout=120
    )
    run_id, full_version, plain_version, file = json.loads(done.stdout)
    assert Path(file).parent == package
    assert plain_version == version("sandbox2d")
    return run_id, full_version


def test_edited_integrator_changes_the_version_and_the_run_id(package: Path) -> None:
    before = id_and_version(package)
    assert before[1] == versions()["sandbox"]
    module = sys.modules[type(sandbox.INTEGRATORS["rk4"]).__module__]
    edited = package / Path(str(module.__file__)).relative_to(PACKAGE)
    edited.write_text(f"{edited.read_text(encoding='utf-8')}\n# edited\n", encoding="utf-8")
    after = id_and_version(package)
    assert after[0] != before[0]
    assert after[1] != before[1]
    assert after[1].startswith(f"{version('sandbox2d')}+src.")


def test_display_modules_and_file_times_do_not_change_the_version(package: Path) -> None:
    before = id_and_version(package)
    for folder in DISPLAY:
        (package / folder / "new.py").write_text("")
    for file in package.rglob("*.py"):
        os.utime(file, (0, 0))
    assert id_and_version(package) == before
    (package / "engines" / "new.py").write_text("")
    assert id_and_version(package) != before
