"""Figures of matplotlib as SVG within a page.

The content security policy of a page forbids inline styles, and a page has a light and a dark theme. So each style
becomes presentation attributes, and each colour of `THEME` a variable of the page's style sheet. Texts stay texts, in
the font of the page. Artists get their class in the page by their gid: `css:line e0` is the class `line e0`. Other
gids with a colon, such as `point:3`, become `data-gid`.
"""

import re
from io import BytesIO
from warnings import catch_warnings
from xml.etree.ElementTree import Element, SubElement, fromstring, tostring

from markupsafe import Markup
from matplotlib import rc_context
from matplotlib.figure import Figure

from sandbox.report.colours import COLOURS
from sandbox.report.style import FAINT, GRID, INK, SHADED, ignore_missing_glyphs

DPI = 72
"""Units of the SVG are those of the figure at this resolution, points."""
THEME = {
    "#000000": "--truth",
    "#ffffff": "--paper",
    "#444444": "--ink",
    INK.lower(): "--ink",
    FAINT.lower(): "--soft",
    GRID.lower(): "--rule",
    SHADED.lower(): "--shaded",
    **{colour.lower(): f"--e{k}" for k, colour in enumerate(COLOURS)},
}
"""Variable of the style sheet for each colour of the figures."""
CSS = "css:"
"""Prefix of a gid that names a class."""
_NAMESPACE = re.compile(r"\{[^}]*\}")
_LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_SPACE_OF_PATH = re.compile(r"\s*([MLHVCQzZ])\s*")
_REFERENCE = re.compile(r"#([\w-]+)")
_FONT_SIZE = re.compile(r"([\d.]+)px")
_KEPT_STYLES = frozenset(
    {"stroke", "fill", "stroke-width", "stroke-dasharray", "stroke-dashoffset", "stroke-linecap", "stroke-linejoin"}
    | {"stroke-opacity", "fill-opacity", "opacity", "text-anchor", "font-weight"}
)


def svg_of(figure: Figure, name: str, label: str, css_class: str) -> Element:
    """Return a figure as an SVG element that a page can hold.

    Args:
        figure: the figure; its background is not drawn.
        name: name of the chart, unique in the page; identifiers in the chart are derived from it.
        label: description for screen readers.
        css_class: class of the element.
    """
    figure.set_dpi(DPI)
    figure.patch.set_visible(False)
    for panel in figure.axes:
        panel.patch.set_visible(False)
    stream = BytesIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": name}), catch_warnings():
        ignore_missing_glyphs()
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    root = fromstring(stream.getvalue())
    _convert(root)
    used = set(_REFERENCE.findall(tostring(root, encoding="unicode")))
    for element in root.iter():
        if element.get("id") not in used:
            element.attrib.pop("id", None)
    box = root.attrib["viewBox"]
    root.attrib.clear()
    root.attrib.update({"viewBox": box, "class": css_class, "role": "img", "aria-label": label})
    root.attrib.update({"stroke-linejoin": "round", "stroke-linecap": "butt"})
    return root


def markup_of(root: Element) -> Markup:
    """Return an SVG element as HTML."""
    return Markup(tostring(root, encoding="unicode"))


def time_chart(figure: Figure, name: str, label: str, duration: float) -> Markup:
    """Return a chart over time, with the cursor that `charts.js` moves and the geometry that it needs.

    Args:
        figure: figure with one panel, whose x axis spans 0 to `duration`.
        name: name of the chart, unique in the page.
        label: description for screen readers.
        duration: duration of the time axis, s.
    """
    root = svg_of(figure, name, label, "chart time")
    width, height = (DPI * float(inches) for inches in figure.get_size_inches())
    box = figure.axes[0].get_position()
    left, right = f"{width * box.x0:.2f}", f"{width * box.x1:.2f}"
    ends = {"y1": f"{height * (1.0 - box.y1):.2f}", "y2": f"{height * (1.0 - box.y0):.2f}"}
    SubElement(root, "line", {"x1": left, "x2": left, **ends, "class": "cursor"})
    data = {"left": left, "right": right, "width": f"{width:g}", "duration": repr(duration)}
    root.attrib.update({f"data-{key}": value for key, value in data.items()})
    return markup_of(root)


def _convert(parent: Element) -> None:
    """Rewrite an element and its descendants: no namespaces, style sheets, metadata and inline styles."""
    parent.tag = _NAMESPACE.sub("", parent.tag)
    attributes = {_NAMESPACE.sub("", key): value for key, value in parent.attrib.items()}
    style = attributes.pop("style", "")
    for declaration in filter(None, map(str.strip, style.split(";"))):
        key, _, value = (part.strip() for part in declaration.partition(":"))
        if key in ("font", "font-size") and (size := _FONT_SIZE.search(value)):
            attributes["font-size"] = size[1]
            if "bold" in value or "700" in value:
                attributes["font-weight"] = "bold"
        elif key in _KEPT_STYLES:
            attributes[key] = f"var({THEME[value.lower()]})" if value.lower() in THEME else value
    gid = attributes.get("id", "")
    if gid.startswith(CSS):
        attributes["class"] = attributes.pop("id").removeprefix(CSS)
    elif ":" in gid:  # set by a plot; the identifiers of matplotlib have none
        attributes["data-gid"] = attributes.pop("id")
    parent.attrib.clear()
    parent.attrib.update({key: _LONG_NUMBER.sub(_rounded, value) for key, value in attributes.items()})
    if "d" in attributes:
        parent.attrib["d"] = _SPACE_OF_PATH.sub(r"\1", parent.attrib["d"]).strip()
    if parent.get("transform", "").startswith("rotate(-0 "):
        del parent.attrib["transform"]
    parent.tail = None
    if parent.tag != "text" and parent.tag != "tspan":
        parent.text = None
    for child in list(parent):
        if _NAMESPACE.sub("", child.tag) in ("metadata", "style"):
            parent.remove(child)
            continue
        _convert(child)
        if child.tag in ("g", "defs") and not len(child) and not child.text:
            parent.remove(child)


def _rounded(match: re.Match[str]) -> str:
    """Return a length to 0.01 points, far finer than a pixel."""
    return f"{float(match[0]):.2f}".rstrip("0").rstrip(".")
