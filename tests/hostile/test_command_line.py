"""Command line: hostile scenes and arguments end in a fault or a status, never in a traceback or a signal."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.hostile.ordeal import INTERPRETER_FLAGS

pytestmark = pytest.mark.full  # fuzzing and inputs at the ends of their ranges

SCENE = """
[world]
gravity = [0.0, -9.81]
duration = 0.05
[[plane]]
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[ball]]
name = "a"
position = [0.0, 1.0]
radius = 1.0
"""


def run_command(flags: tuple[str, ...], folder: Path, *words: str) -> tuple[int, str]:
    """Run a scene in a child process; return its exit status and stderr."""
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    process = subprocess.run(
        [sys.executable, *flags, "-m", "sandbox", "run", "scene.toml", "--quiet", *words],
        capture_output=True,
        text=True,
        cwd=folder,
        timeout=60,
        check=False,
    )
    assert "Traceback" not in process.stderr
    return process.returncode, process.stderr


@INTERPRETER_FLAGS
@pytest.mark.parametrize(
    "word",
    [
        "ball.a.mass=-1", "ball.a.radius=nan", "world.gravity=[0, inf]", "solver.iterations=0", "solver.dt=-0.01",
        "solver.persistence=0", "ball.a.position=[0, -1001]",
    ],
)  # fmt: skip
def test_override_on_which_pymunk_would_abort_gives_one_line_and_status_2(
    word: str, flags: tuple[str, ...], tmp_path: Path
) -> None:
    status, stderr = run_command(flags, tmp_path, "--set", word)
    assert status == 2
    assert len(stderr.splitlines()) == 1
    assert word.partition("=")[0].split(".")[-1] in stderr


@pytest.mark.parametrize(
    ("words", "status"),
    [
        (("--set", "world.gravity=[1e9, 0]", "--set", "world.duration=10"), 1),
        (("--set", "ball.a.velocity=[0, -1e12]"), 1),
        (("--set", "world.duration=1e9", "--set", "solver.dt=1e-9"), 2),
        (("--sweep", "solver.dt=0.01,-1"), 2),
        (("--sweep", "solver.dt=0.01:inf:3"), 2),
        (("--engine", "zzz"), 2),
        (("--engine", "pymunk", "--set", "solver.detection='swept'"), 1),
    ],
)
def test_invalid_or_diverging_run_has_its_exit_status(words: tuple[str, ...], status: int, tmp_path: Path) -> None:
    exit_status, stderr = run_command((), tmp_path, *words)
    assert exit_status == status
    assert stderr.strip() or status == 1
