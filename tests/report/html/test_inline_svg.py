"""Figures as SVG in a page: no inline styles, colours of the theme, escaped texts, classes of points and curves."""

import re
from xml.etree.ElementTree import Element

import pytest
from matplotlib.figure import Figure

from sandbox.report.colours import COLOURS
from sandbox.report.html.inline_svg import markup_of, svg_of, time_chart
from sandbox.report.style import INK, chart_figure, finish_chart, shortened
from tests.report.html.page_documents import HOSTILE


def figure() -> Figure:
    chart, panel = chart_figure()
    panel.plot([0.0, 1.0, 2.0], [0.0, 1.0, 4.0], color=COLOURS[1], gid="css:line e1")
    panel.plot([1.0], [1.0], color=INK, marker="o", gid="point:7")
    panel.set_ylabel(shortened(HOSTILE))
    finish_chart(panel, "x, m", 2.0)
    return chart


@pytest.fixture(scope="module")
def root() -> Element:
    return svg_of(figure(), "plot", "a label", "chart")


def test_svg_has_no_inline_styles_and_no_file_metadata(root: Element) -> None:
    assert not [element.tag for element in root.iter() if "style" in element.attrib]
    assert not {"metadata", "style", "script"} & {element.tag for element in root.iter()}
    assert "xmlns" not in markup_of(root)
    assert "font-family" not in markup_of(root)


def test_colours_are_css_variables(root: Element) -> None:
    colours = {element.get(key) for element in root.iter() for key in ("stroke", "fill")} - {None, "none"}
    assert {"var(--e1)", "var(--ink)", "var(--truth)"} <= colours
    assert not [colour for colour in colours if str(colour).startswith("#")]


def test_curves_have_their_class_and_points_their_index(root: Element) -> None:
    (curve,) = root.findall(".//g[@class='line e1']")
    assert curve.find("path") is not None
    (point,) = root.findall(".//g[@data-gid='point:7']")
    assert next(point.iter("use")).get("href", "").startswith("#m")


def test_texts_are_escaped(root: Element) -> None:
    assert HOSTILE[:30] in "".join(root.itertext())
    assert "<img" not in markup_of(root)


def test_identifiers_differ_between_charts() -> None:
    names = [set(re.findall(r' id="([^"]+)"', str(markup_of(svg_of(figure(), name, "", ""))))) for name in ("a", "b")]
    assert names[0]
    assert not names[0] & names[1]


def test_same_figure_yields_the_same_markup() -> None:
    assert markup_of(svg_of(figure(), "a", "", "")) == markup_of(svg_of(figure(), "a", "", ""))


def test_time_chart_has_a_cursor_at_the_start_of_its_axis() -> None:
    html = str(time_chart(figure(), "plot", "a label", 2.0))
    data = {key: float(value) for key, value in re.findall(r'data-(\w+)="([\d.]+)"', html)}
    assert data["duration"] == 2.0
    assert 0.0 < data["left"] < data["right"] < data["width"] == float(re.findall(r'viewBox="0 0 ([\d.]+)', html)[0])
    # The curve begins at t = 0 and ends at t = 2 s, the ends of the axis; coordinates are written to 0.01.
    path = re.findall(r'<g class="line e1"><path d="M([\d.]+) .*?L([\d.]+) [\d.]+"', html)[0]
    assert [float(x) for x in path] == pytest.approx([data["left"], data["right"]], abs=0.011)
    assert f'x1="{data["left"]:.2f}"' in html
