"""Sphinx extension: with the tag `student` the site has no answers: each `<details>` box of the lessons is left out.

`python -m sphinx -t student docs build/student` builds it.
"""

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.config import Config

FOLDER = "lessons/"


def remove_boxes(parent: nodes.Element) -> None:
    """Remove the boxes, each with all that is between its opening and its closing tag."""
    inside = False
    for child in list(parent.children):
        html = child.astext() if isinstance(child, nodes.raw) else ""
        inside = inside or html.startswith("<details")
        if inside:
            parent.remove(child)
        inside = inside and not html.startswith("</details>")
    if inside:
        raise ValueError(f"{parent.source}: a <details> box is not closed in its section")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("config-inited", _leave_sources_out)
    app.connect("doctree-read", _remove_answers)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _leave_sources_out(app: Sphinx, config: Config) -> None:
    if app.tags.has("student"):
        config.html_copy_source = False  # the sources of the pages have the answers


def _remove_answers(app: Sphinx, doctree: nodes.document) -> None:
    if app.tags.has("student") and app.env.docname.startswith(FOLDER):
        for section in list(doctree.findall(nodes.section)):
            remove_boxes(section)
