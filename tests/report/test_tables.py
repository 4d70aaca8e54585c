"""Tables of runs: every number bit for bit, and complete files or none."""

import csv
import json
import tracemalloc
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest

from sandbox.action import Remove, Spawn
from sandbox.measure.run.runner import run
from sandbox.report import table_export as tables
from sandbox.report.table_export import CONTACTS, STATES, MissingExtraError, write_contacts, write_states
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import loads
from sandbox.trajectory import Trajectory
from tests.toml_text import toml

SCENE = loads(
    toml("world", gravity=[0.1, -9.81], duration=0.5)
    + toml("plane", name="ground, the", point=[0, 0], normal=[0.01, 1])
    + toml("post", name='a "peg"', position=[3, 0.3], radius=0.3)
    + toml("ball", name="a", position=[0, 0.6], radius=0.5, restitution=0.3, friction=0.5)
    + toml("ball", name="b", position=[3.1, 0.9], radius=0.2)
    + toml("ball", name="c", position=[0.3, 1.7], radius=0.5)
)

ACTIONS = (Spawn(time=0.1, ball=Ball(name="late", position=(9.0, 9.0), radius=0.1)), Remove(time=0.2, body="b"))


def recorded_run() -> Trajectory:
    """Return a run with three kinds of contact, an added and a removed body."""
    trajectory = run(SCENE, actions=ACTIONS)
    assert {tuple(pair) for pair in trajectory.contact_pair.tolist()} >= {(0, 2), (0, -1), (1, -2)}
    return trajectory


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def bits(values: object) -> list[int]:
    """Return floats as their bits; all NaNs are equal, regardless of their sign."""
    array = np.asarray(values, np.float64)
    return np.where(np.isnan(array), np.float64("nan"), array).view(np.int64).tolist()


def test_states_as_csv_have_the_bits_of_the_run(tmp_path: Path) -> None:
    trajectory, path = recorded_run(), tmp_path / "states.csv"
    count = write_states(trajectory, path)
    rows = rows_of(path)
    frames, bodies = trajectory.angle.shape
    assert (len(rows), tuple(rows[0])) == (count, STATES) == (frames * bodies, STATES)
    assert [row["body"] for row in rows[:bodies]] == ["a", "b", "c", "late"]
    columns = {
        "time": np.repeat(trajectory.time, bodies),
        "x": trajectory.position[..., 0],
        "y": trajectory.position[..., 1],
        "vx": trajectory.velocity[..., 0],
        "vy": trajectory.velocity[..., 1],
        "angle": trajectory.angle,
        "angular_velocity": trajectory.angular_velocity,
    }
    for name, values in columns.items():
        assert bits([float(row[name]) for row in rows]) == bits(values.ravel())


def test_present_column_is_true_only_while_a_body_exists(tmp_path: Path) -> None:
    trajectory, path = recorded_run(), tmp_path / "states.csv"
    write_states(trajectory, path)
    present = {name: [] for name in trajectory.names.tolist()}
    for row in rows_of(path):
        assert row["present"] in ("true", "false")
        if row["present"] == "true":
            present[row["body"]].append(float(row["time"]))
    time = trajectory.time.tolist()
    assert present["a"] == time
    assert present["b"] == [t for t in time if t < trajectory.retired_time[1]]
    assert 0 < len(present["b"]) < len(time)
    assert present["late"] == time[time.index(present["late"][0]) :]
    assert present["late"][0] == pytest.approx(0.11)  # the first frame after its step


def test_contacts_as_csv_have_names_and_bits(tmp_path: Path) -> None:
    trajectory, path = recorded_run(), tmp_path / "contacts.csv"
    count = write_contacts(trajectory, SCENE.fixed_names, path)
    rows = rows_of(path)
    assert (len(rows), tuple(rows[0])) == (count, CONTACTS) == (len(trajectory.contact_time), CONTACTS)
    fixed = {-1: "ground, the", -2: 'a "peg"'}
    for row, pair in zip(rows, trajectory.contact_pair.tolist(), strict=True):
        names = [fixed[index] if index < 0 else str(trajectory.names[index]) for index in pair]
        assert [row["a"], row["b"]] == names
    for column, values in (("point", trajectory.contact_point), ("impulse", trajectory.contact_impulse)):
        for k, axis in enumerate("xy"):
            assert bits([float(row[f"{column}_{axis}"]) for row in rows]) == bits(values[:, k])
    assert bits([float(row["time"]) for row in rows]) == bits(trajectory.contact_time)
    assert bits([float(row["normal_y"]) for row in rows]) == bits(trajectory.contact_normal[:, 1])


