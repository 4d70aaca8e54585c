"""Figures of the lessons, plotted from runs of the scene of each lesson."""

from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle
from PIL import Image

import sandbox
from sandbox.report.colours import COLOURS
from sandbox.scene.description.world import DetectionName, IntegratorName

from .files import save_png

COLOURS_OF_FILE = 64
BLUE, ORANGE, GREEN, YELLOW, PINK, SKY = COLOURS
INTEGRATORS: list[IntegratorName] = ["explicit_euler", "semi_implicit_euler", "velocity_verlet", "leapfrog", "rk4"]


def _legend_outside(axes: Axes) -> None:
    """Draw the legend to the right of the axes, for plots whose curves fill the whole area."""
    axes.legend(loc="center left", bbox_to_anchor=(1.02, 0.5), frameon=False)


def ball(axes: Axes) -> None:
    """Draw a fall by two first-order integrators and the closed form."""
    scene = sandbox.load("ball")
    time = np.linspace(0, 1, 200)
    axes.plot(time, 10 - 9.81 / 2 * time**2, "k", label="closed form")
    integrators: list[tuple[IntegratorName, str]] = [("explicit_euler", BLUE), ("semi_implicit_euler", ORANGE)]
    for integrator, colour in integrators:
        run = sandbox.run(scene, "reference", dt=0.2, integrator=integrator)
        axes.plot(run.time, run.position[:, 0, 1], "o-", color=colour, label=f"{integrator}, dt = 0.2 s")
    axes.set(xlabel="time, s", ylabel="height, m")
    axes.legend()


def order(axes: Axes) -> None:
    """Draw the error of five integrators against the step."""
    scene = sandbox.load("spring")
    steps = [0.04, 0.02, 0.01, 0.005, 0.0025]
    for integrator, colour, mark in zip(INTEGRATORS, COLOURS, "osv^D", strict=False):
        errors = []
        for dt in steps:
            run = sandbox.run(scene, "reference", dt=dt, integrator=integrator, audit=False)
            error = np.abs(run.position[:, 0, 0] - 1 - 0.1 * np.cos(2 * np.pi * run.time))
            errors.append(error[run.time < 1 + dt / 2].max())
        axes.loglog(steps, errors, mark + "-", color=colour, label=integrator)
    axes.set(xlabel="dt, s", ylabel="largest error in the first second, m", xticks=steps, xticklabels=map(str, steps))
    axes.minorticks_off()
    _legend_outside(axes)


def fireworks(axes: Axes) -> None:
    """Draw sparks at four times, and the rectangles that bound them."""
    run = sandbox.run(sandbox.load("fireworks"))
    for frame, colour in zip((50, 100, 150, 200), COLOURS, strict=False):
        t = run.time[frame]
        axes.plot(*run.position[frame].T, ".", color=colour, markersize=3, label=f"{t:g} s")
        corner = (-t, 8 * t - 9.81 / 2 * t * t)
        axes.add_patch(Rectangle(corner, 2 * t, 4 * t, fill=False, edgecolor=colour))
    axes.set(xlabel="x, m", ylabel="y, m", aspect="equal")
    _legend_outside(axes)


def circle(axes: Axes) -> None:
    """Draw a circle at seven heights over a half-plane."""
    axes.axhspan(-2.2, 0, color="0.85")
    for number, height in enumerate((2.0, 1.001, 1.0, 0.999, 0.009, 0.0, -1.0)):
        colour = ORANGE if height < 1 else BLUE
        axes.add_patch(Circle((2.3 * number, height), 1, fill=False, edgecolor=colour))
        axes.plot(2.3 * number, height, ".", color=colour)
        axes.text(2.3 * number, 3.15, f"{height:g}", ha="center")
    axes.set(xlim=(-1.2, 15.0), ylim=(-2.2, 3.6), aspect="equal", xticks=[], ylabel="y, m")


def bisection(axes: Axes) -> None:
    """Draw a fast ball with four kinds of detection."""
    scene = sandbox.load("fast_ball")
    axes.plot([0, 0.045, 0.3], [5, 0.5, 26], "k", linewidth=1, label="truth")
    detections: list[DetectionName] = ["discrete", "bisect", "swept", "shrink"]
    for detection, colour, mark in zip(detections, COLOURS, "oxs^", strict=False):
        run = sandbox.run(scene, "reference", detection=detection).at([0, 1, 2, 3])
        face = "none" if mark in "s^" else colour
        size = 9 if mark in "s^" else 6
        axes.plot(
            run.time, run.position[:, 0, 1], mark, color=colour, markerfacecolor=face, markersize=size, label=detection
        )
    axes.axhline(0.5, color="0.6", linestyle=":")
    axes.set(xlabel="time, s", ylabel="height of the centre, m")
    axes.legend()


