"""`sandbox extremes`: document, table, faults, interrupt, time limit."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.cli.calling import json_of, lines_of, process
from tests.interruptible import interruptible

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

SMALL = ("extremes", "--axes", "stiffness,restitution", "--engines", "pymunk,exact", "--quick", "--workers", "1")


@pytest.mark.nightly
def test_document_has_cells_limits_and_predictions(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Two calls give equal documents except for times; heat maps and the document are written."""
    status, document, errors = json_of(capfd, *SMALL, "--out", str(tmp_path))
    assert (status, errors) == (0, [])
    assert {"axis", "level", "engine", "settings", "verdict", "reason"} <= set(document["cells"][0])
    assert {"axis", "engine", "settings", "limit", "first_failure"} <= set(document["limits"][0])
    assert {cell["axis"] for cell in document["cells"]} == {"restitution", "stiffness"}
    assert {cell["verdict"] for cell in document["cells"]} == {"exact", "degraded", "refused", "failed"}
    assert all(cell["reason"] for cell in document["cells"])
    limits = {(limit["axis"], limit["setup"]): limit for limit in document["limits"]}
    assert limits["stiffness", "pymunk"]["limit"] == 1.99
    assert limits["stiffness", "pymunk"]["first_failure"] == 2.01
    assert limits["restitution", "exact"]["first_failure"] is None
    (spring,) = document["predictions"]
    assert spring["kind"] == "spring"
    assert spring["recall"] == 1.0
    assert (tmp_path / "extremes.png").stat().st_size > 10_000
    assert json.loads((tmp_path / "extremes.json").read_text(encoding="utf-8")) == document

    # Second call, against stored limits of which one is larger.
    stored = tmp_path / "extremes.json"
    stored_limits = json.loads(json.dumps(document))
    for limit in stored_limits["limits"]:
        if (limit["axis"], limit["setup"]) == ("stiffness", "pymunk"):
            limit["limit"], limit["bounds"] = 3.0, [3.0, 3.1]
    stored.write_text(json.dumps(stored_limits), encoding="utf-8")
    status, again, (line,) = json_of(capfd, *SMALL, "--against", str(stored))
    assert status == 1
    assert line.startswith("stiffness on pymunk: worse: passed up to 3 before, up to 1.99 now: ")
    assert [change["worse"] for change in again["changes"]] == [True]
    for first, second in zip(document["cells"], again["cells"], strict=True):
        assert {**first, "seconds": 0.0} == {**second, "seconds": 0.0}


def test_table_has_one_line_per_setup(capfd: pytest.CaptureFixture[str]) -> None:
    status, out, errors = lines_of(capfd, "extremes", "--axes", "speed", "--engines", "exact", "--quick")
    assert (status, errors) == (0, [])
    assert out[0] == "speed  exact  EEE  all levels pass, up to 10"
    assert "single axes: 3 cells: 3 exact" in out


def test_levels_are_run_from_starts_of_which_95_percent_must_survive(capfd: pytest.CaptureFixture[str]) -> None:
    words = ("extremes", "--axes", "speed", "--engines", "pymunk", "--quick", "--workers", "1")
    status, single, _ = lines_of(capfd, *words, "--starts", "1")
    assert status == 0
    # From the worst phase a bullet passes as soon as a step is longer than the contact distance; 1 % of the phases do.
    assert re.match(
        r"speed  pymunk +d✗✗ +×1  up to 0\.99, fails at 1\.01: through: the bullet passed the wall", single[0]
    )
    status, several, _ = lines_of(capfd, *words, "--starts", "20")
    assert status == 0
    assert re.match(
        r"speed  pymunk +dd[✗0-2] +×1  up to 1\.01, fails at 10: through: \d+ of 20 starts failed", several[0]
    )
    # 4 substeps stop the bullet in 4 phases of 10; with a step of the same cost the limit is smaller.
    found = re.match(r" +pymunk, 4 substeps +dd([2-6]) +×([\d.]+)  up to 1\.01, (\S+) at equal cost", several[1])
    assert found is not None
    assert float(found[3]) == pytest.approx(1.01 / float(found[2]), rel=0.01)  # three digits
    assert any("from up to 20 starts" in line for line in several)
    assert not any("starts" in line for line in single)


