"""Math as MathML, so that a page needs no script and no network. Formulas are converted when the site is built.

Few systems have a font with the tables that MathML needs for roots, sums and accents, so the site ships one: STIX Two
Math, as packaged by ziamath (SIL Open Font License 1.1), reduced to the letters and signs of formulas.
"""

import logging
from importlib.resources import as_file, files
from pathlib import Path

from docutils import nodes
from fontTools import subset
from fontTools.ttLib import TTFont
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator


def visit_inline(writer: HTML5Translator, node: nodes.math) -> None:
    """Write a formula within a line."""
    writer.body.append(convert(node.astext()))
    raise nodes.SkipNode


def visit_block(writer: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula of its own lines; lines end with two backslashes, and `&` aligns them."""
    tex = node.astext()
    if "\\\\" in tex and "\\begin" not in tex:
        tex = rf"\begin{{aligned}}{tex}\end{{aligned}}"
    writer.body.append(f'<div class="math">{convert(tex, display="block")}</div>')
    raise nodes.SkipNode


FONT = "STIXTwoMath.woff"
STYLE = "mathml.css"
RULES = f"""\
@font-face {{ font-family: "STIX Two Math"; src: url("{FONT}") format("woff"); font-display: swap; }}
math {{ font-family: "STIX Two Math", math; font-size: 1.05em; }}
div.math {{ overflow-x: auto; }}
"""
LETTERS_AND_SIGNS = (
    (0x0020, 0x024F),  # Latin
    (0x02B0, 0x03FF),  # accents, Greek
    (0x2000, 0x22FF),  # punctuation, letter-like symbols, arrows, operators
    (0x27E8, 0x27E9),  # angle brackets
    (0x1D400, 0x1D7FF),  # mathematical letters
)
"""First and last code point of each range of characters that the font keeps."""


def write_font(folder: Path) -> None:
    """Write the font and its style sheet into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    logging.getLogger("fontTools").setLevel(logging.WARNING)  # it lists every glyph that it omits
    options = subset.Options(layout_features=["*"], hinting=False)  # all features: roots and sums have larger variants
    subsetter = subset.Subsetter(options)
    subsetter.populate(unicodes=[point for first, last in LETTERS_AND_SIGNS for point in range(first, last + 1)])
    with as_file(files("ziamath") / "fonts" / "STIXTwoMath-Regular.ttf") as path, TTFont(path) as font:
        subsetter.subset(font)
        font.flavor = "woff"
        font.save(folder / FONT)
    (folder / STYLE).write_text(RULES, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer and its font."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    app.connect("builder-inited", _ship_font)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _ship_font(app: Sphinx) -> None:
    if app.builder.format != "html":
        return
    write_font(Path(app.outdir) / "_static")
    app.add_css_file(STYLE)
