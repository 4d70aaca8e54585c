"""Options shared by several commands, each with one spelling and one help text."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, Protocol, TypeVar

import click


@dataclass(frozen=True, kw_only=True)
class OutputOptions:
    """Output options; base class of the options of each command."""

    as_json: bool
    quiet: bool

    @property
    def is_silent(self) -> bool:
        """Whether neither progress nor results as text are printed."""
        return self.quiet or self.as_json


Taken = TypeVar("Taken")


def takes(options: type[Taken]) -> Callable[[Callable[[Taken], int]], Callable[..., int]]:
    """Return a decorator of a command: it gets its parameters as one value of a dataclass with a field for each."""

    def decorate(command: Callable[[Taken], int]) -> Callable[..., int]:
        @wraps(command)
        def call(**given: Any) -> int:
            return command(options(**given))

        return call

    return decorate


class FiniteRange(click.FloatRange):
    """Range of numbers that contains neither nan nor infinity."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number; fail unless it is finite and within the range."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not finite; the range is {self._describe_range()}.", param, ctx)
        return number


class FractionRange(FiniteRange):
    """Fraction, also in per cent: `0.01` or `1%`."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the fraction; fail unless it is a number within the range."""
        text = str(value).strip()
        if text.endswith("%"):
            try:
                value = float(text[:-1]) / 100.0
            except ValueError:
                self.fail(f"{text!r} is not a fraction, such as 0.01 or 1%.", param, ctx)
        return super().convert(value, param, ctx)


POSITIVE = FiniteRange(min=0.0, min_open=True)
NOT_NEGATIVE = FiniteRange(min=0.0)


CommandFunction = TypeVar("CommandFunction", bound=Callable[..., Any])


class Decorator(Protocol):
    """Adds an option to a command."""

    def __call__(self, command: CommandFunction, /) -> CommandFunction:
        """Return the command with the option."""
        ...


json_option = click.option("--json", "as_json", is_flag=True, help="one JSON document on standard output")
pymunk6_option = click.option("--pymunk6", is_flag=True, help="give the game the names and behaviour of pymunk 6")
verbose_option = click.option("-v", "--verbose", is_flag=True, help="print all columns of the table, and explain each")
sweep_option = click.option(
    "--sweep",
    "sweeps",
    multiple=True,
    metavar="KEY=A,B,C",
    help="run once per value; a range is KEY=LOW:HIGH:N[:log]; several sweeps multiply",
)


def engines_option(default: str, verb: str = "run") -> Decorator:
    """Return `--engine NAME[,NAME]`, also spelled `--engines`, with its default."""
    text = f"engine or engines to {verb}; default: {default}"
    return click.option("--engine", "--engines", "engines", metavar="NAME[,NAME]", help=text)


def set_option(text: str = "set a value of the scene") -> Decorator:
    """Return `--set KEY=VALUE`."""
    return click.option("--set", "overrides", multiple=True, metavar="KEY=VALUE", help=text)


def quiet_option(text: str = "print no table and no progress") -> Decorator:
    """Return `--quiet`."""
    return click.option("--quiet", is_flag=True, help=text)


def out_option(text: str) -> Decorator:
    """Return `--out DIR`."""
    return click.option("--out", type=click.Path(path_type=Path), metavar="DIR", help=text)


def plot_option(text: str) -> Decorator:
    """Return `--plot FILE`."""
    return click.option("--plot", type=click.Path(path_type=Path), metavar="FILE", help=text)


def workers_option(default: int | None, text: str) -> Decorator:
    """Return `--workers N` with its default, and the text that states it."""
    text = f"number of worker processes; default: {text}"
    return click.option("--workers", type=click.IntRange(1, 256), default=default, metavar="N", help=text)


def time_limit_option(text: str) -> Decorator:
    """Return `--time-limit S`, also spelled `--patience`."""
    return click.option("--time-limit", "--patience", "time_limit", type=POSITIVE, metavar="S", help=text)
