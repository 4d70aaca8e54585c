"""Figure files: a figure written whole, the same run making the same bytes."""

from pathlib import Path
from warnings import catch_warnings, filterwarnings

from matplotlib.figure import Figure

from sandbox.whole import whole

FORMATS: dict[str, dict[str, None]] = {".png": {}, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
"""Suffixes that can be written, each with the metadata to leave out: the same run makes the same picture."""


def write_figure(figure: Figure, path: Path) -> Path:
    """Write a figure by its path's suffix, one of `FORMATS`, and return the path.

    Raises:
        OSError: the file cannot be written.
    """
    suffix = path.suffix.lower()
    with whole(path) as temporary, temporary.open("xb") as stream, catch_warnings():
        # No font has every character; a missing one shows as a box.
        filterwarnings("ignore", message="Glyph .* missing from")
        filterwarnings("ignore", message="Matplotlib currently does not support .* natively")
        figure.savefig(stream, format=suffix[1:], dpi=150, metadata=FORMATS[suffix])
    return path
