"""Studies: what a sweep runs, from the command line or from a file that stands beside the scenes.

[study]
scenes = ["pile.toml", "bounce"]     # relative to the file, or names of shipped scenes
engines = ["pymunk", "reference"]
seeds = 10
sample = "64:sobol"                  # points drawn from the ranges without a count

[study.set]
"solver.record_every" = 10

[study.sweep]
"solver.dt" = "0.001:0.01:4:log"     # as on the command line
"ball.*.restitution" = [0.2, 0.5, 0.8]
"ball.*.friction" = "0:1"            # a range to draw from
"""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from sandbox.batch.job import KeptParts
from sandbox.batch.sampling import Sampling, sampled_axis
from sandbox.batch.sweep import SampledRange, SweepAxis, parse_sweep
from sandbox.echo import short_repr
from sandbox.resource_limits import FILE_SIZE, read_limited
from sandbox.scene.errors import Fault, Lines, SceneError
from sandbox.scene.files.document import check_text
from sandbox.scene.files.load import Override
from sandbox.scene.files.overrides import AddressError, parse_assignment

HEADING = "study"
MAX_SEEDS = 100_000_000


class _StudyTable(BaseModel):
    """The table `[study]` of a file."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    scenes: Annotated[list[str], Field(min_length=1)]
    engines: Annotated[list[str], Field(min_length=1)] | None = None
    set: dict[str, Any] = {}
    sweep: dict[str, str | list[Any]] = {}
    sample: Annotated[int, Field(ge=1)] | str | None = None
    seeds: Annotated[int, Field(ge=1, le=MAX_SEEDS)] | None = None
    player: str | None = None
    keep: KeptParts | None = None
    time_limit: Annotated[float, Field(gt=0.0, allow_inf_nan=False, strict=False)] | None = None
    audit: bool | None = None
    ledger: bool | None = None
    observe: str | None = None


@dataclass(frozen=True)
class Study:
    """What is run. None and empty values stand for the defaults of `sandbox run`."""

    scenes: tuple[str, ...]
    engines: tuple[str, ...] | None = None
    overrides: tuple[Override, ...] = ()
    sweeps: tuple[str | tuple[str, list[Any]], ...] = ()
    """`KEY=…` as on the command line, or a key and its values"""
    sample: str | None = None
    seeds: int | None = None
    player: str | None = None
    keep: KeptParts | None = None
    time_limit: float | None = None
    audit: bool | None = None
    ledger: bool | None = None
    observe: str | None = None
    """`FILE.py:FUNCTION`"""
    source: str = field(default="", compare=False)
    """file of the study; empty for the command line"""

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a study file.

        Raises:
            SceneError: it cannot be read, or has faults; each with its line.
        """
        file = str(path)
        try:
            text = read_limited(Path(path), FILE_SIZE.value).decode("utf-8-sig")
            check_text(text)
            document = tomllib.loads(text)
        except OSError as error:
            raise SceneError([Fault.of(file, f"cannot be read: {error.strerror or error}")]) from None
        except ValueError as error:
            raise SceneError([Fault.of(file, f"not a study file: {error}")]) from None
        lines = Lines(text)
        faults = [
            Fault(file, lines.find((key,)), key, f"unknown table; a study file has one, [{HEADING}]")
            for key in document
            if key != HEADING
        ]
        try:
            table = _StudyTable.model_validate(document[HEADING])
        except ValidationError as error:
            faults += [_fault(file, lines, each) for each in error.errors(include_url=False)]
        if faults:
            raise SceneError(tuple(dict.fromkeys(faults)))
        return cls(
            scenes=tuple(_scene_beside(Path(path), scene) for scene in table.scenes),
            engines=None if table.engines is None else tuple(table.engines),
            overrides=tuple(table.set.items()),
            sweeps=tuple(
                f"{key}={values}" if isinstance(values, str) else (key, values) for key, values in table.sweep.items()
            ),
            sample=None if table.sample is None else str(table.sample),
            seeds=table.seeds,
            player=table.player,
            keep=table.keep,
            time_limit=table.time_limit,
            audit=table.audit,
            ledger=table.ledger,
            observe=None if table.observe is None else str(Path(path).parent / table.observe),
            source=file,
        )

    def with_options(self, given: "Study") -> "Study":
        """Return the study with the options of a command line, which replace those of the file.

        A key that `--set` or `--sweep` gives replaces the same key of the file, in either table.
        """
        keys = {key_of(each) for each in (*given.overrides, *given.sweeps)}
        return Study(
            scenes=self.scenes,
            engines=given.engines or self.engines,
            overrides=(*(each for each in self.overrides if key_of(each) not in keys), *given.overrides),
            sweeps=(*(each for each in self.sweeps if key_of(each) not in keys), *given.sweeps),
            sample=given.sample or self.sample,
            seeds=given.seeds or self.seeds,
            player=given.player or self.player,
            keep=given.keep or self.keep,
            time_limit=given.time_limit or self.time_limit,
            audit=self.audit if given.audit is None else given.audit,
            ledger=self.ledger if given.ledger is None else given.ledger,
            observe=given.observe or self.observe,
            source=self.source,
        )

    def axes(self) -> tuple[list[SweepAxis], list[Fault]]:
        """Return the axes of the sweeps and of the sample, which comes last, and the faults."""
        axes: list[SweepAxis] = []
        ranges: list[SampledRange] = []
        faults: list[Fault] = []
        sampling: Sampling | None = None
        if self.sample is not None:
            try:
                sampling = Sampling.parse(self.sample)
            except AddressError as error:
                faults.append(Fault.of("--sample", str(error)))
        for sweep in self.sweeps:
            try:
                if not isinstance(sweep, str):
                    axes.append(_axis_of_list(*sweep))
                    continue
                drawn = None if self.sample is None else SampledRange.parse(sweep)
                if drawn is None:
                    axes.append(SweepAxis.of(*parse_sweep(sweep)))
                else:
                    ranges.append(drawn)
            except AddressError as error:
                faults.append(Fault.of("--sweep", str(error)))
        if self.sample is not None and not ranges and not faults:
            message = "needs a range to draw from: --sweep KEY=LOW:HIGH or KEY=LOW:HIGH:log, without a count"
            faults.append(Fault.of("--sample", message))
        if sampling is not None and ranges:
            try:
                axes.append(sampled_axis(ranges, sampling))
            except AddressError as error:
                faults.append(Fault.of("--sample", str(error)))
        return axes, faults


