"""What the README shows is so."""

import re
from pathlib import Path

import pytest

from sandbox.cli.main import COMMANDS, call
from sandbox.measure.run import run
from sandbox.scene.faults import SceneError
from sandbox.scene.file import loads

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")

BAD = """\
title = "Bad"
about = "Three faults"
[world]
duraton = 3

[[ball]]
name = "a"
position = [0.0, 1.0]
radius = -1


material = "rubbr"
"""


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_the_scene_in_ten_lines_runs():
    (text,) = blocks("toml")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    assert len(lines) <= 10
    assert run(loads(text)).status == "ok"


def test_the_python_examples_run(monkeypatch, capsys):
    monkeypatch.chdir(Path(__file__).parents[1])
    first, *others = blocks("python")
    exec(compile(first, "README", "exec"), {})
    assert capsys.readouterr().out.startswith("ok ")
    for text in others:
        exec(compile(text, "README", "exec"), {})
        assert capsys.readouterr().out


def test_faults_read_as_shown():
    with pytest.raises(SceneError) as error:
        loads(BAD, "bad.toml")
    shown = re.findall(r"^bad\.toml:.*$", README, re.MULTILINE)
    assert shown == [str(fault) for fault in error.value.faults]


def test_shown_commands_are_sound():
    for name in re.findall(r"^sandbox (\w+)", "\n".join(blocks("sh")), re.MULTILINE):
        assert name in COMMANDS
    assert call(["check", "pile", "--quiet"]) == 0


def test_two_commands_are_those_of_a_new_machine():
    setups = re.findall(r"^python3 -m venv .*$", README, re.MULTILINE)
    assert [bool(re.search(r"sandbox run|pytest$", line)) for line in setups] == [True, True]
