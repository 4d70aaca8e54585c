"""Reports: plots, tables and HTML pages."""

import os
import sys
from contextlib import suppress


def _import_matplotlib() -> None:
    """Import matplotlib although `MPLBACKEND` may name a backend that is not installed.

    A command started from a notebook inherits the notebook's backend, which its own environment may lack. Figures are
    written to files, which needs none. A valid backend is selected, as matplotlib does, for the user's own figures.
    """
    backend = os.environ.pop("MPLBACKEND")
    try:
        import matplotlib
    finally:
        os.environ["MPLBACKEND"] = backend
    with suppress(ValueError):
        matplotlib.rcParams["backend"] = backend


if os.environ.get("MPLBACKEND") and "matplotlib" not in sys.modules:  # otherwise imported where it is used
    _import_matplotlib()
