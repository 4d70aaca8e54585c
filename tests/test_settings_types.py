"""Type checkers know the settings of the solver, the classes of scenes and the types of results."""

import re
import subprocess
import sys
from pathlib import Path
from typing import get_type_hints

import pytest

import sandbox

ROOT = Path(sandbox.__file__).parents[1]
STUDY = Path(__file__).parent / "study_script.py"

WRONG_CALLS = """\
import sandbox

scene = sandbox.load("bounce")
sandbox.run(scene, engin="pymunk")
sandbox.run(scene, dtt=1)
sandbox.run(scene, dt="1")
sandbox.run(scene, integrator="rk5")
sandbox.compare(scene, dtt=1)
sandbox.tradeoff(scene, dtt=1)
sandbox.ensemble(scene, 2, vary={}, dtt=1)
sandbox.start(scene, dtt=1)
sandbox.play_out(scene, dtt=1)
sandbox.Ball(position=[0.0, 1.0], radius=1.0, mas=1.0)
sandbox.Ball(position=["0", "1"], radius=1.0)
sandbox.Scene(walls=[sandbox.Plane(point=[0, 0], normal=[0, 1])])
"""


def test_changes_have_the_keys_and_types_of_the_settings() -> None:
    hints = get_type_hints(sandbox.Settings)
    fields = {name: hints[name] for name in sandbox.Settings.model_fields}
    assert get_type_hints(sandbox.SettingsChanges) == fields


@pytest.mark.fail_slow(120)  # mypy reads the whole package
def test_wrong_calls_fail_and_a_study_passes_type_checks(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    wrong = tmp_path / "wrong.py"
    wrong.write_text(WRONG_CALLS, encoding="utf-8")
    # Without the configuration of this project, as users do
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file=", f"--cache-dir={tmp_path}/cache"]
    done = subprocess.run(
        [*command, str(wrong), str(STUDY)],
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
        cwd=tmp_path,
        env={"MYPYPATH": str(ROOT), "PYTHONPATH": str(ROOT)},
    )
    errors = re.findall(r"^(\S+\.py):(\d+): error: ", done.stdout, re.MULTILINE)
    found = {int(line) for path, line in errors if Path(path).name == wrong.name}
    assert found == set(range(4, WRONG_CALLS.count("\n") + 1)), done.stdout + done.stderr
    assert not [each for each in errors if Path(each[0]).name == STUDY.name], done.stdout


@pytest.mark.fail_slow(60)  # runs on three engines, a trade-off, and a store
def test_study_runs(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(STUDY), str(tmp_path / "store")],
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
        env={"PYTHONPATH": str(ROOT), "HOME": str(tmp_path)},
    )
    assert (done.returncode, done.stderr.count("Traceback")) == (0, 0), done.stderr
    assert [line.split()[0] for line in done.stdout.splitlines()[:3]] == ["pymunk", "reference", "exact"]
