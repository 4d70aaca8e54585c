"""Parts of a page: markup that escapes, numbers as they are written, scales, tables, documents."""

import json
import math
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from page_documents import HOSTILE, extremes_document, tradeoff_document, weighed

from sandbox.measure.extremes import Extremes, Plan
from sandbox.report.page.document import Page, Section, write_page
from sandbox.report.page.extremes_page import extremes_page
from sandbox.report.page.markup import Markup, data, escaped, joined, tag
from sandbox.report.page.scales import Linear, Log
from sandbox.report.page.settings_text import settings_text
from sandbox.report.page.tables import Column, table
from sandbox.report.page.time_chart import Curve, energy_chart, error_chart
from sandbox.report.page.tradeoff_page import tradeoff_page
from sandbox.report.page.wording import number, share
from sandbox.report.work_points import budget_of, pareto_of, work_points
from sandbox.scene.files.load import loads


class Read(HTMLParser):
    """Elements and text of a document."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[str] = []
        self.text = ""
        self.feed(text)

    def handle_starttag(self, name: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append(name)

    def handle_data(self, data: str) -> None:
        self.text += data


@given(st.text())
def test_any_text_is_shown_and_nothing_else(text: str) -> None:
    read = Read(tag("p", text, title=text))
    assert read.elements == ["p"]
    printed = "".join(c for c in text if c.isprintable())
    assert printed in "".join(c for c in read.text if c.isprintable()) or "\N{REPLACEMENT CHARACTER}" in read.text


def test_markup_is_not_escaped_twice() -> None:
    assert joined(tag("b", "<"), escaped(Markup("<i>"))) == "<b>&lt;</b><i>"


def test_attributes_are_left_out_bare_or_escaped() -> None:
    made = tag("input", checked=True, disabled=False, class_=None, data_name='"<', value=0.5)
    assert made == '<input checked data-name="&quot;&lt;" value="0.5">'


def test_lone_surrogate_and_control_characters_can_be_written() -> None:
    assert escaped("a\udcffb\x00").encode("utf-8").decode("utf-8") == "a?b\N{REPLACEMENT CHARACTER}"


def test_data_cannot_end_its_element() -> None:
    made = data({"name": HOSTILE})
    assert made.count("</script>") == 1
    assert json.loads(made.removesuffix("</script>").partition(">")[2]) == {"name": HOSTILE}
    with pytest.raises(ValueError, match="JSON"):
        data([math.nan])


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (math.nan, "–"),
        (math.inf, "∞"),
        (0.0, "0"),
        (0.00123456, "0.00123"),
        (0.000999, "9.99×10⁻⁴"),
        (1e-4, "10⁻⁴"),
        (-1e-7, "−10⁻⁷"),
        (999.6, "1,000"),
        (98765.0, "98,800"),
        (1.5e7, "1.5×10⁷"),
        (-2.5, "−2.5"),
        (100.0, "100"),
    ],
)
def test_numbers_are_written(value: float | None, text: str) -> None:
    assert number(value) == text


def test_shares_are_per_cent_or_about_nothing() -> None:
    assert [share(x) for x in (None, 0.0, 0.0512, -0.5, 1e-14)] == ["–", "0", "+5.1 %", "−50 %", "≈ 0"]


@given(st.floats(-1e9, 1e9), st.floats(-1e9, 1e9))
@example(5e-324, 5e-324)  # the smallest numbers there are
@example(0.0, 5e-324)
def test_linear_scale_holds_its_values_with_ticks_that_ascend(a: float, b: float) -> None:
    low, high = min(a, b), max(a, b)
    scale = Linear.around(low, high)
    assert 0.0 <= scale.share(low) <= scale.share(high) <= 1.0
    ticks = [tick.value for tick in scale.ticks(5)]
    assert 1 <= len(ticks) <= 7
    assert ticks == sorted(set(ticks))


@given(st.floats(1e-16, 1e6), st.floats(1.0, 1e8))
def test_logarithmic_scales_hold_their_values(low: float, ratio: float) -> None:
    for scale in (Log.around(low, low * ratio), Log.snug(low, low * ratio)):
        assert 0.0 <= scale.share(low) <= scale.share(low * ratio) <= 1.0 + 1e-9  # rounding of a logarithm
        assert len({tick.label for tick in scale.ticks(6)}) == len(scale.ticks(6)) >= 1
    assert scale.share(0.0) == 0.0


def test_table_has_a_cell_a_column_and_names_rows() -> None:
    made = table((Column("a"), Column("b", True)), [["<x>", "1"], ["", "2"]], "things")
    assert Read(made).elements.count("td") == 2
    assert "&lt;x&gt;" in made
    assert '<tr class="more">' in made
    with pytest.raises(ValueError, match="zip"):
        table((Column("a"),), [["x", "y"]], "things")


def test_error_chart_draws_zero_at_its_floor_and_leaves_out_nonsense() -> None:
    time = np.linspace(0.0, 1.0, 5)
    curve = Curve("a", "e0", time, np.asarray([0.0, 1e-3, math.inf, math.nan, 1e-2]))
    made = error_chart([curve], "error, m", 1.0, 0.5, 1e-3, "plot")
    (path,) = re.findall(r'<path d="([^"]*)" class="line e0"', made)
    assert path.count("M") == 2  # broken once, where it is not finite
    assert len(re.findall(r"[ML]", path)) == 3
    assert 'class="distrusted"' in made


def test_energy_chart_does_not_follow_one_that_runs_away() -> None:
    time = np.linspace(0.0, 1.0, 11)
    right = Curve("truth", "truth", time, np.linspace(1.0, 0.5, 11))
    wild = Curve("a", "e0", time, 10.0**time * 1e8)
    ticks = re.findall(r'class="tick end">([^<]*)<', energy_chart([wild, right], "energy", 1.0, 1.0, "plot"))
    assert max(float(tick.replace("−", "-")) for tick in ticks) <= 2.0  # two spans of the truth's above it


def test_page_is_written_whole_with_a_policy_that_names_its_parts(tmp_path: Path) -> None:
    page = Page("T", "kind", [Section("One", tag("p", "x"), "one")], "lead", {"python": "3"}, {"cpu": "<c>"})
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


def test_tradeoff_of_nothing_and_extremes_of_nothing_are_pages() -> None:
    assert "0 points" in tradeoff_page(weighed(()).document()).html()
    assert "0 cells" in extremes_page(Extremes(Plan((), ()), (), (), (), (), 0.0).document()).html()


def test_every_point_of_a_trade_off_is_drawn_failures_as_crosses() -> None:
    html = tradeoff_page(tradeoff_document()).html()
    assert len(re.findall(r'data-point="\d"', html)) == 6
    assert len(re.findall(r'class="cross"', html)) == 2  # one in the key
    assert len(re.findall(r'class="floor e0"', html)) == 2


def test_warnings_for_recommended_settings_are_below_their_answers() -> None:
    document = tradeoff_document()
    html = tradeoff_page(document).html()
    answers = html[html.index('class="answers"') : html.index("</ul>")]
    (warned,) = [item for item in answers.split("<li>")[1:] if "substeps &gt;= 20 prevents" in item]
    assert warned.startswith("Cheapest setting of pymunk within the tolerance")
    assert 'src="x"' not in answers


def test_chosen_point_has_its_warnings_and_its_time_per_frame() -> None:
    html = tradeoff_page(tradeoff_document()).html()
    facts = json.loads(re.findall(r'class="facts">(.*?)</script>', html, re.DOTALL)[0])
    own, safe = dict(facts[0]["figures"]), dict(facts[1]["figures"])
    assert own["time per frame"] == "0.0333 ms of the budget of 0.5 ms"  # 2 ms/s, 60 frames a second
    assert own[">frame"].startswith("not recommended: dt is longer than a frame")
    assert "substeps >= 20" in safe["note"]
    assert ">frame" not in safe


def test_settings_with_a_step_longer_than_a_frame_and_dear_frames_are_marked() -> None:
    html = tradeoff_page({**tradeoff_document(), "budget": 0.05}).html()
    front = html[html.index("The Pareto front</bdi>") : html.index("Sources of error")]
    assert front.count("&gt;frame</span>") == 4  # dt is 0.01 s on the whole front
    assert front.count("&gt;budget</span>") == 3  # 2, 5, 8 and 30 ms/s at 60 frames a second
    unmarked = tradeoff_page({**tradeoff_document(), "max_dt": None, "budget": None}).html()
    assert "&gt;frame" not in unmarked
    assert "&gt;budget" not in unmarked


def test_extremes_have_a_cell_a_level() -> None:
    html = extremes_page(extremes_document()).html()
    for word in ("exact", "degraded", "refused", "failed"):
        assert f'class="cell {word}"' in html
    assert "75 %" in html


def test_methods_are_named_by_what_differs() -> None:
    document = tradeoff_document()
    points = work_points(document)
    assert [point.method for point in points if point.engine == "reference"] == ["", "velocity verlet"]
    assert [point.number for point in pareto_of(document, points)] == [0, 3, 4, 5]
    assert budget_of(document) == 30.0  # ms a simulated second: 0.5 a frame, 60 frames


def test_settings_are_a_solver_table_that_a_scene_can_have() -> None:
    text = settings_text({"dt": 1e-4, "substeps": 2, "slop": None, "half_kick": True, "integrator": "rk4"}, "reference")
    solver = loads(f"{text}\n[[ball]]\nposition = [0.0, 0.0]\nradius = 1.0\n", "made.toml").solver
    assert (solver.dt, solver.substeps, solver.half_kick, solver.integrator) == (1e-4, 2, True, "rk4")
