"""Shell completion: words offered for a partial command line in bash, and in zsh and fish if installed."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sandbox.cli.main import COMMANDS
from sandbox.engines.registry import ENGINES
from sandbox.scene.files.shipped_scenes import shipped

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

SCENE = """
[world]
gravity = [0, -9.81]
[[ball]]
name = "cue"
position = [0, 1]
radius = 0.1
[[ball]]
position = [1, 1]
radius = 0.1
"""


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Change to a folder with a scene, a session, a run and a folder, and put `sandbox` on the PATH."""
    for name in ("mine.toml", ".hidden.toml"):
        (tmp_path / name).write_text(SCENE)
    for name in ("session.json", "run.npz", "yard.svg", "cave.tmx"):
        (tmp_path / name).write_text("")
    (tmp_path / "folder").mkdir()
    programs = tmp_path / "folder" / "bin"
    programs.mkdir()
    program = programs / "sandbox"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m sandbox "$@"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def shell(program: str, script: str) -> list[str]:
    """Return the lines that a shell prints without its start-up files."""
    options = {"bash": ["--norc"], "zsh": ["-f"], "fish": ["--no-config"]}[program]
    done = subprocess.run([program, *options, "-c", script], capture_output=True, text=True, timeout=120, check=False)
    return done.stdout.splitlines()


def in_bash(*lines: str) -> list[list[str]]:
    """Return the words that bash offers for the last, incomplete word of each line."""
    commands = []
    for line in lines:
        words = line.split(" ")
        array = " ".join(f"'{word}'" for word in words)
        commands.append(
            f"COMPREPLY=(); COMP_WORDS=({array}); COMP_CWORD={len(words) - 1}; _sandbox_completion sandbox; "
            'printf "%s\\n" "${COMPREPLY[@]}" ---'
        )
    script = 'eval "$(_SANDBOX_COMPLETE=bash_source sandbox)"; ' + "; ".join(commands)
    offered: list[list[str]] = [[]]
    for word in shell("bash", script):
        offered = [*offered, []] if word == "---" else [*offered[:-1], [*offered[-1], word]]
    return [[word for word in words if word] for words in offered[:-1]]


@pytest.mark.usefixtures("workspace")
def test_bash_offers_commands_options_engines_and_scenes() -> None:
    commands, options, engine, engines, short, folder, session = in_bash(
        "sandbox ",
        "sandbox compare --to",
        "sandbox run bounce --engine ",
        "sandbox compare bounce --engines exact,",
        "sandbox run pendulum_",
        "sandbox play tutorial/b",
        "sandbox run s",
    )
    assert commands[: len(COMMANDS)] == list(COMMANDS)
    assert options == ["--tolerance"]
    assert set(engine) >= set(ENGINES)
    assert engines == [f"exact,{name}" for name in ENGINES if name != "exact"]
    names = [scene.name for scene in shipped()]
    assert set(short) == {name.partition("/")[2] for name in names if "/pendulum_" in name}
    assert folder == [name for name in names if name.startswith("tutorial/b")]
    assert "session.json" in session


@pytest.mark.nightly
@pytest.mark.usefixtures("workspace")
def test_bash_offers_files_and_keys_of_the_scene_on_the_line() -> None:
    files, hidden, runs, levels, tables, names, keys, solver, values = in_bash(
        "sandbox check mi",
        "sandbox check .h",
        "sandbox replay ",
        "sandbox import ",
        "sandbox run mine.toml --set b",
        "sandbox run mine.toml --set ball.",
        "sandbox run mine.toml --set ball.cue.ve",
        "sandbox tradeoff mine.toml --set solver.sub",
        "sandbox run mine.toml --set ball.cue.radius=",
    )
    assert files == ["mine.toml"]
    assert hidden == [".hidden.toml"]
    assert runs == ["folder/", "run.npz", "session.json"]
    assert levels == ["cave.tmx", "folder/", "session.json", "yard.svg"]
    assert tables == ["ball."]
    assert names == ["ball.cue.", "ball.ball-2."]
    assert keys == ["ball.cue.velocity="]
    assert solver == ["solver.substeps="]
    assert values == []


@pytest.mark.usefixtures("workspace")
def test_line_that_cannot_be_completed_offers_nothing_silently() -> None:
    for line in ("sandbox rum bo", "sandbox run no-such-scene --set ball.", "sandbox run x.toml --set q.w.e."):
        words = line.split()
        environment = {"_SANDBOX_COMPLETE": "bash_complete", "COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1)}
        done = subprocess.run(["sandbox"], env=os.environ | environment, capture_output=True, text=True, check=False)
        assert (done.stdout.strip(), done.stderr) == ("", "")


@pytest.mark.usefixtures("workspace")
def test_fish_and_zsh_offer_options_and_commands() -> None:
    if shutil.which("fish"):
        script = "_SANDBOX_COMPLETE=fish_source sandbox | source; complete -C 'sandbox check bounce --en'"
        assert [line.partition("\t")[0] for line in shell("fish", script)] == ["--engine"]
    if shutil.which("zsh"):
        script = (
            'autoload -U compinit; compinit -u -D; eval "$(_SANDBOX_COMPLETE=zsh_source sandbox)"; '
            "print ${_comps[sandbox]}"
        )
        assert shell("zsh", script) == ["_sandbox_completion"]
    environment = {"_SANDBOX_COMPLETE": "zsh_complete", "COMP_WORDS": "sandbox r", "COMP_CWORD": "1"}
    done = subprocess.run(["sandbox"], env=os.environ | environment, capture_output=True, text=True, check=False)
    assert done.stdout.splitlines()[:3] == ["plain", "run", COMMANDS["run"][1]]


def test_completing_a_command_name_imports_no_command() -> None:
    script = (
        "import sys\nfrom sandbox.cli.main import call\ncall([])\n"
        "print([name for name in sys.modules if name.startswith('sandbox.') and 'engines' in name], file=sys.stderr)"
    )
    environment = {"_SANDBOX_COMPLETE": "bash_complete", "COMP_WORDS": "sandbox r", "COMP_CWORD": "1"}
    done = subprocess.run(
        [sys.executable, "-c", script], env=os.environ | environment, capture_output=True, text=True, check=False
    )
    assert (done.stdout.splitlines()[0], done.stderr) == ("plain,run", "[]\n")
