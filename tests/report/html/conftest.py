"""Pages with hostile texts, and a browser that shows them."""

from pathlib import Path

import pytest

from sandbox.measure.compare import Comparison, compare
from sandbox.report.html.comparison import write_comparison
from sandbox.report.html.extremes import write_extremes
from sandbox.report.html.game_advice import write_game_advice
from sandbox.report.html.overview import Overview, SceneReport
from sandbox.report.html.page import write_page
from sandbox.report.html.tradeoff import write_tradeoff
from sandbox.scene.files.load import loads
from tests.browser import browser as browser
from tests.report.html.game_advice_documents import game_advice, runs
from tests.report.html.page_documents import HOSTILE, SCENE, extremes_document, tradeoff_document


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    """Two engines on a scene whose names and texts are markup."""
    return compare(loads(SCENE, "hostile.toml"), ("pymunk", "exact"))


@pytest.fixture(scope="module")
def pages(comparison: Comparison, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A page of each kind."""
    folder = tmp_path_factory.mktemp("pages")
    overview = Overview(asked=3)
    overview.add(SceneReport("one", comparison, tradeoff=tradeoff_document()))
    overview.add(SceneReport(HOSTILE, failure=HOSTILE))
    overview.add(SceneReport("two", comparison))
    return {
        "comparison": write_comparison(comparison, folder / "comparison.html"),
        "tradeoff": write_tradeoff(tradeoff_document(), folder / "tradeoff.html", comparison),
        "extremes": write_extremes(extremes_document(), folder / "extremes.html"),
        "game advice": write_game_advice(game_advice(runs()), runs(), folder / "game_advice.html", [HOSTILE]),
        "overview": write_page(overview.page(), folder / "overview.html"),
    }
