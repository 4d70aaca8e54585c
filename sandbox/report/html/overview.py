"""HTML page over many scenes: a table of all, then each scene with its replay, charts and, if known, trade-off."""

from dataclasses import dataclass, field

import numpy as np
from markupsafe import Markup

from sandbox.arrays import FloatArray
from sandbox.columns import TRUTH
from sandbox.formatting import UNKNOWN, format_number, format_plural
from sandbox.measure.compare import Comparison
from sandbox.measure.metrics.trajectory_error import errors
from sandbox.provenance import machine, versions
from sandbox.report.colours import css_class_of
from sandbox.report.comparison_plot import FLOOR
from sandbox.report.html.comparison import (
    ENGINE_COLUMNS,
    badge_of,
    cost_of,
    engines_table,
    explanations,
    linked_plots,
    meanings_of,
    remarks,
    settings_of,
    truth_sentence,
)
from sandbox.report.html.page import (
    Content,
    HtmlColumn,
    Page,
    Section,
    badge,
    concatenated,
    engine_name,
    fragment,
    isolated,
    paragraph,
    remark_paragraphs,
    table,
)
from sandbox.report.html.tradeoff import answers, diagram
from sandbox.report.style import BEYOND
from sandbox.report.tradeoff_plot import TradeoffMapping

TEMPLATE = "overview.html.j2"
SPARK_WIDTH, SPARK_HEIGHT, SPARK_POINTS = 150.0, 23.0, 80
"""Size of a sparkline, and the number of its points: about one to two units."""
COLUMNS = (
    HtmlColumn("scene"),
    HtmlColumn("truth"),
    HtmlColumn("engine"),
    HtmlColumn("max error, m", True, "largest position error of any body while the truth is trusted"),
    HtmlColumn("of tolerance", True, "error divided by the tolerance, which is 1 % of the smallest radius"),
    HtmlColumn(
        "ms per s", True, "computing time in milliseconds per simulated second, of one run that keeps all frames"
    ),
    HtmlColumn("verdict"),
    HtmlColumn("error over time"),
)


@dataclass(frozen=True, eq=False)
class SceneReport:
    """Results of one scene."""

    name: str
    """name or path given by the user"""
    comparison: Comparison | None = None
    failure: str | None = None
    """reason why there is no comparison"""
    tradeoff: TradeoffMapping | None = None
    """document that `sandbox tradeoff --json` prints; None if it was not measured"""
    remarks: tuple[str, ...] = ()
    """remarks on a recording"""


@dataclass
class Overview:
    """Page to which scenes are added one by one. It stores the markup of each scene, not its runs."""

    title: str = "Accuracy and cost of each engine"
    rows: list[list[Content]] = field(default_factory=list)
    sections: list[Section] = field(default_factory=list)
    asked: int = 0
    """number of scenes requested"""

    def add(self, report: SceneReport) -> None:
        """Add a scene."""
        anchor = f"scene-{len(self.sections) + 1}"
        comparison = report.comparison
        if comparison is None:
            reason = report.failure or "no reason given"
            link, unknown = fragment(TEMPLATE, "link", report.name, anchor), [UNKNOWN] * 5
            self.rows.append([link, *unknown, badge("not compared", "bad", reason), ""])
            self.sections.append(Section(report.name, paragraph(isolated(reason)), anchor))
            return
        rows, section = _rows(comparison, anchor), _section(report, comparison, anchor)
        self.rows += rows
        self.sections.append(section)

    def page(self) -> Page:
        """Return the page of the scenes so far."""
        done = len(self.sections)
        about = "each run on every engine that supports it and compared with the best known truth"
        summary = concatenated(
            table(COLUMNS, self.rows, "Every scene and engine", wide=True), meanings_of(COLUMNS, ENGINE_COLUMNS)
        )
        lead = fragment(TEMPLATE, "lead", f"{format_plural(done, 'scene')}, {about}.", done, self.asked)
        sections = [Section("All scenes", summary, "all"), *self.sections]
        return Page(self.title, "2D game physics sandbox", sections, lead, versions(), machine())