def is_study(path: str | Path) -> bool:
    """Return whether a file is a study: TOML with a table `[study]`. A file that cannot be read is none."""
    if Path(path).suffix.lower() != ".toml":
        return False
    try:
        text = read_limited(Path(path), FILE_SIZE.value).decode("utf-8-sig")
        if HEADING not in text:  # parsing a large scene takes seconds
            return False
        check_text(text)
        return HEADING in tomllib.loads(text)
    except (OSError, ValueError):
        return False


def key_of(override: Override | tuple[str, list[Any]]) -> str:
    """Return the key of a value set or swept; the text itself if it has none."""
    if not isinstance(override, str):
        return str(override[0])
    try:
        return parse_assignment(override)[0]
    except AddressError:
        return override


def _axis_of_list(key: str, values: Sequence[Any]) -> SweepAxis:
    if not values:
        raise AddressError(f"{short_repr(key)}: at least one value is needed")
    return SweepAxis.of(key, list(values))


def _scene_beside(study: Path, scene: str) -> str:
    """Return a scene of a study: a file or folder relative to the study, or else a name as on the command line."""
    beside = study.parent / scene
    return str(beside) if beside.exists() else scene


def _fault(file: str, lines: Lines, error: Any) -> Fault:
    location = (HEADING, *(each for each in error["loc"] if not _is_type(each)))
    path = ".".join(map(str, location))
    message = error["msg"].removeprefix("Input should be ")
    if error["type"] == "extra_forbidden":
        message = f"unknown key; known keys: {', '.join(_StudyTable.model_fields)}"
    elif error["type"] == "missing":
        message = "is missing"
    elif error["type"] in ("model_type", "dict_type"):
        message = "must be a table"
    elif message != error["msg"]:
        message = f"must be {message}"
    return Fault(file, lines.find(location), path, message)


def _is_type(part: Any) -> bool:
    """Return whether a part of pydantic's location names the member of a union, which is no key."""
    return isinstance(part, str) and (
        part in ("int", "str", "constrained-int") or part.startswith(("list[", "function"))
    )
