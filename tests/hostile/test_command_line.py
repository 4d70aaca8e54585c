"""The command line: hostile scenes and words end in a fault or a status, never in a traceback or a signal."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.hostile.ordeal import WAYS

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


def called(flags: tuple[str, ...], folder: Path, *words: str) -> tuple[int, str]:
    """Run a scene as a process of its own; return its status and what it complained of."""
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, *flags, "-m", "sandbox", "run", "scene.toml", "--quiet", *words],
        capture_output=True,
        text=True,
        cwd=folder,
        timeout=60,
        check=False,
    )
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr


@WAYS
@pytest.mark.parametrize(
    "word",
    [
        "ball.a.mass=-1", "ball.a.radius=nan", "world.gravity=[0, inf]", "solver.iterations=0", "solver.dt=-0.01",
        "solver.persistence=0", "ball.a.position=[0, -1001]",
    ],
)  # fmt: skip
def test_word_that_pymunk_would_abort_on_is_one_line_and_status_2(
    word: str, flags: tuple[str, ...], tmp_path: Path
) -> None:
    status, complaint = called(flags, tmp_path, "--set", word)
    assert status == 2
    assert len(complaint.splitlines()) == 1
    assert word.partition("=")[0].split(".")[-1] in complaint


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
def test_run_that_cannot_be_or_diverges_has_its_status(words: tuple[str, ...], status: int, tmp_path: Path) -> None:
    found, complaint = called((), tmp_path, *words)
    assert found == status
    assert complaint.strip() or status == 1
