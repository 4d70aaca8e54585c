"""Whole files: written under a temporary name, and renamed once they are complete."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Yield a temporary path to write to, which becomes the file at the end; after an error nothing is left of it.

    Raises:
        OSError: the file cannot take its place.
    """
    temporary = path.with_name(f".{uuid4().hex}.tmp")
    try:
        yield temporary
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
