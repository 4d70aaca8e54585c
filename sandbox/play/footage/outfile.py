"""Outfile: where a picture or film goes. It is written under a temporary name and takes its own once it is whole."""

import os
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import count
from pathlib import Path
from typing import Self

from sandbox.whole import temporary_path

LONGEST_STEM = 60
"""Letters of a scene's name that its files bear."""


class CaptureError(Exception):
    """A picture or film cannot be made; `str()` says why, and what would help."""


@dataclass(frozen=True)
class Outfile:
    """A file to be: a temporary name beside it, and how that becomes the file."""

    temporary: Path
    _placed: Callable[[Path], Path]

    @classmethod
    def at(cls, path: Path) -> Self:
        """Return an outfile that replaces what a path holds."""
        return cls(temporary_path(path.parent), lambda temporary: temporary.replace(path))

    @classmethod
    def numbered(cls, folder: Path, stem: str, suffix: str) -> Self:
        """Return an outfile that takes the first free of `sandbox-<stem>-1<suffix>`, `…-2<suffix>` and so on."""
        return cls(temporary_path(folder), partial(_place_numbered, folder=folder, stem=safe(stem), suffix=suffix))

    def place(self) -> Path:
        """Give the finished file its name, and return it.

        Raises:
            CaptureError: that cannot be done; the temporary file is gone then.
        """
        try:
            return self._placed(self.temporary)
        except OSError as error:
            self.discard()
            raise unwritable(self.temporary.parent, error) from None

    def discard(self) -> None:
        """Remove the temporary file, where there is one."""
        with suppress(NotADirectoryError):  # its folder has become a file
            self.temporary.unlink(missing_ok=True)


def safe(name: str) -> str:
    """Return a name of letters, digits, - and _ alone, fit for a file of any system."""
    return re.sub(r"[^A-Za-z0-9_-]+", "-", name)[:LONGEST_STEM].strip("-") or "scene"


def unwritable(place: Path, error: OSError) -> CaptureError:
    """Return what to say of a file that cannot be written."""
    return CaptureError(f"{place}: cannot be written: {error.strerror or error}")


def _place_numbered(temporary: Path, folder: Path, stem: str, suffix: str) -> Path:
    """Move a file to the first free number. What another process puts there meanwhile stays."""
    for number in count(1):
        path = folder / f"sandbox-{stem}-{number}{suffix}"
        try:
            os.link(temporary, path)  # unlike a rename, it never replaces
        except FileExistsError:
            continue
        except OSError:  # a file system without links: take the name by an empty file, then fill it at once
            try:
                path.open("xb").close()
            except FileExistsError:
                continue
            return temporary.replace(path)
        temporary.unlink()
        return path
    raise AssertionError("numbers do not end")