def test_faults_are_reported_one_per_line_before_any_run(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("{}", encoding="utf-8")
    wrong = ("--axes", "speed,nonsense", "--engines", "pymunk,box3d", "--against", str(file), "--out", str(file))
    status, document, errors = json_of(capfd, "extremes", *wrong)
    assert status == 2
    assert (document["cells"], document["limits"]) == ([], [])
    assert len(errors) == len(document["faults"]) == 4
    assert errors[0].startswith("--axes: no axis 'nonsense'; axes: dt, ")
    assert "unknown engine 'box3d'" in errors[1]
    assert "contains no boundaries" in errors[2]
    assert errors[3] == f"--out: {file}: is not a folder"


@pytest.mark.parametrize(
    ("words", "difference"),
    [
        (("--starts", "20"), "--starts 5, not --starts 20"),
        (("--spread", "5%"), "--spread 0.01, not --spread 0.05"),
        (("--set", "solver.iterations=3"), "no --set, not --set 'solver.iterations=3'"),
    ],
)
def test_boundaries_of_other_starts_or_scenes_are_not_compared(capfd, tmp_path, words, difference):
    own = ("extremes", "--axes", "speed", "--engines", "exact", "--quick", "--workers", "1")
    assert lines_of(capfd, *own, "--out", str(tmp_path))[0] == 0
    stored = str(tmp_path / "extremes.json")
    status, out, errors = lines_of(capfd, *own, "--against", stored)
    assert (status, errors) == (0, [])
    assert out[-1] == "no boundary has moved"
    status, document, (line,) = json_of(capfd, *own, *words, "--against", stored)
    assert (status, document["cells"]) == (2, [])
    assert line == f"--against: {stored}: cannot be compared: it was measured with {difference}"


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_interrupted_extremes_keep_finished_cells() -> None:
    words = ["extremes", "--workers", "1", "--json"]  # minutes
    command = subprocess.Popen(interruptible(*words), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        while worker_seconds(command.pid) < 6.0:  # some 2 s of start, then cells of some milliseconds
            assert command.poll() is None
            time.sleep(0.05)
        for _ in range(2):  # a second Ctrl-C while the first is handled
            command.send_signal(signal.SIGINT)
        out, errors = command.communicate(timeout=60.0)
    finally:
        command.kill()
    document = json.loads(out)
    assert command.returncode == 130
    assert document["interrupted"]
    assert document["cells"]
    assert errors == f"interrupted: {len(document['cells'])} cells are complete and kept\n"
    assert all(cell["verdict"] in ("exact", "degraded", "refused", "failed") for cell in document["cells"])


def worker_seconds(pid: int) -> float:
    """Return the largest processor time of the children of a process, s; 0 if there are none."""
    try:
        threads = Path(f"/proc/{pid}/task").glob("*/children")
        children = [child for thread in threads for child in thread.read_text().split()]
        stats = [Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split() for child in children]
    except OSError:  # a process has just ended
        return 0.0
    return max((int(stat[11]) / os.sysconf("SC_CLK_TCK") for stat in stats), default=0.0)


@pytest.mark.nightly
def test_cell_beyond_the_time_limit_fails_and_the_rest_is_run(tmp_path: Path) -> None:
    chosen = ("--axes", "count", "--engines", "exact", "--no-pairs", "--timeout", "0.1", "--json")
    done = process("extremes", *chosen, cwd=tmp_path)
    assert done.returncode == 0
    document = json.loads(done.stdout)
    last = document["cells"][-1]
    assert (last["level"], last["reason"]) == (10_000, "took longer than 0.1 s, and was stopped")
    assert len(document["cells"]) == 5
    assert document["probes"] == []  # a limit set by time would depend on the machine


def test_large_error_of_a_level_that_passes_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    words = ("extremes", "--axes", "restitution", "--engine", "box2d,exact", "--no-pairs")
    status, lines, _ = lines_of(capfd, *words)
    assert status == 0
    # at 60 Hz box2d loses a part of the height at every bounce that is nearly elastic; smaller errors are not printed
    assert re.search(r"box2d +d+  all levels pass, up to 1; at \S+ the error is 0\.\d+ of the drop$", lines[1])
    assert lines[0].endswith("all levels pass, up to 1")
