"""Standard streams that are full, closed, or lack characters, full disks, and terminals of 80 columns."""

import fcntl
import json
import os
import re
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest

from sandbox.batch.store import Store
from sandbox.cli.main import COMMANDS
from sandbox.engines.common.compile_clock import ANNOUNCEMENT
from tests.cli.calling import DROP, document_of, json_of, write_scene

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long


UNICODE_DROP = DROP.replace('title = "Drop"', 'title = "μ − 🎱 é"').replace("duration = 0.5", "duration = 0.05")

QUICK = ("--help", "engines --json", "run drop.toml")
"""Commands that cover every way of writing: click, rich, JSON, and click's own options."""
SLOW = (
    *(f"{command} --help" for command in COMMANDS), "--version", "scenes", "run drop.toml --json", "schema",
    "schema ball", "schema ball --json", "check drop.toml", "check drop.toml --json", "check --expand drop.toml",
    "compare drop.toml", "tradeoff drop.toml", "miss drop.toml", "shots billiards/straight-rail --count 10",
    "match straight-rail --distance 1 --players bot:0.9,bot:0.8", "extremes --quick --axes speed --engine pymunk",
    "report drop.toml --engine pymunk --out page.html", "run drop.toml --seeds 2 --workers 2 --ledger --plot drop.png",
)  # fmt: skip


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


@pytest.mark.nightly
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


def terminal_output(*arguments: str, cwd: Path) -> list[str]:
    """Call on a pseudo-terminal of 80 columns; return the lines of stdout without escape sequences."""
    screen, terminal = os.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    environment = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "LINES", "NO_COLOR")}
    with subprocess.Popen(
        [sys.executable, "-m", "sandbox", *arguments],
        stdout=terminal,
        stderr=subprocess.DEVNULL,
        cwd=cwd,
        env={**environment, "TERM": "xterm"},
    ) as command:
        os.close(terminal)
        output = b""
        try:
            while more := os.read(screen, 65536):
                output += more
        except OSError:
            pass  # end of output on Linux
        finally:
            os.close(screen)
        assert command.wait(120) == 0
    return re.sub(r"\x1b\[[\d;?]*[a-zA-Z]", "", output.decode()).splitlines()


def test_table_of_many_columns_shows_all_of_them(tmp_path: Path) -> None:
    name = "a scene with a name that is long, and longer, and longer than a line can be.toml"
    write_scene(tmp_path, name=name)
    sweeps = [
        f"solver.{key}" for key in ("dt=0.01,0.005", "iterations=5,10", "persistence=2,3", "half_kick=true,false")
    ]
    out = terminal_output("run", name, *(word for sweep in sweeps for word in ("--sweep", sweep)), cwd=tmp_path)
    assert out[0] == name
    blocks = [k for k, line in enumerate(out) if line.startswith("engine")]
    heads = " ".join(" ".join(out[k].split()) for k in blocks)
    assert all(head in heads for head in ("iterations", "persistence", "half_kick", "status", "position, m", "missed"))
    assert len([line for line in out if line.startswith("pymunk")]) == 16 * len(blocks)
    assert "missed: contacts that the engine missed" in " ".join(out)
    assert not any("…" in line for line in out)


def test_table_of_several_scenes_fits_the_terminal(tmp_path: Path) -> None:
    out = terminal_output("run", "bounce", "bullet", "--set", "world.duration=0.01", cwd=tmp_path)
    assert [line.split()[0] for line in out[:3]] == ["scene", "bounce", "bullet"]
    assert max(map(len, out)) <= 80


def test_warnings_are_folded_between_words(tmp_path: Path) -> None:
    out = terminal_output("check", "bullet", cwd=tmp_path)
    assert max(map(len, out)) <= 80
    begin = next(k for k, line in enumerate(out) if line.startswith("  warning: "))
    folded = " ".join(line.strip() for line in out[begin:])
    assert "0.1 m per substep, and tunnel through it undetected: odds up to 80 %; occurs in " in folded


SCRIPT = """
import json, resource, sys
from sandbox.cli.main import call
sys.dont_write_bytecode = True  # of modules that are imported later: Python would leave half a file
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
print(json.dumps([call(words) for words in json.loads(sys.argv[2])]))
"""
"""A limit on the file size makes a write fail as a full disk does; Python ignores its signal."""
ENDINGS = ("csv", "parquet", "gif", "png")


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize(
    ("limit", "endings"), [(3000, ENDINGS), pytest.param(0, (*ENDINGS, "mp4"), marks=pytest.mark.nightly)]
)
def test_full_disk_is_reported_once_per_file_and_leaves_no_file(tmp_path, capfd, limit, endings):
    scene, folder = write_scene(tmp_path, DROP.replace("duration = 0.5", "duration = 2.0")), tmp_path / "runs"
    _, document, _ = json_of(capfd, "run", scene, "--out", str(folder))
    (tmp_path / "out").mkdir()
    calls = [["export", document["runs"][0]["path"], "--to", str(tmp_path / "out" / f"a.{end}")] for end in endings]
    calls.append(["run", scene, "--quiet", "--plot", str(tmp_path / "out" / "a.png")])
    calls.append(["run", scene, "--quiet", "--out", str(folder), "--set", "world.duration=3.0"])
    before = files(folder)
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(limit), json.dumps(calls)],
        capture_output=True,
        text=True,
        timeout=240,
        check=True,
        cwd=tmp_path,
    )
    assert json.loads(done.stdout) == [2] * len(calls)
    assert len(done.stderr.splitlines()) == len(calls), done.stderr
    with Store(folder) as store:  # an opened database may leave files behind, which the next one clears away
        assert len(store.rows()) == 1
    assert files(folder) == before
    assert files(tmp_path / "out") == {}
