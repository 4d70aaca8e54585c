"""`sandbox export`: tables, pictures and films of stored runs; faults are reported before any work."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest
from PIL import Image

from sandbox.action import Impulse, Spawn
from sandbox.cli.main import call
from sandbox.measure.run.runner import run
from sandbox.recording import Recording
from sandbox.report import table_export as tables
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import loads
from sandbox.trajectory import Trajectory
from sandbox.window.capture import limits
from tests.cli.calling import DROP, document_from, json_of, lines_of, output_of, write_scene
from tests.films import gif_frames, mp4_frames
from tests.interruptible import interrupted

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

SCENE = loads(DROP)
SMALL = ("--size", "160x90")


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    """Return a folder with one run of half a second, made by `sandbox run --out`."""
    folder = tmp_path / "runs"
    assert call(["run", write_scene(tmp_path), "--out", str(folder), "--quiet"]) == 0
    return folder


def id_in(folder: Path) -> str:
    (path,) = folder.glob("*.npz")
    return path.stem


def csv_rows(path: Path) -> list[list[str]]:
    return [line.split(",") for line in path.read_text(encoding="utf-8").splitlines()]


def recorded(**changes: object) -> Recording:
    fields = {"engine": "pymunk", "settings": Settings(), "actions": (), "duration": 0.3} | changes
    return Recording(scene=SCENE, **fields)


@pytest.mark.parametrize("pattern", ["{folder}/{id}.npz", "{folder}/{id}", "{folder}", "{folder}/"])
def test_run_is_found_by_file_id_or_folder(pattern, stored, tmp_path, capfd):
    name, target = pattern.format(folder=stored, id=id_in(stored)), tmp_path / "a.csv"
    document = document_from(capfd, "export", name, "--to", str(target))
    assert document == {"run": name, "files": [{"path": str(target), "format": "csv", "rows": 51}]}
    assert len(csv_rows(target)) == 52


def test_csv_and_parquet_contain_the_positions_of_the_run(stored, tmp_path, capfd):
    targets = [tmp_path / "a.csv", tmp_path / "a.parquet"]
    out = output_of(capfd, "export", str(stored), *(f"--to={target}" for target in targets))
    assert out == [f"written: {target} (51 rows)" for target in targets]
    trajectory = Trajectory.load(stored / f"{id_in(stored)}.npz")
    rows = csv_rows(targets[0])[1:]
    assert [float(row[3]) for row in rows] == trajectory.position[:, 0, 1].tolist()
    assert parquet.read_table(targets[1])["y"].to_pylist() == trajectory.position[:, 0, 1].tolist()


def test_contacts_and_time_range_select_rows_of_tables(stored, tmp_path, capfd):
    target = tmp_path / "a.csv"
    status, out, _ = lines_of(capfd, "export", str(stored), "--to", str(target), "--contacts")
    assert (status, out) == (0, [f"written: {target} (1 row)"])
    assert csv_rows(target)[1][1:3] == ["a", "ground"]
    assert (
        lines_of(capfd, "export", str(stored), "--to", str(target), "--contacts", "--until", "0.2", "--quiet")[0] == 0
    )
    assert len(csv_rows(target)) == 1
    assert lines_of(capfd, "export", str(stored), "--to", str(target), "--from=0.1", "--until=0.2", "--quiet")[1] == []
    times = [float(row[0]) for row in csv_rows(target)[1:]]
    assert times == pytest.approx(np.arange(10, 21) * 0.01, rel=1e-12)  # time is a sum of steps


@pytest.mark.parametrize(
    ("words", "count", "milliseconds"),
    [
        ((), 15, 500),
        (("--speed", "2", "--fps", "50"), 12, 250),
        (("--from", "0.1", "--until", "0.35"), 7, 250),
        (("--from", "0.5"), 1, 30),
    ],
)
def test_gif_has_the_duration_of_its_part_of_the_run(words, count, milliseconds, stored, tmp_path):
    target = tmp_path / "a.gif"
    assert call(["export", str(stored), "--to", str(target), *words, *SMALL, "--quiet"]) == 0
    frames, durations = gif_frames(target)
    assert len(frames) == count
    assert abs(sum(durations) - milliseconds) <= 10  # ms, the resolution of gif durations


def test_mp4_has_the_same_frames_as_the_gif(stored: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    targets = [str(tmp_path / "a.mp4"), str(tmp_path / "a.gif")]
    words = ("--to", targets[0], "--to", targets[1], *SMALL)
    status, document, _ = json_of(capfd, "export", str(stored), *words)
    assert (status, [file["frames"] for file in document["files"]]) == (0, [15, 15])
    films, description = mp4_frames(Path(targets[0]))
    gifs, _ = gif_frames(Path(targets[1]))
    assert "30 fps" in description
    assert len(films) == 15
    for film, gif in zip(films, gifs, strict=True):
        assert np.abs(film - gif).mean() < 3  # of 255: the gif has fewer colours, the mp4 softer edges


def test_png_has_the_given_width_and_overlays(stored: Path, tmp_path: Path) -> None:
    plain, full = tmp_path / "a.png", tmp_path / "b.png"
    assert call(["export", str(stored), "--to", str(plain), "--quiet"]) == 0
    with Image.open(plain) as image:
        assert image.size == (960, 540)
    words = ("--width", "320", "--at", "0.2")
    assert call(["export", str(stored), "--to", str(plain), *words, "--quiet"]) == 0
    overlays = ("--overlay", "velocities", "--overlay", "energy", "--overlay", "names")
    assert call(["export", str(stored), "--to", str(full), *words, *overlays, "--quiet"]) == 0
    with Image.open(plain) as first, Image.open(full) as second:
        assert first.size == second.size == (320, 180)
        assert first.tobytes() != second.tobytes()


def test_recording_is_run_before_it_is_exported(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    session = recorded(
        actions=(
            Impulse(time=0.0, body="a", impulse=(1.0, 0.0)),
            Spawn(time=0.1, ball=Ball(name="late", position=(4.0, 4.0), radius=0.25)),
        )
    )
    name = str(session.save(tmp_path / "session.json"))
    targets = ("--to", str(tmp_path / "a.csv"), "--to", str(tmp_path / "a.png"))
    status, document, err = json_of(capfd, "export", name, *targets)
    assert (status, err, [file["format"] for file in document["files"]]) == (0, [], ["csv", "png"])
    rows = csv_rows(tmp_path / "a.csv")[1:]
    assert {row[1] for row in rows} == {"a", "late"}
    last = [row for row in rows if row[1] == "a"][-1]
    assert float(last[0]) == 0.3
    assert float(last[2]) == pytest.approx(0.3, rel=1e-12)  # 1 m/s for 0.3 s, a sum of steps


def test_diverging_recording_is_exported_until_it_diverges_with_status_1(tmp_path, capfd):
    text = DROP.replace("gravity = [0.0, -10.0]", "gravity = [1e9, 0.0]")
    session = Recording(loads(text), "pymunk", Settings(dt=0.1), (), 10.0)
    name = str(session.save(tmp_path / "session.json"))
    status, document, err = json_of(capfd, "export", name, "--to", str(tmp_path / "a.csv"))
    assert (status, len(document["files"]), len(err)) == (1, 1, 1)
    assert err[0].startswith(f"{name}: diverged: at ")


def test_refused_recording_exports_nothing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    session = recorded(settings=Settings(broad_phase="oriented"))
    name = str(session.save(tmp_path / "session.json"))
    status, document, err = json_of(capfd, "export", name, "--to", str(tmp_path / "a.csv"))
    assert (status, document) == (1, {"run": name, "files": []})
    assert len(err) == 1
    assert err[0].startswith(f"{name}: refused: pymunk refuses: ")
    assert err[0].endswith("no frames to export")
    assert not (tmp_path / "a.csv").exists()


def test_all_faults_are_reported_together_and_nothing_is_written(tmp_path, capfd):
    words = ("--to", "a.txt", "--to", f"{tmp_path}/nowhere/a.gif", "--fps=60", "--speed=0", "--size=big", "--from=-1")
    status, document, err = json_of(capfd, "export", str(tmp_path / "none"), *words, "--overlay", "glitter")
    assert (status, document["files"]) == (2, [])
    assert [fault["file"] for fault in document["faults"]] == [
        "--to", "--to", "--from", "--speed", "--fps", "--size", "--overlay", str(tmp_path / "none"),
    ]  # fmt: skip
    assert [line.partition(": ")[0] for line in err] == [fault["file"] for fault in document["faults"]]
    assert list(tmp_path.iterdir()) == []


WRONG = """
→ --to: is missing
--to=a → --to: a:
--to=a.csv --to=./a.csv → --to: ./a.csv: is given twice
--to=no/a.csv → --to: no/a.csv: no such folder: no
--to=runs.csv → --to: runs.csv: is a folder
--to=a.csv --fps=10 → --fps: applies to .gif, .mp4 only
--to=a.csv --overlay=names → --overlay: applies to .gif, .mp4, .png only
--to=a.gif --at=0 → --at: applies to .png only
--to=a.png --contacts → --contacts: applies to .csv, .parquet only
--to=a.gif --fps=51 → --fps: is 51
--to=a.mp4 --fps=nan → --fps: is nan
--to=a.mp4 --speed=nan → --speed: is nan
--to=a.png --width=10 → --width: is 10x6
--to=a.png --size=99999x10 → --size: is 99999x10
--to=a.png --size=9x9x9 → --size: '9x9x9'
--to=a.png --size=90x90 --width=90 → --width:
--to=a.mp4 --size=91x90 → --size: is 91x90
--to=a.png --at=0.6 → --at: is 0.6 s
--to=a.png --at=inf → --at: is inf s
--to=a.csv --from=0.6 → --from: is 0.6 s
--to=a.csv --from=0.3 --until=0.2 → --until: is 0.2 s
--to=a.png --overlay=glitter → --overlay: unknown: 'glitter'
--to=a.gif --speed=0.001 → --to: the film would have 15,000 frames
"""
"""Options, and a part of the message."""


@pytest.mark.parametrize("row", WRONG.strip().splitlines())
def test_faulty_option_is_reported_in_one_line_and_nothing_is_written(row, stored, capfd, monkeypatch):
    words, _, message = row.partition("→ ")
    monkeypatch.chdir(stored.parent)
    Path("runs.csv").mkdir()
    before = sorted(Path.cwd().iterdir())
    status, out, err = lines_of(capfd, "export", str(stored), *words.split())
    assert (status, out, len(err)) == (2, [], 1)
    assert message in err[0]
    assert sorted(Path.cwd().iterdir()) == before


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "no such run"), (b'title = "A scene"', "neither a stored run (.npz) nor a recorded session (.json)"),
        (b"PK\x03\x04damaged", "is not a stored run: "), (b"{}", "`format`"),
        (b'{"format": 1, "scene": {}}', "cannot be read as a session: "),
    ],
)  # fmt: skip
def test_file_that_is_not_a_run_is_a_fault(content, message, tmp_path, capfd):
    path = tmp_path / "run"
    if content is not None:
        path.write_bytes(content)
    status, out, err = lines_of(capfd, "export", str(path), "--to", str(tmp_path / "a.csv"))
    assert (status, out, len(err)) == (2, [], 1)
    assert err[0].startswith(f"{path}: ")
    assert message in err[0]


def test_missing_extras_are_reported_before_any_file_is_written(stored, tmp_path, capfd, monkeypatch):
    monkeypatch.setattr(limits, "can_make_mp4", lambda: False)
    monkeypatch.setattr(tables, "can_write_parquet", lambda: False)
    words = [f"--to={tmp_path}/a{suffix}" for suffix in (".csv", ".parquet", ".mp4")]
    status, _, err = lines_of(capfd, "export", str(stored), *words)
    assert (status, len(err)) == (2, 2)
    assert 'pip install -e ".[parquet]"' in err[0]
    assert 'pip install -e ".[video]"' in err[1]
    assert not (tmp_path / "a.csv").exists()


WITHOUT_DISPLAY = """
import os, sys
from sandbox.cli.main import call
status = call(sys.argv[1:])
pygame = sys.modules.get("pygame")
print(status, pygame is not None and pygame.display.get_init(), "SDL_VIDEODRIVER" in os.environ)
print(*(name for name in ("pygame", "pyarrow", "PIL", "matplotlib", "pymunk", "rich") if name in sys.modules))
"""


@pytest.mark.parametrize("suffix", [".png", ".csv"])
def test_export_needs_no_display_and_a_table_no_graphics(suffix: str, stored: Path, tmp_path: Path) -> None:
    env = {key: value for key, value in os.environ.items() if not key.startswith(("SDL_", "DISPLAY", "PYGAME"))}
    words = ["export", str(stored), "--to", str(tmp_path / f"a{suffix}"), "--quiet"]
    script = [sys.executable, "-c", WITHOUT_DISPLAY, *words]
    done = subprocess.run(script, capture_output=True, text=True, env=env, timeout=120, check=False)
    first, modules = done.stdout.splitlines()
    assert (first, done.stderr) == ("0 False False", "")
    assert modules == "" or suffix == ".png"


def repeated(trajectory: Trajectory) -> Trajectory:
    """Return the run repeated 20,000 times, which takes minutes to export."""
    repeats = 20_000
    states = {name: getattr(trajectory, name) for name in ("position", "velocity", "angle", "angular_velocity")}
    count = repeats * len(trajectory.time)
    states = {name: np.tile(array, (repeats, *[1] * (array.ndim - 1))) for name, array in states.items()}
    scene = {**trajectory.info["scene"], "world": {"duration": count * 1e-3}}
    info = {**trajectory.info, "scene": scene, "steps": count, "state_hash": None}
    return replace(trajectory, time=np.arange(count) * 1e-3, info=info, **states)


@pytest.mark.parametrize(
    "suffix", [".csv", *(pytest.param(each, marks=pytest.mark.nightly) for each in (".gif", ".mp4", ".parquet"))]
)
def test_interrupted_export_keeps_finished_files_and_leaves_no_partial_file(suffix: str, tmp_path: Path) -> None:
    repeated(run(SCENE)).save(tmp_path / "run.npz")
    out = tmp_path / "out"
    out.mkdir()
    words = ["export", "run.npz", "--to", "out/first.png", "--to", f"out/film{suffix}", "--to", "out/last.png"]
    film = ["--fps", "2"] if suffix in (".gif", ".mp4") else []
    status, printed, err = interrupted(
        [*words, *film], lambda: (out / "first.png").exists() and bool(list(out.glob(".*.tmp"))), tmp_path
    )
    assert (status, err) == (130, "interrupted: 1 of 3 files are complete and kept\n")
    assert printed == "written: out/first.png (1 frame)\n"
    assert [path.name for path in out.iterdir()] == ["first.png"]
