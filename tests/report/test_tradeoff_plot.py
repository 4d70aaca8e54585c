"""The plot of a trade-off: a line per method, the front, floors and limits, and failures above all points."""

from pathlib import Path
from typing import Any

import pytest

from sandbox.report.tradeoff_plot import draw_tradeoff, plot_tradeoff


def point(engine: str, dt: float, error: float | None, cost: float | None, status: str = "ok") -> dict[str, Any]:
    return {
        "engine": engine,
        "settings": {"dt": dt, "substeps": 1},
        "error": error,
        "cost_ms_per_second": cost,
        "status": status,
        "reason": None if status == "ok" else "it ran away",
    }


@pytest.fixture
def document() -> dict[str, Any]:
    points = [point("pymunk", 0.01, 0.1, 2.0), point("pymunk", 0.001, 0.01, 20.0), point("exact", 0.01, 0.0, 30.0)]
    failed = point("pymunk", 0.1, None, 0.5, "diverged")
    request = {"metric": "max_position", "unit": "m", "tolerance": 0.02, "budget": 0.5, "fps": 60.0}
    lines = {"floors": {"pymunk": 0.005}, "pareto": points}
    return {"title": "$x$ <b>", "points": [*points, failed], **lines, **request}


def test_lines_are_methods_front_and_bounds(document: dict[str, Any]) -> None:
    (panel,) = draw_tradeoff(document).axes
    assert (panel.get_xscale(), panel.get_yscale()) == ("log", "log")
    fronts = [line for line in panel.lines if line.get_linewidth() == 3.0]
    assert [list(map(float, front.get_xdata())) for front in fronts] == [[2.0, 20.0, 30.0]]
    assert list(map(float, fronts[0].get_ydata())) == [0.1, 0.01, 1e-16]  # 0 is drawn at the smallest error
    horizontal = [float(line.get_ydata()[0]) for line in panel.lines if list(line.get_xdata()) == [0, 1]]
    assert horizontal == [0.005, 0.02]
    vertical = [float(line.get_xdata()[0]) for line in panel.lines if list(line.get_ydata()) == [0, 1]]
    assert vertical == [30.0]  # 0.5 ms per frame at 60 frames per second


def test_failure_is_a_cross_above_all_points_at_its_cost(document: dict[str, Any]) -> None:
    (panel,) = draw_tradeoff(document).axes
    ((x, y),) = [line.get_xydata()[0] for line in panel.lines if line.get_marker() == "x"]
    assert x == 0.5
    assert y > 0.1


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_file_is_written(document: dict[str, Any], suffix: str, tmp_path: Path) -> None:
    path = plot_tradeoff(document, tmp_path / f"plot{suffix}")
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    assert path.stat().st_size > 1000
