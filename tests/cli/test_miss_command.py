"""`sandbox miss`: table, document, faults."""

import math
from pathlib import Path

import pytest

from tests.cli.calling import json_of, lines_of

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

AIR = """
[world]
gravity = [0.0, -9.81]
[[ball]]
position = [0.0, 0.0]
radius = 1.0
"""


@pytest.fixture
def air(tmp_path: Path) -> str:
    file = tmp_path / "air.toml"
    file.write_text(AIR)
    return str(file)


def test_document_has_one_row_per_engine_integrator_and_step(capfd: pytest.CaptureFixture[str], air: str) -> None:
    status, document, _ = json_of(capfd, "miss", air, "--dt", "0.1", "--dt", "0.05", "--set", "world.linear_drag=0.2")
    assert status == 0
    assert {(row["engine"], row["integrator"]) for row in document["rows"]} == {
        ("pymunk", None),
        ("box2d", None),
        *(("reference", name) for name in ("explicit_euler", "semi_implicit_euler", "velocity_verlet", "leapfrog")),
        ("reference", "rk4"),
    }
    assert [refusal["engine"] for refusal in document["refused"]] == ["exact"]
    for row in document["rows"]:
        assert row["off"] == pytest.approx(row["place"] - document["range"], abs=1e-12)  # rounding of a difference
        assert row["late"] == pytest.approx(row["time"] - document["time"], abs=1e-12)


def test_table_has_the_exact_range_and_the_error_of_each_engine(capfd: pytest.CaptureFixture[str], air: str) -> None:
    status, out, _ = lines_of(capfd, "miss", air, "--dt", "0.1", "--angle", "30", "--speed", "40")
    assert status == 0
    assert f"exact range {1600.0 * math.sin(math.radians(60.0)) / 9.81:.4f} m" in out[0]
    exact = next(line for line in out if line.startswith("exact"))
    assert "less than 1 nm" in exact
    euler = next(line for line in out if "explicit_euler" in line)
    # v_x h is 3.464 m; 0.02 m: curvature of the path within the last step, about a centimetre
    assert float(euler.split()[2]) == pytest.approx(40.0 * math.cos(math.radians(30.0)) * 0.1, abs=0.02)


def test_invalid_shot_scene_or_option_is_refused(capfd: pytest.CaptureFixture[str], air: str) -> None:
    status, _, err = lines_of(capfd, "miss", air, "--set", "world.gravity=[0.0, 0.0]")
    assert status == 2
    assert "world.gravity: the shot does not come down" in err[0]
    status, _, err = lines_of(capfd, "miss", air, "--speed", "1000")  # 1414 m/s / 9.81 m/s² is 144 s
    assert (status, err) == (2, [f"{air}: the shot does not come down within 120 s and 1e+06 m"])


def test_engine_whose_bounds_the_shot_leaves_is_named_with_the_reason(capfd: pytest.CaptureFixture[str]) -> None:
    status, out, _ = lines_of(capfd, "miss", "bounce", "--speed", "1e6", "--angle", "1e-300", "--dt", "1")
    assert status == 0
    assert any(line.startswith("box2d: at 1 s: ") for line in out)
    assert any(line.startswith("pymunk ") for line in out)