def bounce(axes: Axes) -> None:
    """Draw bounces on the exact engine and with fixed steps."""
    scene = sandbox.load("bounce")
    for engine, dt, colour in (("exact", 0.005, "k"), ("pymunk", 0.05, BLUE)):
        run = sandbox.run(scene, engine, dt=dt)
        label = engine if engine == "exact" else f"{engine}, dt = {dt:g} s"
        axes.plot(run.time, run.position[:, 0, 1] - 0.5, color=colour, label=label)
    axes.set(xlabel="time, s", ylabel="height above rest, m")
    axes.legend()


def kepler(axes: Axes) -> None:
    """Draw five orbits by two integrators."""
    scene = sandbox.load("kepler")
    integrators: list[tuple[IntegratorName, str]] = [("explicit_euler", ORANGE), ("velocity_verlet", BLUE)]
    for integrator, colour in integrators:
        run = sandbox.run(scene, "reference", integrator=integrator, audit=False)
        axes.plot(*run.position[::20, 0].T, color=colour, linewidth=1, label=integrator)
    axes.plot(0, 0, "*", color=YELLOW, markersize=12)
    axes.set(xlabel="x", ylabel="y", aspect="equal")
    _legend_outside(axes)


def cradle(axes: Axes) -> None:
    """Draw the last ball of a cradle around the impacts."""
    scene = sandbox.load("newtons_cradle")
    for engine, dt, style in (("exact", 1e-4, "k"), ("pymunk", 1e-3, "o-"), ("pymunk", 1e-4, "-")):
        run = sandbox.run(scene, engine, dt=dt, audit=False)
        visible = (run.time > 0.1985) & (run.time < 0.208)
        color = {"k": "k", "o-": BLUE, "-": ORANGE}[style]
        label = engine if engine == "exact" else f"{engine}, dt = {dt:g} s"
        line = style.replace("k", "-")
        axes.plot(
            1e3 * run.time[visible], 1e3 * run.position[visible, 4, 0], line, color=color, markersize=4, label=label
        )
    axes.set(xlabel="time, ms", ylabel="x of the last ball, mm")
    axes.legend()


def gas(axes: Axes) -> None:
    """Draw the growth of a perturbation, and the divergence of two engines."""
    scene = sandbox.load("gas")
    run = sandbox.run(scene, "exact", audit=False)
    perturbation = sandbox.Impulse(time=0.0, body="atom-1", impulse=(1e-12, 0.0))
    others = {
        "exact, one velocity changed by 1e-12 m/s": sandbox.run(scene, "exact", actions=[perturbation], audit=False),
        "pymunk, dt = 0.005 s": sandbox.run(scene, "pymunk", audit=False),
    }
    for (label, other), colour in zip(others.items(), (BLUE, ORANGE), strict=True):
        distance = np.linalg.norm(run.position - other.position, axis=2).max(axis=1)
        axes.semilogy(run.time[4:], distance[4:], color=colour, label=label)
    axes.axhline(0.25, color="0.6", linestyle=":")
    axes.text(20, 0.08, "radius", ha="right", va="top", color="0.4")
    axes.set(xlabel="time, s", ylabel="largest distance from the exact run, m")
    axes.legend()


def stacks(axes: Axes) -> None:
    """Draw the drift of two stacks against iterations."""
    counts = (5, 10, 20, 50, 100, 200)
    for scene, substeps, style in (("tower", 1, "o-"), ("tower", 4, "o--"), ("pyramid", 4, "s:")):
        loaded = sandbox.load(scene)
        for engine, colour in (("pymunk", BLUE), ("reference", GREEN)):
            drift = []
            label = f"{scene}, {engine}, {substeps} substeps".replace(" 1 substeps", " 1 substep")
            for count in counts:
                run = sandbox.run(loaded, engine, substeps=substeps, iterations=count, audit=False)
                drift.append(np.linalg.norm(run.position[-1] - run.position[0], axis=1).max())
            axes.loglog(counts, drift, style, color=colour, label=label)
    axes.set(xlabel="iterations", ylabel="drift after 10 s, m", xticks=counts, xticklabels=map(str, counts))
    axes.minorticks_off()
    axes.set_ylim(top=600.0)
    axes.legend(ncols=2)


