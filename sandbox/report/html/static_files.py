"""Static files of pages: their text, and source expressions for the content security policy."""

import base64
import hashlib
from functools import cache
from importlib.resources import files


@cache
def static_text(name: str) -> str:
    """Return the text of a file in `static/`."""
    return files("sandbox.report.html").joinpath("static", name).read_text(encoding="utf-8")


def hash_source(text: str) -> str:
    """Return the source expression of an inline script or style, between two line breaks, by its SHA-256."""
    digest = hashlib.sha256(f"\n{text}\n".encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"
