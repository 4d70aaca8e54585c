"""Parts of a page: escaped texts, tables, documents, the content policy."""

import json
import math
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markupsafe import Markup

from sandbox.measure.extremes import Extremes, ExtremesPlan
from sandbox.report.html.comparison import settings_text
from sandbox.report.html.extremes import extremes_page
from sandbox.report.html.page import (
    HtmlColumn,
    Page,
    Section,
    badge,
    concatenated,
    definitions,
    engine_name,
    isolated,
    paragraph,
    table,
    write_page,
)
from sandbox.report.html.replay import replay
from sandbox.report.html.tradeoff import error_budget, tradeoff_page
from sandbox.report.tradeoff_plot import budget_of, pareto_of, work_points
from sandbox.scene.files.load import loads
from tests.report.html.page_documents import HOSTILE, SCENE, extremes_document, tradeoff_document, tradeoff_of

pytestmark = pytest.mark.fail_slow(60)  # compiles kernels of `exact`


class ParsedHtml(HTMLParser):
    """Elements and text of an HTML document."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[str] = []
        self.text = ""
        self.feed(str(text))  # str, because slices of Markup are escaped when joined

    def handle_starttag(self, name: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append(name)

    def handle_data(self, data: str) -> None:
        self.text += data


@given(st.text())
def test_any_text_is_shown_as_text(text: str) -> None:
    parsed = ParsedHtml(paragraph(isolated(text)))
    assert parsed.elements == ["p", "bdi"]
    printed = "".join(c for c in text if c.isprintable())
    assert printed in "".join(c for c in parsed.text if c.isprintable())


@pytest.mark.parametrize(
    "part",
    [
        badge(HOSTILE, "bad", HOSTILE),
        engine_name(HOSTILE),
        definitions({HOSTILE: HOSTILE}),
        table([HtmlColumn(HOSTILE, about=HOSTILE)], [[HOSTILE]], HOSTILE),
        Section(HOSTILE, paragraph(HOSTILE), "anchor", HOSTILE).markup(),
    ],
)
def test_every_part_escapes_its_texts(part: Markup) -> None:
    parsed = ParsedHtml(part)
    assert not {"img", "script"} & set(parsed.elements)
    assert HOSTILE in parsed.text


def test_markup_is_not_escaped_twice() -> None:
    assert concatenated(Markup("<b>"), "<", None, paragraph(Markup("<i>"))) == '<b>&lt;<p class="soft"><i></p>'


def test_control_characters_and_lone_surrogates_of_a_page_are_replaced() -> None:
    html = Page("a\udcffb\x00", "kind", []).html()
    assert "<h1><bdi>a?b\N{REPLACEMENT CHARACTER}</bdi></h1>" in html
    html.encode("utf-8")


def test_data_cannot_end_its_element_and_rejects_nan() -> None:
    document = tradeoff_document()
    html = tradeoff_page(document).html()
    (facts,) = re.findall(r'class="facts">(.*?)</script>', html, re.DOTALL)
    assert HOSTILE in [value for fact in json.loads(facts) for _, value in fact["figures"]]
    with pytest.raises(ValueError, match="JSON"):
        replay(loads(SCENE, "hostile.toml"), [], trusted_until=math.nan)


def test_table_has_one_cell_per_column_and_marks_continued_rows() -> None:
    part = table((HtmlColumn("a"), HtmlColumn("b", True)), [["<x>", "1"], ["", "2"]], "things")
    assert ParsedHtml(part).elements.count("td") == 2
    assert "&lt;x&gt;" in part
    assert '<tr class="more">' in part
    with pytest.raises(ValueError, match="zip"):
        table((HtmlColumn("a"),), [["x", "y"]], "things")


def test_page_is_written_atomically_with_a_policy_of_hashes(tmp_path: Path) -> None:
    page = Page("T", "kind", [Section("One", paragraph("x"), "one")], "lead", {"python": "3"}, {"cpu": "<c>"})
    path = write_page(page, tmp_path / "a.html")
    assert [each.name for each in tmp_path.iterdir()] == ["a.html"]
    text = path.read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)
    assert policy is not None
    assert re.fullmatch(
        r"default-src 'none'; img-src data:; style-src 'sha256-[^']*'; script-src 'sha256-[^']*'", policy[1]
    )
    assert not re.search(r'(src|href)="(?!#|data:)', text)
    assert "&lt;c&gt;" in text


def test_empty_trade_off_and_empty_extremes_are_pages() -> None:
    assert "0 points" in tradeoff_page(tradeoff_of(()).document()).html()
    assert "0 cells" in extremes_page(Extremes(ExtremesPlan((), ()), (), (), (), (), 0.0).document()).html()


def test_every_point_of_a_trade_off_is_drawn_including_failures() -> None:
    html = tradeoff_page(tradeoff_document()).html()
    assert len(re.findall(r'data-point="\d"', html)) == 6
    assert len(re.findall(r'aria-label="pymunk; dt 0.1 s, 1 substep; diverged', html)) == 1


def test_warnings_for_recommended_settings_are_below_their_answers() -> None:
    document = tradeoff_document()
    html = tradeoff_page(document).html()
    answers = html[html.index('class="answers"') : html.index("</ul>")]
    (item,) = [item for item in answers.split("<li>")[1:] if "substeps &gt;= 20 prevents" in item]
    assert item.startswith("Cheapest setting of pymunk within the tolerance")
    assert 'src="x"' not in answers


def test_selected_point_has_its_warnings_and_time_per_frame() -> None:
    html = tradeoff_page(tradeoff_document()).html()
    facts = json.loads(re.findall(r'class="facts">(.*?)</script>', html, re.DOTALL)[0])
    own, safe = dict(facts[0]["figures"]), dict(facts[1]["figures"])
    assert own["time per frame"] == "0.0333 ms of the budget of 0.5 ms"  # 2 ms/s at 60 frames per second
    assert own[">frame"].startswith("not recommended: dt is longer than a frame")
    assert "substeps >= 20" in safe["note"]
    assert ">frame" not in safe


def test_settings_beyond_a_frame_or_the_budget_are_marked() -> None:
    html = tradeoff_page({**tradeoff_document(), "budget": 0.05}).html()
    front = html[html.index("The Pareto front</bdi>") : html.index("Sources of error")]
    assert front.count("&gt;frame</span>") == 4  # dt is 0.01 s on the whole front
    assert front.count("&gt;budget</span>") == 3  # 2, 5, 8 and 30 ms/s at 60 frames a second
    unmarked = tradeoff_page({**tradeoff_document(), "max_dt": None, "budget": None}).html()
    assert "&gt;frame" not in unmarked
    assert "&gt;budget" not in unmarked


def test_extremes_have_a_cell_for_every_level() -> None:
    html = extremes_page(extremes_document()).html()
    for word in ("exact", "degraded", "refused", "failed"):
        assert f'class="cell {word}"' in html
    assert "75 %" in html


def test_extremes_name_the_starts_that_survived() -> None:
    document = extremes_document()
    document["cells"][3]["survived"] = {"hits": 9, "trials": 20, "probability": 0.45, "low": 0.26, "high": 0.66}
    document["limits"][0] |= {"bounds": [0.001, None], "cost_ratio": 2.5}
    html = extremes_page(document).html()
    assert 'class="cell failed partial"' in html
    assert "✕ 45 %" in html
    assert "(9 of 20 starts survived)" in html
    assert "0.001 to –" in html


def test_methods_are_named_by_their_differing_settings() -> None:
    document = tradeoff_document()
    points = work_points(document)
    assert [point.method for point in points if point.engine == "reference"] == ["", "velocity verlet"]
    assert [point.index for point in pareto_of(document, points)] == [0, 3, 4, 5]
    assert budget_of(document) == 30.0  # ms per simulated second: 0.5 ms per frame, 60 frames


def test_settings_text_is_a_valid_solver_table_of_a_scene() -> None:
    text = settings_text({"dt": 1e-4, "substeps": 2, "slop": None, "half_kick": True, "integrator": "rk4"}, "reference")
    solver = loads(f"{text}\n[[ball]]\nposition = [0.0, 0.0]\nradius = 1.0\n", "made.toml").solver
    assert (solver.dt, solver.substeps, solver.half_kick, solver.integrator) == (1e-4, 2, True, "rk4")


def row(time_step: float, left: float) -> dict[str, Any]:
    """Return a row of the key `split` of a trade-off."""
    return {"engine": "pymunk", "total": 1.0, "solver": 0.0, "time_step": time_step, "left": left}


def fractions(parts: dict[str, Any]) -> dict[str, float]:
    """Return the width of each part, as a fraction of its bar."""
    bars = re.findall(r'<rect[^>]*width="([0-9.e+-]+)"[^>]*class="bar (\w+)"', error_budget([parts]))
    total = sum(float(width) for width, _ in bars)
    return {key: float(width) / total for width, key in bars}


def test_bar_has_the_parts_of_an_error() -> None:
    # Widths are written to six digits.
    assert fractions(row(0.75, 0.25)) == pytest.approx({"left": 0.25, "time_step": 0.75}, rel=1e-6)


def test_zero_error_has_an_empty_bar() -> None:
    assert fractions(row(0.0, 0.0)) == {}


def test_lengths_are_in_metres() -> None:
    assert "error, m" in error_budget([row(0.75, 0.25)])