def tunnelling(axes: Axes) -> None:
    """Draw the measured probability of a miss, and the formula."""
    text = sandbox.dumps(sandbox.load("bullet"))
    steps = np.array([1e-4, 1.5e-4, 2e-4, 2.5e-4, 3e-4, 4e-4, 5e-4, 7e-4, 1e-3])
    odds = []
    for dt in steps:
        passed = 0
        for k in range(100):
            start = 0.05 + 100 * dt * (k + 0.5) / 100
            scene = sandbox.loads(text.replace("[0.05, 0.0]", f"[{start}, 0.0]"))
            passed += bool(sandbox.run(scene, dt=float(dt), audit=False).velocity[-1, 0, 0] > 0)
        odds.append(passed / 100)
    fine = np.linspace(5e-5, 1e-3, 200)
    axes.plot(1e3 * fine, np.maximum(0, 1 - 0.02 / (100 * fine)), "k", label="1 − (r + w/2)/(v·dt)")
    axes.plot(1e3 * steps, odds, "o", color=BLUE, label="pymunk, 100 starting points")
    axes.set(xlabel="dt, ms", ylabel="fraction that passes the wall")
    axes.legend()


def billiards(axes: Axes) -> None:
    """Draw the paths of a half-ball hit."""
    run = sandbox.run(sandbox.load("half_ball"), "exact", dt=0.005)
    for number, colour in ((0, BLUE), (1, ORANGE)):
        x, y = run.position[:, number].T
        visible = (y < 1.4) & (np.abs(x) < 0.8)
        axes.plot(x[visible], y[visible], color=colour, label=run.names[number])
    hit = int(np.searchsorted(run.time, run.contact_time[0]))
    for number, colour in ((0, BLUE), (1, ORANGE)):
        axes.add_patch(Circle(tuple(run.position[hit, number]), 0.028575, fill=False, edgecolor=colour))
    axes.set(xlabel="x, m", ylabel="y, m", aspect="equal")
    axes.legend()


def springs(axes: Axes) -> None:
    """Draw the growth of the amplitude of a spring per step."""
    z = np.linspace(0.02, 3.0, 600)
    semi = np.where(z <= 2, 1.0, np.abs(1 - z * z / 2 - np.sqrt(np.maximum(0, z**4 / 4 - z * z))))
    axes.plot(z, np.sqrt(1 + z * z), color=ORANGE, label="explicit Euler")
    axes.plot(z, semi, color=BLUE, label="semi-implicit Euler, Verlet, leapfrog")
    axes.plot(z, np.sqrt(1 - z**6 / 72 + z**8 / 576), color=GREEN, label="RK4")
    axes.axhline(1, color="0.6", linestyle=":")
    axes.set(xlabel="ω·h", ylabel="growth per step, |λ|", ylim=(0, 3))
    axes.legend()


def machines(axes: Axes) -> None:
    """Draw the piston of a slider-crank, and the formula."""
    run = sandbox.run(sandbox.load("slider_crank"), "reference", audit=False)
    phi = 2.0 * np.pi * run.time
    axes.plot(run.time, run.position[:, 1, 0], color=BLUE, linewidth=4, alpha=0.5, label="piston on reference")
    axes.plot(
        run.time, 0.5 * np.cos(phi) + np.sqrt(1.5**2 - (0.5 * np.sin(phi)) ** 2), "k", linewidth=1, label="formula"
    )
    axes.plot(run.time, run.position[:, 0, 0], color=ORANGE, label="middle of the crank")
    axes.set(xlabel="time, s", ylabel="x, m")
    axes.legend(loc=(0.62, 0.31))


def figure(draw: Callable[[Axes], None]) -> Callable[[Path], None]:
    """Return a function that writes the picture of a figure."""

    def make(path: Path) -> None:
        chart, axes = plt.subplots(figsize=(6.4, 4.0), layout="constrained")
        draw(axes)
        axes.spines[["top", "right"]].set_visible(False)
        buffer = BytesIO()
        chart.savefig(buffer, dpi=110)
        save_png(Image.open(buffer), path, COLOURS_OF_FILE)
        plt.close(chart)

    return make


LESSONS = (
    ball,
    order,
    fireworks,
    circle,
    bisection,
    bounce,
    kepler,
    cradle,
    gas,
    stacks,
    tunnelling,
    billiards,
    springs,
    machines,
)
