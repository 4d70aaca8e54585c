"""Formulas: the font that the site ships has the characters of all of them."""

import json
import re
from html import unescape
from pathlib import Path

import pytest

mathml = pytest.importorskip("mathml", exc_type=ImportError)

DOCS = Path(__file__).parents[2] / "docs"
FORMULA = re.compile(r"\$\$(.+?)\$\$|(?<![\\$`\w])\$(?! )([^$\n]+?)\$(?!\w)", re.DOTALL)
CODE = re.compile(r"^```.*?^```$|`[^`\n]+`", re.MULTILINE | re.DOTALL)


def formulas(path: Path) -> list[str]:
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        text = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    return [block or inline for block, inline in FORMULA.findall(CODE.sub("", text))]


@pytest.mark.filterwarnings("ignore:(path|open_text|read_text) is deprecated:DeprecationWarning")  # latex2mathml
@pytest.mark.fail_slow(60)  # reduces a font, and converts all formulas
def test_font_has_the_characters_of_all_formulas(tmp_path: Path) -> None:
    mathml.write_font(tmp_path)
    with mathml.TTFont(tmp_path / mathml.FONT) as font:
        known = font.getBestCmap()
    count, missing = 0, set()
    for path in [*DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb")]:
        for formula in formulas(path):
            count += 1
            text = unescape(re.sub(r"<[^>]+>", "", mathml.convert(formula)))
            missing |= {(path.name, char) for char in text if not char.isspace() and ord(char) not in known}
    assert not missing
    assert count > 100
