"""Plots of runs: contents of the figure, and written files."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sandbox.report.colours import COLOURS
from sandbox.report.run_plot import draw_run, format_of, plot_run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import loads
from sandbox.trajectory import Trajectory

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

HEAD = 'title = "Trial"\n[world]\ngravity = [0.0, -10.0]\n[solver]\ndt = 0.1\n'
GROUND = "[[plane]]\npoint = [0.0, 0.0]\nnormal = [0.0, 1.0]\n"
ODD_NAMES = ["$x_1$", "<b>bold</b>", "_under", "$\\frac{$", "%s {0} \\n", "球 🎱"]


def ball(name: str, x: float = 0.0, vx: float = 0.0) -> str:
    return f"[[ball]]\nname = '{name}'\nposition = [{x}, 50.0]\nvelocity = [{vx}, 0.0]\nradius = 0.5\n"


def euler(scene: Scene, frames: int = 21, contacts: int = 0, **changes: object) -> Trajectory:
    """Return free flight by explicit Euler, g·h·T/2 above the parabola."""
    bodies, h = scene.bodies, scene.solver.dt
    time = np.arange(frames) * h
    gravity = np.where(bodies.fixed[:, None], 0.0, scene.world.gravity)
    velocity = bodies.velocity + time[:, None, None] * gravity
    position = bodies.position + np.cumsum(velocity, axis=0) * h - velocity * h
    info = {"engine": "toy", "settings": scene.solver.model_dump(), "status": "ok", "reason": None, "audited": False}
    info |= changes.pop("info", {})
    arrays = {
        "time": time,
        "position": position,
        "velocity": velocity,
        "angle": np.zeros(position.shape[:2]),
        "angular_velocity": np.zeros(position.shape[:2]),
        "names": np.asarray(bodies.names, dtype=str),
        "contact_time": np.linspace(1.0, 1.9, contacts),
        "contact_pair": np.tile([0, -1], (contacts, 1)).astype(np.int64),
        "retired_time": np.full(len(bodies), np.nan),
        "missed_time": np.empty(0),
        "missed_pair": np.empty((0, 2), np.int64),
    }
    arrays |= {f"contact_{name}": np.zeros((contacts, 2)) for name in ("point", "normal", "impulse")}
    return Trajectory(**{**arrays, **changes}, info=info)


def panel(figure: Figure, label: str) -> Axes:
    (found,) = (axes for axes in figure.axes if axes.get_ylabel().startswith(label))
    return found


def legend_of(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def heading(figure: Figure) -> str:
    return "\n".join(text.get_text() for text in figure.texts)


def test_projectile_shows_position_velocity_energy_and_the_closed_form() -> None:
    scene = loads(HEAD + ball("shell", vx=3.0))
    run = euler(scene)
    figure = draw_run(run, scene)
    assert legend_of(figure) == ["shell", "closed form"]
    for label, values, exact in (
        ("position x", run.position[:, 0, 0], 3.0 * run.time),
        ("position y", run.position[:, 0, 1], 50.0 - 5.0 * run.time**2),
        ("velocity x", run.velocity[:, 0, 0], np.full(21, 3.0)),
        ("velocity y", run.velocity[:, 0, 1], -10.0 * run.time),
    ):
        drawn, closed = (line.get_ydata() for line in panel(figure, label).lines)
        assert np.array_equal(drawn, values)
        assert closed == pytest.approx(exact, rel=1e-14)  # a few roundings of the formula
    energy = [line.get_ydata() for line in panel(figure, "energy").lines]
    assert len(energy) == 6
    assert energy[5] == pytest.approx(np.full(21, 504.5), rel=1e-14)  # m g y + ½ m v² is constant in the closed form


def test_heading_names_the_run_and_its_largest_error() -> None:
    scene = loads(HEAD + ball("a") + ball("b", x=5.0))
    run = euler(scene)
    run.position[7, 1] += (0.0, 8.0)
    lines = heading(draw_run(run, scene)).splitlines()
    # g·h·T/2 = 0.35 m at the moved frame, 0.7 s, and 8 m more.
    assert lines == ["Trial", "toy · dt 0.1 s", "largest position error against the closed form: 8.35 m (b)"]
    info = {"status": "diverged", "reason": "at 1 s: $x$ left", "settings": {"dt": 0.5, "substeps": 4}}
    lines = heading(draw_run(euler(scene, info=info), scene, ["a"])).splitlines()
    assert lines[1] == "toy · dt 0.5 s in 4 substeps"
    assert lines[2] == "largest position error against the closed form: 1 m"
    assert lines[3] == "diverged: at 1 s: $x$ left"


def test_no_closed_form_is_drawn_or_mentioned_if_there_is_none() -> None:
    scene = loads(HEAD.replace("[solver]", "quadratic_drag = 0.1\n[solver]") + ball("a"))
    figure = draw_run(euler(scene), scene)
    assert legend_of(figure) == ["a"]
    assert heading(figure).splitlines()[2:] == ["no closed form to compare with"]
    assert [len(axes.lines) for axes in figure.axes] == [1, 1, 3]


def test_the_closed_form_ends_at_the_first_contact() -> None:
    bounded = HEAD.replace("[solver]", "bounds = [[-99, -99], [99, 99]]\n[solver]")  # no closed form of both balls
    scene = loads(bounded + ball("a", vx=1.0) + ball("b", x=9.0))
    run = euler(scene, contact_time=np.array([1.05]), contact_pair=np.array([[0, 1]]))
    figure = draw_run(run, scene, ["a"])
    closed = panel(figure, "position y").lines[1].get_ydata()
    assert np.array_equal(np.isnan(closed), run.time >= 1.05)
    # The energy of the scene includes that of b, which is not drawn.
    assert len([line for line in panel(figure, "energy").lines if line.get_linestyle() == "--"]) == 0


def test_axis_without_motion_is_left_out() -> None:
    scene = loads(HEAD + ball("a", x=3.0))
    run = euler(scene)
    run.position[:, 0, 0] += np.random.default_rng(1).normal(scale=1e-12, size=21)
    labels = [axes.get_ylabel() for axes in draw_run(run, scene).axes]
    assert labels == ["position y, m", "velocity y, m/s", "energy of the scene, J"]
    run.position[:] = run.position[0]
    assert len(draw_run(run, scene).axes) == 5


def test_at_most_five_bodies_are_drawn_unless_named() -> None:
    names = [f"ball {n}" for n in range(8)]
    scene = loads(HEAD + ball("rock") + "fixed = true\n" + "".join(map(ball, names)))
    figure = draw_run(euler(scene), scene)
    assert legend_of(figure) == [*names[:5], "closed form"]
    assert len({line.get_color() for line in panel(figure, "position y").lines[:5]}) == 5
    figure = draw_run(euler(scene), scene, [*names[::-1], "ball 3", "rock"])
    assert legend_of(figure) == [*names[::-1], "rock", "closed form"]
    assert panel(figure, "position y").lines[6].get_color() == COLOURS[0]


def test_unknown_body_is_rejected_with_a_suggestion() -> None:
    scene = loads(HEAD + ball("cue") + ball("eight"))
    with pytest.raises(ValueError, match="no body named 'cux'; there is 'cue'"):
        draw_run(euler(scene), scene, ["cux"])


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_odd_names_are_written_literally(tmp_path: Path, suffix: str) -> None:
    scene = loads((HEAD + "".join(map(ball, ODD_NAMES))).replace("Trial", "$\\\\alpha$ & <i>"))
    # Warnings are errors: neither missing glyphs nor mathematical text may raise one.
    path = plot_run(euler(scene), scene, tmp_path / f"plot{suffix}", ODD_NAMES)
    figure = draw_run(euler(scene), scene, ODD_NAMES)
    assert legend_of(figure)[:6] == ODD_NAMES
    assert heading(figure).startswith("$\\alpha$ & <i>\n")
    texts = [*figure.texts, *figure.legends[0].get_texts()]
    assert not any(text.get_parse_math() or text.get_usetex() for text in texts)
    assert path.stat().st_size > 5000
    assert [p.name for p in tmp_path.iterdir()] == [f"plot{suffix}"]


def test_same_run_yields_the_same_picture(tmp_path: Path) -> None:
    scene = loads(HEAD + ball("a", vx=1.0))
    for suffix in (".png", ".pdf"):
        one, two = (plot_run(euler(scene), scene, tmp_path / f"{n}{suffix}") for n in "12")
        assert one.read_bytes() == two.read_bytes()


def test_empty_scene_and_empty_runs_can_be_drawn(tmp_path: Path) -> None:
    scene = loads(HEAD + GROUND)
    plot_run(euler(scene), scene, tmp_path / "plot.png")
    figure = draw_run(euler(scene), scene)
    assert [text.get_text() for axes in figure.axes for text in axes.texts] == ["no body to draw"] * 4
    assert legend_of(figure) == []
    full = loads(HEAD + ball("a"))
    plot_run(euler(full, frames=0), full, tmp_path / "refused.png")
    plot_run(euler(full, frames=1), full, tmp_path / "start.png")


def test_a_diverged_run_can_be_drawn(tmp_path: Path) -> None:
    scene = loads(HEAD + ball("a", vx=1.0) + ball("b"))
    run = euler(scene)
    run.position[:, 0] *= 10.0 ** np.linspace(0, 15, 21)[:, None]
    run.velocity[:, 0] *= -(10.0 ** np.linspace(0, 15, 21)[:, None])
    run.velocity[18, 1], run.position[19, 1], run.position[20] = 1e300, np.inf, np.nan
    plot_run(run, scene, tmp_path / "plot.png")
    figure = draw_run(run, scene)
    assert panel(figure, "position y").get_yscale() == "symlog"
    assert panel(figure, "velocity y").get_ylabel() == "velocity y, m/s (log)"
    low, high = panel(figure, "position y").get_ylim()
    assert low <= np.nanmin(run.position[:19])
    assert high >= np.nanmax(run.position[:19])


def test_retired_body_is_drawn_until_its_retirement() -> None:
    scene = loads(HEAD + ball("a", vx=1.0))
    figure = draw_run(euler(scene, retired_time=np.array([1.05])), scene)
    for axes in figure.axes[:4]:
        assert np.isfinite(axes.lines[0].get_ydata()).sum() == 11


def test_spawned_body_is_drawn_from_its_first_frame() -> None:
    scene = loads(HEAD + ball("a"))
    joined = scene.bodies.joined_by(Ball(name="new", position=(1.0, 1.0), radius=0.1), "new")
    more = loads(HEAD + ball("a") + ball("new", x=1.0))
    run = euler(more)
    run.position[:5, 1], run.velocity[:5, 1] = np.nan, np.nan
    figure = draw_run(run, scene, run_bodies=joined)
    assert legend_of(figure) == ["a", "new"]
    assert np.isnan(panel(figure, "position y").lines[1].get_ydata()).sum() == 5


@pytest.mark.parametrize(("contacts", "ticks"), [(0, 0), (3, 3), (39, 39), (40, 0)])
def test_contacts_are_marked_if_they_are_few(contacts: int, ticks: int) -> None:
    scene = loads(HEAD + GROUND + ball("a", vx=1.0))
    figure = draw_run(euler(scene, contacts=contacts), scene)
    for axes in figure.axes:
        marks = [line for line in axes.lines if len(set(line.get_xdata())) == 1]
        assert len(marks) == ticks
    assert ("contact" in legend_of(figure)) == (ticks > 0)


def test_thinned_curve_of_a_long_run_keeps_its_extremes() -> None:
    scene = loads(HEAD.replace("0.1", "0.0001") + ball("a"))
    run = euler(scene, frames=20_001)
    run.position[12_345, 0, 1], run.position[54, 0, 1] = 900.0, -900.0
    line = panel(draw_run(run, scene), "position y").lines[0]
    assert len(line.get_xdata()) < 5000
    assert np.all(np.diff(line.get_xdata()) >= 0)
    assert (line.get_ydata().min(), line.get_ydata().max()) == (-900.0, 900.0)
    assert line.get_xdata()[[0, -1]].tolist() == run.time[[0, -1]].tolist()


@pytest.mark.parametrize("name", ["plot.jpg", "plot", "plot.png.gz", ".png"])
def test_unknown_suffix_is_rejected_with_the_known_ones(tmp_path: Path, name: str) -> None:
    scene = loads(HEAD + ball("a"))
    with pytest.raises(ValueError, match=r"\.png, \.svg, \.pdf"):
        plot_run(euler(scene), scene, tmp_path / name)
    assert not list(tmp_path.iterdir())
    assert format_of("Plot.PNG") == "png"  # capitals are accepted


def test_failed_write_leaves_existing_files(tmp_path: Path) -> None:
    scene = loads(HEAD + ball("a"))
    target = tmp_path / "plot.png"
    target.mkdir()
    with pytest.raises(OSError, match=r"plot\.png"):
        plot_run(euler(scene), scene, target)
    assert [p.name for p in tmp_path.iterdir()] == ["plot.png"]


@pytest.mark.parametrize(
    "backend", ["nonsense", "module://no_such.backend", "module://matplotlib_inline.backend_inline", "tkagg", "svg"]
)
def test_plot_is_written_whatever_backend_the_environment_names(tmp_path: Path, backend: str) -> None:
    """A terminal of a notebook passes on the notebook's backend, which another environment may lack."""
    hidden = "import sys; sys.modules['matplotlib_inline'] = None; import importlib.metadata as m; "
    hidden += "found = m.entry_points; m.entry_points = lambda **k: m.EntryPoints(e for e in found(**k) "
    hidden += "if k.get('group') != 'matplotlib.backend'); from sandbox.cli.main import main; main()"
    target = tmp_path / "plot.png"
    done = subprocess.run(
        [sys.executable, "-c", hidden, "run", "tutorial/ball", "--plot", str(target)],
        capture_output=True,
        text=True,
        env={**os.environ, "MPLBACKEND": backend},
        timeout=60,
        check=False,
    )
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    assert target.stat().st_size > 1000


@pytest.mark.parametrize("backend", ["svg", "pdf"])
def test_valid_backend_stays_that_of_the_users_own_figures(backend: str) -> None:
    code = "import sandbox.report, matplotlib, os; print(matplotlib.get_backend(), os.environ['MPLBACKEND'])"
    environment = {**os.environ, "MPLBACKEND": backend}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout.split() == [backend, backend]
