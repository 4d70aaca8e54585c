"""Display in notebooks: `_repr_html_` for values, by a renderer that is imported only when one is displayed.

The renderer draws plots and replays, which the values themselves know nothing of; it is found by its name, as a
plotting backend is, so that no module here depends on it.
"""

from importlib import import_module

RENDERER = "sandbox.notebook"
"""The module whose `html_of` renders a value."""


class HtmlRepr:
    """Mixin for values that a notebook displays as HTML."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        """Return self-contained HTML, as IPython's display protocol asks for."""
        html: str = import_module(RENDERER).html_of(self)
        return html