@pytest.mark.parametrize("chunk", [3, 7, 1 << 16])
def test_parquet_is_equal_to_csv(chunk: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "CHUNK", chunk)  # a chunk of 3 splits a frame of 4 bodies
    trajectory = recorded_run()
    for suffix in (".csv", ".parquet"):
        write_states(trajectory, tmp_path / f"states{suffix}")
        write_contacts(trajectory, SCENE.fixed_names, tmp_path / f"contacts{suffix}")
    for stem, columns in (("states", STATES), ("contacts", CONTACTS)):
        rows = rows_of(tmp_path / f"{stem}.csv")
        table = parquet.read_table(tmp_path / f"{stem}.parquet")
        assert tuple(table.column_names) == columns
        assert json.loads(table.schema.metadata[b"sandbox"])["versions"] == trajectory.info["versions"]
        for column in columns:
            values = table[column].to_pylist()
            if column in ("body", "a", "b"):
                assert values == [row[column] for row in rows]
            elif column == "present":
                assert values == [row[column] == "true" for row in rows]
            else:
                assert bits(values) == bits([float(row[column]) for row in rows])


@pytest.mark.parametrize("value", [0.1 + 0.2, 5e-324, -0.0, 1.7976931348623157e308, np.pi, np.inf])
def test_every_double_is_preserved(value: float, tmp_path: Path) -> None:
    trajectory = run(loads("[world]\nduration = 0.01\n[[ball]]\nposition = [0, 0]\nradius = 1"))
    trajectory.angle[:] = value
    write_states(trajectory, tmp_path / "a.csv")
    write_states(trajectory, tmp_path / "a.parquet")
    assert bits([float(row["angle"]) for row in rows_of(tmp_path / "a.csv")]) == bits([value, value])
    assert bits(parquet.read_table(tmp_path / "a.parquet")["angle"].to_pylist()) == bits([value, value])


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_run_without_contacts_yields_a_table_without_rows(suffix: str, tmp_path: Path) -> None:
    trajectory = run(loads("[world]\nduration = 0.01\n[[ball]]\nposition = [0, 0]\nradius = 1"))
    path = tmp_path / f"contacts{suffix}"
    assert write_contacts(trajectory, (), path) == 0
    head = path.read_text().strip().split(",") if suffix == ".csv" else parquet.read_table(path).column_names
    assert tuple(head) == CONTACTS


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_interrupted_table_leaves_the_previous_file(
    suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"states{suffix}"
    path.write_bytes(b"old")
    monkeypatch.setattr(tables, "CHUNK", 8)
    original, calls = np.repeat, []

    def interrupted(*args: object) -> object:
        calls.append(args)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return original(*args)

    trajectory = recorded_run()
    monkeypatch.setattr(tables.np, "repeat", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_states(trajectory, path)
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    assert path.read_bytes() == b"old"


def test_parquet_without_its_extra_names_the_command_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tables, "can_write_parquet", lambda: False)
    with pytest.raises(MissingExtraError, match=r'pip install -e "\.\[parquet\]"'):
        write_states(recorded_run(), tmp_path / "states.parquet")
    with pytest.raises(ValueError, match=r"ends in \.csv or \.parquet, not '\.txt'"):
        write_states(recorded_run(), tmp_path / "states.txt")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_writing_a_table_takes_little_additional_memory(
    suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tables, "CHUNK", 1024)
    count, frames = 2000, 60
    trajectory = run(loads("[world]\nduration = 0.01\n[[ball]]\nposition = [0, 0]\nradius = 1"))
    states = np.random.default_rng(1).normal(size=(6, frames, count))
    large = Trajectory(
        **{name: getattr(trajectory, name) for name in trajectory.__dataclass_fields__}
        | {
            "time": np.arange(float(frames)),
            "position": np.moveaxis(states[:2], 0, 2),
            "velocity": np.moveaxis(states[2:4], 0, 2),
            "angle": states[4],
            "angular_velocity": states[5],
            "names": np.asarray([f"ball-{k}" for k in range(count)]),
            "retired_time": np.full(count, np.nan),
        }
    )
    write_states(trajectory, tmp_path / f"first{suffix}")  # so that imports are not measured
    tracemalloc.start()
    try:
        assert write_states(large, tmp_path / f"states{suffix}") == count * frames
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < states.nbytes / 2  # of 5.8 MB; it depends on the chunk and the names, not on the frames
