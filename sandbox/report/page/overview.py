"""Overview: one page over many scenes: a table of all, then each with its replay, plots and, if known, trade-off."""

from dataclasses import dataclass, field

from sandbox.measure.compare import Comparison
from sandbox.measure.compare.errors import errors
from sandbox.measure.versions import machine, versions
from sandbox.report.page.comparison_page import (
    ENGINES,
    engines_table,
    explanations,
    linked_plots,
    milliseconds,
    remarks,
    sentence,
    settings_of,
)
from sandbox.report.page.document import Page, Section
from sandbox.report.page.markup import Child, Markup, joined, named, tag
from sandbox.report.page.tables import Column, column_key, table
from sandbox.report.page.time_chart import Curve, sparkline
from sandbox.report.page.tradeoff_page import answers, weighed
from sandbox.report.page.verdicts import badge, badge_of, engine_name, key, look_of
from sandbox.report.page.wording import NONE, number, plural
from sandbox.report.work_points import Document

COLUMNS = (
    Column("scene"),
    Column("truth"),
    Column("engine"),
    Column("max error, m", True, "largest position error of any body while the truth is trusted"),
    Column("of tolerance", True, "error divided by the tolerance, which is 1 % of the smallest radius"),
    Column("ms per s", True, "computing time in milliseconds per simulated second, of one run that keeps all frames"),
    Column("verdict"),
    Column("error over time"),
)


@dataclass(frozen=True, eq=False)
class SceneReport:
    """What is known of one scene."""

    name: str
    """as it was asked for"""
    comparison: Comparison | None = None
    failure: str | None = None
    """why there is none"""
    tradeoff: Document | None = None
    """what `sandbox tradeoff --json` prints, where that was asked for"""


@dataclass
class Overview:
    """A page that grows scene by scene. Of each scene only its markup is kept, not its runs."""

    title: str = "Accuracy and cost of each engine"
    rows: list[list[Child]] = field(default_factory=list)
    sections: list[Section] = field(default_factory=list)
    asked: int = 0
    """scenes that were asked for"""

    def add(self, report: SceneReport) -> None:
        """Add a scene."""
        anchor = f"scene-{len(self.sections) + 1}"
        comparison = report.comparison
        if comparison is None:
            reason = report.failure or "no reason given"
            link = tag("a", named(report.name), href=f"#{anchor}")
            self.rows.append([link, NONE, NONE, NONE, NONE, NONE, badge("not compared", "bad", reason), ""])
            self.sections.append(Section(report.name, tag("p", named(reason)), anchor))
            return
        rows, section = _rows(comparison, anchor), _section(report, comparison, anchor)
        self.rows += rows
        self.sections.append(section)

    def page(self) -> Page:
        """Return the page of what there is so far."""
        done = len(self.sections)
        about = "each run on every engine that supports it and compared with the best known truth"
        told = f"{plural(done, 'scene')}, {about}."
        missing = None
        if done < self.asked:
            missing = tag("p", f"Interrupted: the page has {done} of {self.asked} scenes.", class_="soft")
        summary = joined(
            table(COLUMNS, self.rows, "Every scene and engine", wide=True),
            tag("details", tag("summary", "What the columns and verdicts mean"), column_key(COLUMNS, ENGINES), key()),
        )
        first = Section("All scenes", summary, "all")
        return Page(
            self.title,
            "2D game physics sandbox",
            [first, *self.sections],
            joined(tag("p", told), missing),
            versions(),
            machine(),
        )


def _rows(comparison: Comparison, anchor: str) -> list[list[Child]]:
    """Return a row an engine; the first names the scene."""
    scene, truth = comparison.scene, comparison.best
    link = tag("a", named(scene.title or "untitled"), href=f"#{anchor}")
    kind = (comparison.truth or NONE).replace("_", " ")
    rows: list[list[Child]] = []
    for row in comparison.rows:
        run = comparison.trajectories.get(row.engine)
        error, spark = row.score.max_position, None
        if run is not None and truth is not None:
            found = errors(run, truth.trajectory, ~scene.bodies.fixed)
            kept = found.time <= truth.trusted_until
            curve = Curve(row.engine, look_of(row.engine), found.time[kept], found.position[kept])
            label = f"error of {row.engine} in {scene.title}"
            spark = sparkline([curve], scene.world.duration, comparison.tolerance, label)
        rows.append(
            [
                link if not rows else "",
                kind if not rows else "",
                engine_name(row.engine),
                number(error),
                NONE if error is None else f"×{number(error / comparison.tolerance, 2)}",
                number(milliseconds(comparison, row)),
                badge_of(row, comparison.tolerance),
                spark,
            ]
        )
    return rows


def _section(report: SceneReport, comparison: Comparison, anchor: str) -> Section:
    """Return all about one scene."""
    scene = comparison.scene
    parts: list[Markup | None] = [
        tag("p", sentence(comparison), class_="soft"),
        engines_table(comparison),
        remarks(comparison),
    ]
    if comparison.trajectories:
        parts.append(linked_plots(comparison, anchor))
    if report.tradeoff is not None:
        lead = joined(answers(report.tradeoff))
        parts.append(Section("Error against cost", weighed(report.tradeoff, anchor), lead=None, level=3).markup())
        parts.insert(1, lead)
    more = joined(
        *(Section(each.title, each.body, level=3).markup() for each in explanations(comparison)),
        settings_of(comparison),
    )
    parts.append(tag("details", tag("summary", "Settings, missed and phantom contacts"), more))
    return Section(scene.title or report.name, joined(*parts), anchor, tag("bdi", scene.about) if scene.about else None)
