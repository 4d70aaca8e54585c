"""The command line in general: help, usage errors, imported modules, closed pipes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sandbox.cli.main import COMMANDS
from sandbox.engines.registry import ENGINES
from sandbox.provenance import versions
from sandbox.scene.files.shipped_scenes import shipped
from tests.cli.calling import json_of, lines_of, output_of, process, write_scene


def test_commands_are_the_documented_ones() -> None:
    expected = (
        "run runs play serve compare tradeoff advise shots extremes report record rehearse import check warm scenes "
        "engines schema export replay miss match"
    )
    assert list(COMMANDS) == expected.split()


@pytest.mark.parametrize("command", [None, *COMMANDS])
def test_help_of_every_command_fits_into_80_columns(command: str | None, capfd: pytest.CaptureFixture[str]) -> None:
    words = [] if command is None else [command]
    out = output_of(capfd, *words, "--help")
    assert out[0].startswith(f"Usage: {' '.join(['sandbox', *words])} ")
    assert lines_of(capfd, *words, "-h") == (0, out, [])
    assert max(map(len, out)) <= 80
    if command is None:
        assert all(f"\n  {each} " in "\n".join(out) for each in COMMANDS)


def test_help_and_version_work_as_a_process() -> None:
    done = process("--help")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("Usage: sandbox ")
    done = process("--version")
    assert (done.returncode, done.stdout.split()[0]) == (0, "sandbox,")
    assert all(f"{name} {number}" in done.stdout for name, number in versions().items() if name != "sandbox")
    assert versions()["sandbox"] in done.stdout


def test_call_without_a_command_prints_suggestions_and_is_status_2(capfd: pytest.CaptureFixture[str]) -> None:
    status, out, err = lines_of(capfd)
    assert (status, out) == (2, [])
    assert [line for line in err if line.startswith("  sandbox ")]  # suggestions


def test_scenes_are_listed_one_per_line(capfd: pytest.CaptureFixture[str]) -> None:
    status, out, err = lines_of(capfd, "scenes")
    names = [scene.name for scene in shipped()]
    assert (status, [line.split()[0] for line in out], err) == (0, names, [])
    status, document, _ = json_of(capfd, "scenes")
    assert (status, [scene["name"] for scene in document["scenes"]]) == (0, names)
    assert all(scene["title"] and scene["about"] for scene in document["scenes"])


def test_engines_are_listed_one_per_line(capfd: pytest.CaptureFixture[str]) -> None:
    status, out, err = lines_of(capfd, "engines")
    assert (status, [line.split()[0] for line in out], err) == (0, list(ENGINES), [])
    status, document, _ = json_of(capfd, "engines")
    assert (status, [engine["name"] for engine in document["engines"]]) == (0, list(ENGINES))
    assert "ball-plane" in document["engines"][0]["models"]


LIST_MODULES = """
import sys
from sandbox.cli.main import call
status = call(sys.argv[2:])
heavy = [name for name in sys.argv[1].split(",") if name in sys.modules]
print(status, *heavy, file=sys.stderr)
"""


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    ("arguments", "unneeded"),
    [
        (("--help",), "numpy,pydantic,pymunk,matplotlib,rich"),
        (("scenes",), "numpy,pydantic,pymunk,matplotlib,rich"),
        (("check", "bounce"), "numba,matplotlib,rich,sqlite3,tomlkit"),
        (("check", "bounce", "--no-trial"), "numba,pymunk,matplotlib,rich,sqlite3,tomlkit"),
        (("schema",), "numba,numpy,pymunk,matplotlib,rich"),
        (("engines",), "numba,pymunk,matplotlib,rich"),
        (("run", "bounce", "--set", "world.duration=0.01", "--json"), "numba,matplotlib,rich,pygame"),
    ],
)
def test_command_does_not_import_modules_it_does_not_need(arguments: tuple[str, ...], unneeded: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", LIST_MODULES, unneeded, *arguments],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    assert done.stderr == "0\n"


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize(
    "arguments", [("scenes",), ("schema",), ("check", "pile"), ("run", "drop.toml"), ("run", "drop.toml", "--json")]
)
def test_closed_pipe_is_not_an_error(arguments: tuple[str, ...], tmp_path: Path) -> None:
    write_scene(tmp_path)
    reader, writer = os.pipe()
    os.close(reader)  # every write meets a closed pipe, as after `| head` has ended
    try:
        done = subprocess.run(
            [sys.executable, "-m", "sandbox", *arguments],
            stdout=writer,
            stderr=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
            timeout=120,
            check=False,
        )
    finally:
        os.close(writer)
    assert (done.returncode, done.stderr) == (0, "")
