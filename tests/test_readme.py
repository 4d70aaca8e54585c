"""The README: length, scene, messages, links and commands are right. Its examples run in tests/docs."""

import re
from pathlib import Path

import pytest

from sandbox.measure.run.runner import run
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import loads

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")

CHANGES = (("duration", "duraton"), ("radius = 0.5", "radius = -0.5"), ("restitution = 0.8", 'material = "rubbr"'))
"""Changes named in the text that make a faulty file of the first scene."""


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_readme_scene_has_ten_lines_and_runs():
    (text,) = blocks("toml")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    assert len(lines) <= 10
    assert run(loads(text)).status == "ok"


def test_readme_is_one_page():
    assert len(README.splitlines()) <= 150


def test_relative_links_of_the_readme_exist():
    links = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", README)
    assert len(links) > 20
    root = Path(__file__).parents[1]
    assert [link for link in links if not link.startswith("http") and not (root / link).exists()] == []


def test_faults_in_the_readme_are_the_reported_ones():
    (bad,) = blocks("toml")
    for right, wrong in CHANGES:
        assert right in bad
        bad = bad.replace(right, wrong)
    with pytest.raises(SceneError) as error:
        loads(bad, "bad.toml")
    shown = re.findall(r"^bad\.toml:.*$", README, re.MULTILINE)
    assert shown == [str(fault) for fault in error.value.faults]


def test_readme_has_two_setup_commands():
    setups = re.findall(r"^python3 -m venv .*$", README, re.MULTILINE)
    assert [bool(re.search(r"sandbox run|pytest$", line)) for line in setups] == [True, True]
