"""A full disk in the middle of a write: one line and status 2, no partial file, existing files unchanged."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from sandbox.batch.store import Store
from tests.cli.calling import DROP, json_of, write_scene

pytestmark = pytest.mark.full  # child processes and command lines that run long

SCRIPT = """
import json, resource, sys
from sandbox.cli.main import call
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]), resource.RLIM_INFINITY))
print(json.dumps([call(words) for words in json.loads(sys.argv[2])]))
"""
"""A limit on the file size makes a write fail as a full disk does; Python ignores its signal."""
ENDINGS = ("csv", "parquet", "gif", "png")


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize(
    ("limit", "endings"), [(3000, ENDINGS), pytest.param(0, (*ENDINGS, "mp4"), marks=pytest.mark.slow)]
)
def test_full_disk_is_reported_once_per_file_and_leaves_no_file(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], limit: int, endings: tuple[str, ...]
) -> None:
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
