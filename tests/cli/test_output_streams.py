"""Standard streams that are full, closed, or lack characters: one line or silence, no traceback."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sandbox.batch.store import Store
from sandbox.cli.main import COMMANDS
from sandbox.engines.common.compile_clock import ANNOUNCEMENT
from tests.cli.calling import DROP, document_of, write_scene

pytestmark = pytest.mark.full  # child processes and command lines that run long

UNICODE_DROP = DROP.replace('title = "Drop"', 'title = "μ − 🎱 é"').replace("duration = 0.5", "duration = 0.05")

QUICK = ("--help", "engines --json", "run drop.toml")
"""Commands that cover every way of writing: click, rich, JSON, and click's own options."""
SLOW = (
    *(f"{command} --help" for command in COMMANDS),
    "--version",
    "scenes",
    "run drop.toml --json",
    "schema",
    "schema ball",
    "schema ball --json",
    "check drop.toml",
    "check drop.toml --json",
    "check --expand drop.toml",
    "compare drop.toml",
    "tradeoff drop.toml",
    "miss drop.toml",
    "shots billiards/straight-rail --count 10",
    "match straight-rail --distance 1 --players bot:0.9,bot:0.8",
    "extremes --quick --axes speed --engine pymunk",
    "report drop.toml --engine pymunk --out page.html",
    "run drop.toml --seeds 2 --workers 2 --ledger --plot drop.png",
)


def shell(command: str, redirection: str, folder: Path, **environment: str) -> tuple[int, str, list[str]]:
    """Run a command with a shell redirection; return exit status, captured stdout, and lines of stderr."""
    done = subprocess.run(
        ["sh", "-c", f'"$0" -m sandbox {command} {redirection}', sys.executable],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        timeout=240,
        check=False,
    )
    err = [line for line in done.stderr.decode().splitlines() if line != ANNOUNCEMENT]
    return done.returncode, done.stdout.decode(errors="replace"), err


FULL, CLOSED = (">/dev/full", "No space left"), (">&-", "closed")
"""A redirection, and a phrase of the expected error."""


def check_failure(command: str, redirection: str, phrase: str, folder: Path) -> None:
    status, _, err = shell(command, redirection, folder)
    assert status == 1
    assert err[-1].startswith("standard output: ")
    assert phrase in err[-1]
    assert not any("Traceback" in line or "Exception" in line for line in err)


def check_silence(command: str, redirection: str, folder: Path) -> None:
    assert shell(command, redirection, folder) == (1, "", [])


def check_success(command: str, redirection: str, folder: Path) -> None:
    status, out, err = shell(command, redirection, folder)
    assert (status, err) == (0, [])
    assert out


@pytest.mark.parametrize("command", QUICK)
def test_unwritable_output_is_reported_in_one_line_or_silently(command: str, tmp_path: Path) -> None:
    write_scene(tmp_path, UNICODE_DROP)
    check_failure(command, *FULL, tmp_path)
    check_silence(command, ">&- 2>&-", tmp_path)
    check_success(command, "2>/dev/full", tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("command", (*QUICK, *SLOW))
def test_no_command_prints_a_traceback_for_unwritable_output(command: str, tmp_path: Path) -> None:
    write_scene(tmp_path, UNICODE_DROP)
    check_failure(command, *FULL, tmp_path)
    check_failure(command, *CLOSED, tmp_path)
    check_failure(command, f"<&- {CLOSED[0]}", CLOSED[1], tmp_path)
    check_silence(command, ">&- 2>&-", tmp_path)
    check_silence(command, ">/dev/full 2>/dev/full", tmp_path)
    check_success(command, "2>/dev/full", tmp_path)
    check_success(command, "2>&- <&-", tmp_path)


@pytest.mark.parametrize("command", ["nonsense", "run drop.toml --engine nothing"])
def test_wrong_input_is_status_2_with_unwritable_stderr(command: str, tmp_path: Path) -> None:
    write_scene(tmp_path, UNICODE_DROP)
    for redirection in ("2>/dev/full", "2>&-", ">&- 2>&- <&-"):
        assert shell(command, redirection, tmp_path) == (2, "", [])


def test_closed_pipe_is_not_a_failure(tmp_path: Path) -> None:
    status, out, err = shell("scenes", "| head -n 1", tmp_path)
    assert (status, out.count("\n"), err) == (0, 1, [])


def test_text_for_closed_streams_is_not_written_into_other_files(tmp_path: Path) -> None:
    write_scene(tmp_path, UNICODE_DROP)
    status, _, _ = shell("run drop.toml --out runs --workers 2 --seeds 2", "<&- >&- 2>&-", tmp_path)
    assert status == 1
    with Store(tmp_path / "runs") as store:
        assert [row.status for row in store.rows()] == ["ok"]
    assert shell("run drop.toml --out runs --quiet", ">&-", tmp_path) == (0, "", [])  # quiet: no output to write


@pytest.mark.parametrize(
    ("command", "encoding"), [("run drop.toml", "latin-1"), ("check drop.toml", "ascii"), ("schema ball", "cp1252")]
)
def test_characters_missing_in_the_encoding_are_no_error(command: str, encoding: str, tmp_path: Path) -> None:
    write_scene(tmp_path, UNICODE_DROP)
    status, out, err = shell(command, "", tmp_path, PYTHONIOENCODING=encoding)
    assert (status, err) == (0, [])
    assert out


@pytest.mark.parametrize("environment", [{"PYTHONIOENCODING": "latin-1"}, {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0"}])
def test_json_is_the_same_in_every_encoding(environment: dict[str, str], tmp_path: Path) -> None:
    write_scene(tmp_path, UNICODE_DROP)
    status, out, _ = shell("run drop.toml --json", "", tmp_path, PYTHONUTF8="0", **environment)
    assert status == 0
    assert document_of(out)["runs"][0]["title"] == "μ − 🎱 é"
    assert json.loads(out)
