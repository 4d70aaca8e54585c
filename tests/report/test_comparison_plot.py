"""Plots of comparisons: contents of the figures, and written files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sandbox.measure.compare import Comparison, compare, compare_variants
from sandbox.measure.compare.ground_truth import Truth
from sandbox.measure.compare.result import variants_of
from sandbox.measure.metrics.energy import energies
from sandbox.report.comparison_plot import (
    draw_energy,
    draw_error,
    draw_trajectories,
    energy_chart,
    error_chart,
    plot_comparison,
)
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find
from tests.toml_text import toml

DROP = compare(load(find("bounce"), ["world.duration=1.5", "solver.dt=0.01"]), ["pymunk"])
PROJECTILES = compare(
    loads(
        toml(title="Thrown")
        + toml("world", gravity=[0, -10], duration=1.0)
        + toml("ball", name="$x_1$", position=[0, 0], velocity=[3, 5], radius=0.1, collides="none")
        + toml("ball", name="_b", position=[1, 0], velocity=[3, 5], radius=0.1, collides="none")
        + toml("post", position=[0.5, 0.5], radius=0.2)
        + toml("plane", point=[0, -1], normal=[0, 2])
        + toml("wall", points=[[0, 0], [1, 0], [1, 1]], closed=True)
    ),
    ["pymunk"],
)


def trusted_until(comparison: Comparison, until: float) -> Comparison:
    """Return a comparison whose truth ends early."""
    best = comparison.best
    assert best is not None
    short = Truth(best.kind, best.about, best.trajectory, until)
    return Comparison(comparison.scene, short, comparison.tolerance, comparison.rows, comparison.trajectories)


def legend_of(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def line_data(panel: Axes, index: int) -> tuple[np.ndarray, np.ndarray]:
    line = panel.lines[index]
    x, y = (np.asarray(values, dtype=np.float64) for values in (line.get_xdata(), line.get_ydata()))
    finite = np.isfinite(y)
    return x[finite], y[finite]


def test_motion_along_one_axis_is_drawn_against_time_with_the_truth() -> None:
    figure = draw_trajectories(DROP)
    (panel,) = figure.axes
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("time, s", "position y, m")
    run, truth = DROP.trajectories["pymunk"], DROP.best
    assert truth is not None
    assert line_data(panel, 0)[1].tolist() == run.position[:, 0, 1].tolist()
    assert line_data(panel, 2)[1].tolist() == truth.trajectory.position[:, 0, 1].tolist()
    assert legend_of(figure) == ["pymunk", "truth: closed form"]


def test_planar_motion_is_drawn_as_a_path_with_fixed_shapes() -> None:
    figure = draw_trajectories(PROJECTILES)
    (panel,) = figure.axes
    assert (panel.get_xlabel(), panel.get_ylabel()) == ("position x, m", "position y, m")
    assert panel.get_aspect() == 1.0
    assert [text.get_text() for text in panel.texts] == ["$x_1$", "_b"]
    x, y = line_data(panel, 0)
    run = PROJECTILES.trajectories["pymunk"]
    assert x[:101].tolist() == run.position[:, 0, 0].tolist()
    assert y[:101].tolist() == run.position[:, 0, 1].tolist()
    drawn = len(panel.artists) + len(panel.patches) + len(panel.lines)
    assert drawn >= 6 + 3  # two lines per body, the truth, the fixed shapes


def test_error_is_drawn_on_a_log_axis_with_a_labelled_floor() -> None:
    figure = draw_error(DROP)
    upper, lower = figure.axes
    assert upper.get_yscale() == lower.get_yscale() == "log"
    time, error = line_data(upper, 0)
    inside = (time > 0.0) & (time < 1.0)
    assert error[inside] == pytest.approx(9.81 * 0.01 * time[inside] / 2.0, rel=1e-9)  # g·h·T/2, of numbers near 5
    floor = float(upper.get_ylabel().rsplit(" ", 1)[1].rstrip(")"))
    assert error[0] == pytest.approx(floor)
    assert 0.0 < floor < error[1:].min()
    assert legend_of(figure) == ["pymunk", "tolerance 0.005 m"]
    heading = "\n".join(text.get_text() for text in figure.texts)
    assert "Bounce: error against the truth" in heading
    assert "truth: closed form" in heading


def test_energy_shows_each_engine_and_the_truth() -> None:
    figure = draw_energy(DROP)
    upper, lower = figure.axes
    assert upper.get_ylabel().startswith("total energy, J")
    assert lower.get_ylabel().startswith("energy, difference from the truth, J")
    assert line_data(upper, 0)[1][0] == pytest.approx(9.81 * 5.5)  # m·g·y at the start
    assert line_data(upper, 1)[1][-1] == pytest.approx(9.81 * (0.5 + 3.2))  # e² of 5 m remain
    assert legend_of(figure) == ["pymunk", "truth: closed form"]


def test_time_after_the_trusted_time_is_marked() -> None:
    assert DROP.best is not None
    until = float(DROP.best.trajectory.time[70])
    comparison = trusted_until(DROP, until)
    for figure in (draw_trajectories(comparison), draw_error(comparison), draw_energy(comparison)):
        assert "trusted until 0.7 s" in legend_of(figure)
        for panel in figure.axes:
            assert any(np.all(np.asarray(line.get_xdata()) == until) for line in panel.lines)
    (panel,) = draw_trajectories(comparison).axes
    assert line_data(panel, 0)[0].max() == until
    assert line_data(panel, 1)[0].min() == until  # pale from there on
    assert line_data(panel, 2)[0].max() == until  # the truth ends
    assert "from the start" in draw_energy(comparison).axes[1].get_ylabel()


@pytest.mark.fail_slow(60)  # takes over half a second
def test_files_are_written_completely_and_reproducibly(tmp_path: Path) -> None:
    paths = plot_comparison(PROJECTILES, tmp_path)
    assert [path.name for path in paths] == ["trajectories.png", "error.png", "energy.png"]
    assert sorted(tmp_path.iterdir()) == sorted(paths)
    before = [path.read_bytes() for path in paths]
    plot_comparison(PROJECTILES, tmp_path)
    assert [path.read_bytes() for path in paths] == before


@pytest.mark.fail_slow(60)  # takes over half a second
def test_comparison_without_a_run_or_a_body_can_be_drawn(tmp_path: Path) -> None:
    refused = compare(DROP.scene, ["pymunk"], integrator="rk4")
    assert refused.trajectories == {}
    empty = compare(loads("[world]\nduration = 0.1\n"), ["pymunk"])
    for comparison in (refused, empty):
        assert all(path.stat().st_size > 0 for path in plot_comparison(comparison, tmp_path))
    assert energy_chart(empty).axes[0].get_xlim() == error_chart(empty).axes[0].get_xlim() == (0.0, 0.1)


def test_charts_of_a_page_have_the_data_of_the_files() -> None:
    error, energy = error_chart(DROP), energy_chart(DROP)
    for chart, figure in ((error, draw_error(DROP)), (energy, draw_energy(DROP))):
        assert line_data(chart.axes[0], 0)[1].tolist() == line_data(figure.axes[0], 0)[1].tolist()
        assert chart.axes[0].get_xlim() == (0.0, DROP.scene.world.duration)
        assert not chart.legends
    assert [text.get_text() for text in error.axes[0].texts] == ["tolerance 0.005 m"]


def test_trusted_time_is_labelled_in_charts_of_a_page() -> None:
    for until, label in ((0.3, "truth no longer trusted"), (1.2, "trusted until here")):
        texts = [text.get_text() for text in energy_chart(trusted_until(DROP, until)).axes[0].texts]
        assert texts == [label]


def test_energy_axis_fits_the_truth_and_not_a_diverging_engine() -> None:
    run = DROP.trajectories["pymunk"]
    growing = replace(run, velocity=run.velocity * 10.0 ** (4.0 * run.time)[:, None, None])
    diverging = Comparison(DROP.scene, DROP.best, DROP.tolerance, DROP.rows, {"pymunk": growing})
    assert DROP.best is not None
    expected = energies(DROP.best.trajectory, DROP.scene).total
    span = float(np.ptp(expected))
    for figure in (energy_chart(diverging), draw_energy(diverging)):
        low, high = figure.axes[0].get_ylim()
        assert low < expected.min() < expected.max() < high
        assert high < expected.max() + 2.5 * span  # two ranges, and a margin of 5 %


@pytest.mark.fail_slow(60)  # compiles kernels of `exact`
def test_constant_energy_is_a_flat_line_in_the_middle() -> None:
    cradle = compare(load(find("newtons_cradle"), ["world.duration=0.1"]), ["exact"])
    low, high = energy_chart(cradle).axes[0].get_ylim()
    assert (low, high) == pytest.approx((0.475, 0.525))  # m·v²/2 = 0.5 J, and 5 % around it


@pytest.mark.fail_slow(60)  # compiles the reference engine
def test_legend_of_a_sweep_is_within_the_picture_and_names_what_differs() -> None:
    names = ["explicit_euler", "semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4"]
    variants = variants_of(load(find("spring"), ["world.duration=2.0"]), {"solver.integrator": names})
    figure = draw_energy(compare_variants(variants, ["reference"]))
    assert legend_of(figure) == [*(f"integrator {name}" for name in names), "truth: closed form"]
    figure.draw_without_rendering()
    box, page = figure.legends[0].get_window_extent(), figure.bbox
    assert (box.x0 >= page.x0, box.x1 <= page.x1) == (True, True)
    omega, amplitude, steps = 2.0 * np.pi, 0.1, 200
    largest = 0.5 * (omega * amplitude) ** 2 * (1.0 + (0.01 * omega) ** 2) ** steps  # of explicit Euler, 1 kg
    assert [text.get_text() for text in figure.axes[0].texts] == [f"cut off: up to {largest:.3g} J"]