def _rows(comparison: Comparison, anchor: str) -> list[list[Content]]:
    """Return a row for each engine; the first one names the scene."""
    link = fragment(TEMPLATE, "link", comparison.scene.title or "untitled", anchor)
    kind = (comparison.truth or UNKNOWN).replace("_", " ")
    rows: list[list[Content]] = []
    for row in comparison.rows:
        error = row.score.max_position
        rows.append(
            [
                "" if rows else link,
                "" if rows else kind,
                engine_name(row.engine),
                TRUTH if row.is_truth else format_number(error),
                UNKNOWN if error is None or row.is_truth else f"×{format_number(error / comparison.tolerance, 2)}",
                format_number(cost_of(comparison, row)),
                badge_of(row, comparison.tolerance),
                _error_sparkline(comparison, row.engine),
            ]
        )
    return rows


def _error_sparkline(comparison: Comparison, engine: str) -> Markup | None:
    """Return the position error of an engine over time as a sparkline; None without a run or a truth."""
    run, truth, scene = comparison.trajectories.get(engine), comparison.best, comparison.scene
    if run is None or truth is None:
        return None
    found = errors(run, truth.trajectory, ~scene.bodies.fixed)
    kept = found.time <= truth.trusted_until
    label = f"error of {engine} in {scene.title}"
    return sparkline(
        found.time[kept] / scene.world.duration, found.position[kept], comparison.tolerance, css_class_of(engine), label
    )


def sparkline(fraction: FloatArray, values: FloatArray, bound: float, css_class: str, label: str) -> Markup:
    """Return a small line without axes, on a logarithmic scale, with a dotted line at a bound.

    Args:
        fraction: (K,) of the width.
        values: (K,) ≥ 0; those that are not finite are left out.
        bound: > 0, in the unit of the values.
        css_class: class that has the colour.
        label: description for screen readers.
    """
    finite = values < BEYOND  # false for nan
    chosen = np.flatnonzero(finite)
    chosen = chosen[np.unique(np.linspace(0, max(len(chosen) - 1, 0), min(len(chosen), SPARK_POINTS)).astype(int))]
    levels = np.log10(np.maximum(np.append(values[chosen], bound), FLOOR))
    positive = np.append(values[chosen] > 0.0, True)
    low, high = float(levels[positive].min()) - 1.0, float(levels.max())  # zero lies below all other values
    span = high - low
    y = (SPARK_HEIGHT - 2.0) * (1.0 - np.clip((levels - low) / span, 0.0, 1.0)) + 1.0
    x = SPARK_WIDTH * fraction[chosen]
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x.tolist(), y[:-1].tolist(), strict=True))
    size = f"{SPARK_WIDTH:g}", f"{SPARK_HEIGHT:g}"
    return fragment(TEMPLATE, "sparkline", *size, points, f"{y[-1]:.1f}", css_class, label)


def _section(report: SceneReport, comparison: Comparison, anchor: str) -> Section:
    """Return the section of one scene."""
    scene = comparison.scene
    parts: list[Content] = [paragraph(truth_sentence(comparison))]
    if report.tradeoff is not None:
        parts.append(answers(report.tradeoff))
    parts += [engines_table(comparison), remarks(comparison)]
    if comparison.trajectories:
        parts.append(linked_plots(comparison, anchor))
    if report.tradeoff is not None:
        parts.append(Section("Error against cost", diagram(report.tradeoff, f"{anchor}-cost"), level=3).markup())
    sections = [Section(each.title, each.body, level=3) for each in explanations(comparison)]
    parts.append(fragment(TEMPLATE, "more", sections, settings_of(comparison)))
    about = isolated(scene.about) if scene.about else None
    lead = concatenated(about, remark_paragraphs(report.remarks)) or None
    return Section(scene.title or report.name, concatenated(*parts), anchor, lead)
