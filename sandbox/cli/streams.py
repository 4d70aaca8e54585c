"""Standard streams: closed ones are replaced; a failed write to standard output is one error."""

import codecs
import errno
import io
import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import click

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


class OutputError(Exception):
    """Standard output cannot be written: the disk is full, or it is closed. `str()` is the reason."""


def prepare_streams() -> None:
    """Replace the standard streams by ones that handle closed descriptors, full disks and missing characters.

    The next file that is opened, such as a database, would get a closed descriptor of 0 to 2, and text for the terminal
    would be written into it. Therefore closed descriptors are opened on the null device; standard output for reading
    only, so that a write to it fails. Characters that an encoding lacks are written as escapes.

    The first failed write to standard output raises `OutputError`; further output is dropped, also at the exit of the
    interpreter. Standard error drops output that cannot be written, because there is no other stream for the report.
    """
    for descriptor, flags in enumerate((os.O_RDONLY, os.O_RDONLY, os.O_WRONLY)):
        try:
            os.fstat(descriptor)
        except OSError:
            null = os.open(os.devnull, flags)  # gets the lowest free descriptor: this one
            os.set_inheritable(null, True)
    if sys.stdin is None:
        sys.stdin = Path(os.devnull).open(encoding="utf-8")  # noqa: SIM115, open until the process ends
    sys.stdout = _guarded(sys.stdout, _Output, os.O_RDONLY)
    sys.stderr = _guarded(sys.stderr, _Errors, os.O_WRONLY)


def can_write_unicode() -> bool:
    """Return whether standard output can encode every character."""
    encoding = getattr(sys.stdout, "encoding", None)
    return encoding is None or codecs.lookup(encoding).name.startswith("utf")


def print_json(document: Any) -> None:
    """Print the JSON document of `--json` on standard output."""
    import json  # help does not need it

    click.echo(json.dumps(document, ensure_ascii=not can_write_unicode(), allow_nan=False))


class JsonSpool:
    """Elements of a long JSON array, kept in a temporary file until they are printed in their order."""

    def __init__(self) -> None:
        from tempfile import TemporaryFile

        self._file = TemporaryFile()  # noqa: SIM115, closed by `print`
        self._places: dict[int, tuple[int, int]] = {}
        """offset and size of each element, bytes"""

    def add(self, index: int, element: Any) -> None:
        """Keep an element under its index in the array."""
        import json

        text = json.dumps(element, ensure_ascii=not can_write_unicode(), allow_nan=False).encode("utf-8")
        self._places[index] = self._file.seek(0, os.SEEK_END), len(text)
        self._file.write(text)

    def print(self, key: str, others: dict[str, Any]) -> None:
        """Print an object with the array under a key, followed by other keys, and remove the temporary file."""
        import json

        click.echo(f"{{{json.dumps(key)}: [", nl=False)
        for k, index in enumerate(sorted(self._places)):
            offset, size = self._places[index]
            self._file.seek(offset)
            click.echo((", " if k else "") + self._file.read(size).decode("utf-8"), nl=False)
        rest = json.dumps(others, ensure_ascii=not can_write_unicode(), allow_nan=False)
        click.echo(f"]{', ' if others else ''}{rest[1:]}")
        self._file.close()


class _Output(io.FileIO):
    """Standard output, unbuffered."""

    _has_failed = False

    def write(self, data: "ReadableBuffer", /) -> int:
        """Write bytes; after a failure, drop them.

        Raises:
            BrokenPipeError: the reader has closed the pipe, as `| head` does.
            OutputError: they cannot be written.
        """
        if self._has_failed:
            return memoryview(data).nbytes
        try:
            return super().write(data)
        except BrokenPipeError:
            self._has_failed = True
            raise
        except OSError as error:
            self._has_failed = True
            reason = "it is closed" if error.errno == errno.EBADF else error.strerror or str(error)
            raise OutputError(reason) from None


class _Errors(io.FileIO):
    """Standard error, unbuffered."""

    def write(self, data: "ReadableBuffer", /) -> int:
        """Write bytes, or drop them if they cannot be written."""
        with suppress(OSError):
            return super().write(data)
        return memoryview(data).nbytes


def _guarded(stream: TextIO | None, kind: type[io.FileIO], flags: int) -> TextIO:
    """Return a stream with the properties of another, on the same descriptor, that writes through `kind`."""
    if stream is None:  # closed; a new descriptor, because another file may have taken the old one
        return io.TextIOWrapper(io.BufferedWriter(_null(kind, flags)), "utf-8", "backslashreplace")
    assert isinstance(stream, io.TextIOWrapper)
    raw = getattr(stream.buffer, "raw", stream.buffer)  # unbuffered streams have no buffer in between
    if type(raw) is not io.FileIO:  # a console of Windows: takes Unicode, and is never full
        stream.reconfigure(errors="backslashreplace")
        return stream
    return io.TextIOWrapper(
        io.BufferedWriter(kind(raw.fileno(), "wb", closefd=False)),
        stream.encoding,
        "backslashreplace",
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


def _null(kind: type[io.FileIO], flags: int) -> io.FileIO:
    return kind(os.open(os.devnull, flags), "wb")
