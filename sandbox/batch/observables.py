"""Observables: figures of a run that a function of the user computes; the store has a column for each.

    sandbox run bounce --sweep solver.dt=0.001,0.01 --observe heights.py:peak --out study

The function gets the `Trajectory` of a run and returns a number, a text, or several of them by name. The text of its
file travels with the tasks, so that workers on other computers need not have it.
"""

import json
import math
import sys
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, Self

import numpy as np

from sandbox.batch.stored_run import dump_json, hash_of
from sandbox.echo import short_repr
from sandbox.resource_limits import FILE_SIZE, read_limited
from sandbox.scene.errors import quoted
from sandbox.trajectory import Trajectory

OBSERVED = "observed."
"""Columns of observables begin with it."""
MAX_VALUES = 200
"""Values that an observable may have"""
MAX_NAME = 100
"""Characters of a name"""
MAX_TEXT = 10_000
"""Characters of a value that is a text"""

ObservedValue = float | int | str | None


class ObservableError(Exception):
    """A function of `--observe` cannot be used; `str()` has its file, the line and the reason."""


@dataclass(frozen=True)
class Observable:
    """A function of the user that computes figures of a run. Picklable."""

    file: str
    """absolute path of its file"""
    function: str
    source: str
    """text of the file"""

    @classmethod
    def read(cls, text: str) -> Self:
        """Return the observable of `FILE.py:FUNCTION`, and execute its file once.

        Raises:
            ObservableError: the file cannot be read or executed, or has no such function.
        """
        name, _, function = text.rpartition(":")
        if not name.endswith(".py") or not function.isidentifier():
            raise ObservableError(f"{short_repr(text)} should be FILE.py:FUNCTION, such as heights.py:peak")
        try:
            source = read_limited(Path(name), FILE_SIZE.value).decode("utf-8-sig")
        except (OSError, ValueError) as error:
            reason = (error.strerror if isinstance(error, OSError) else None) or error
            raise ObservableError(f"{name}: cannot be read: {reason}") from None
        found = cls(str(Path(name).absolute()), function, source)
        _loaded(found)
        return found

    @property
    def digest(self) -> str:
        """Hash of the function and the text of its file: values with another one are computed again."""
        return hash_of([self.function, self.source])

    def observe(self, run: Trajectory) -> dict[str, Any]:
        """Return the values of a run with the hash of this function; a run that is not ok has none.

        Raises:
            ObservableError: the function raised an exception, or returned other than numbers and texts.
        """
        return {"by": self.digest, "values": self._values(run) if run.status == "ok" else {}}

    def has_observed(self, details: Mapping[str, Any]) -> bool:
        """Return whether the details of a stored run have the values of this function."""
        return bool(details.get("observed", {}).get(self.function, {}).get("by") == self.digest)

    def added_to(self, details: str | None, run: Trajectory) -> str:
        """Return the details of a run, as the store has them, with its values beside those of other functions.

        Raises:
            ObservableError: as `observe`.
        """
        stated = json.loads(details or "{}")
        observed = {**stated.get("observed", {}), self.function: self.observe(run)}
        return dump_json({**stated, "observed": observed})

    def _values(self, run: Trajectory) -> dict[str, ObservedValue]:
        function, arrays = _loaded(self), [each for each in vars(run).values() if isinstance(each, np.ndarray)]
        writeable = [each for each in arrays if each.flags.writeable]
        for each in writeable:
            each.setflags(write=False)  # these arrays are stored after this call
        try:
            found = function(run)
        except (Exception, SystemExit) as error:
            raise ObservableError(_located(self, error)) from error
        finally:
            for each in writeable:
                each.setflags(write=True)
        values = found if isinstance(found, Mapping) else {self.function: found}
        if len(values) > MAX_VALUES:
            raise ObservableError(f"{self._name}: returned {len(values):,} values; {MAX_VALUES} are allowed")
        return {self._checked_name(name): self._checked(name, value) for name, value in values.items()}

    def _checked_name(self, name: object) -> str:
        if isinstance(name, str) and 0 < len(name) <= MAX_NAME and name.isprintable() and '"' not in name:
            return name
        raise ObservableError(
            f"{self._name}: {short_repr(name)} is no name of a value; it is a text of 1 to {MAX_NAME} printable "
            "characters without double quotes"
        )

    def _checked(self, name: object, value: Any) -> ObservedValue:
        if hasattr(value, "dtype") and getattr(value, "ndim", None) == 0:
            value = value.item()
        if isinstance(value, float):
            return value if math.isfinite(value) else None
        is_number = isinstance(value, int) and abs(value) < 2**63
        if value is None or is_number or (isinstance(value, str) and len(value) <= MAX_TEXT and _is_unicode(value)):
            found: ObservedValue = value
            return found
        raise ObservableError(
            f"{self._name}: {short_repr(name)} is a {type(value).__name__}; a value is a number of up to 64 bits, a "
            f"text of up to {MAX_TEXT:,} Unicode characters, true, false or None"
        )

    @property
    def _name(self) -> str:
        return f"{Path(self.file).name}:{self.function}"


def observed_values(details: Mapping[str, Any]) -> dict[str, ObservedValue] | None:
    """Return the observed values in the details of a run, of all functions; None if there was no function."""
    if "observed" not in details:
        return None
    return {name: value for each in details["observed"].values() for name, value in each["values"].items()}


def observed_columns(details: str | None) -> dict[str, ObservedValue]:
    """Return the observed values in the details of a run, by column of the store."""
    values = observed_values(json.loads(details or "{}")) or {}
    return {f"{OBSERVED}{quoted(name)}": value for name, value in values.items()}


@lru_cache(maxsize=16)
def _loaded(observable: Observable) -> Callable[[Trajectory], Any]:
    """Execute the file of an observable, and return the function. Modules beside the file can be imported.

    Raises:
        ObservableError: executing it raised an exception, or it has no such function.
    """
    folder = str(Path(observable.file).parent)
    if folder not in sys.path:
        sys.path.append(folder)
    module = ModuleType(f"observable_{observable.digest}")
    module.__file__ = observable.file
    sys.modules[module.__name__] = module  # dataclasses look their module up
    try:
        exec(compile(observable.source, observable.file, "exec"), vars(module))
    except (Exception, SystemExit) as error:
        raise ObservableError(_located(observable, error)) from error
    function = vars(module).get(observable.function)
    if not callable(function):
        raise ObservableError(f"{observable.file}: has no function {short_repr(observable.function)}")
    found: Callable[[Trajectory], Any] = function
    return found


def _is_unicode(text: str) -> bool:
    """Return whether a text has no lone surrogates, which the database cannot store."""
    return not any("\ud800" <= each <= "\udfff" for each in text)


def _located(observable: Observable, error: BaseException) -> str:
    """Return an exception of a user's file in one line, with the last line of that file that led to it."""
    line = error.lineno if isinstance(error, SyntaxError) else None
    with suppress(ValueError):
        frames = traceback.extract_tb(error.__traceback__)
        line = max((k, each.lineno) for k, each in enumerate(frames) if each.filename == observable.file)[1] or line
    where = observable.file if line is None else f"{observable.file}:{line}"
    reason = str(error).partition("\n")[0][:200]
    return f"{where}: {type(error).__name__}" + (f": {reason}" if reason else "")
