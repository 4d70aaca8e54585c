"""Shell completion: commands, options, engines, scenes, runs and the keys of `--set`, for bash, zsh and fish.

It uses the completion of click: `_SANDBOX_COMPLETE=bash_source sandbox` prints the script for a shell, which calls
`_SANDBOX_COMPLETE=bash_complete sandbox` for the matching words. Otherwise this module is not imported.
"""

import tomllib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import click
from click.shell_completion import BashComplete, CompletionItem, ZshComplete, add_completion_class

from sandbox.echo import printable

SCENE_ENDINGS = (".toml",)
SESSION_ENDINGS = (".toml", ".json")
RUN_ENDINGS = (".npz", ".json")
LEVEL_ENDINGS = (".svg", ".tmx", ".json")

Words = Callable[[click.Context, str], Iterable[str]]


class CompletedText(click.types.StringParamType):
    """Text argument that the shell completes."""

    name = "text"

    def __init__(self, words: Words) -> None:
        self._words = words

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:  # noqa: ARG002
        """Return the words that begin with the incomplete one; none if looking for them fails."""
        try:
            found = [word for word in self._words(ctx, incomplete) if word.startswith(incomplete)]
        except Exception:  # noqa: BLE001, a message would disturb the line that is being typed
            return []
        return [CompletionItem(word) for word in found if word == printable(word)]


def add_completions(command: click.Command) -> None:
    """Set the completion of the parameters of a command, by their names."""
    for parameter in command.params:
        words = _WORDS.get(parameter.name or "")
        if (command.name, parameter.name) in (("run", "scenes"), ("advise", "scene")):
            words = _scenes_and_sessions
        if words is not None and not isinstance(parameter.type, click.Choice):
            parameter.type = CompletedText(words)


def register_shells() -> None:
    """Register scripts of bash and zsh that add no space after `/`, `.` or `=`, as the one of fish does already."""
    add_completion_class(_Bash)
    add_completion_class(_Zsh)


class _Bash(BashComplete):
    source_template = BashComplete.source_template.replace(
        "    return 0\n",
        "    [[ ${#COMPREPLY[@]} == 1 && ${COMPREPLY[0]} == *[/.=] ]] && compopt -o nospace\n\n    return 0\n",
    )

    @staticmethod
    def _check_version() -> None:
        """Do nothing: the check of click starts a bash to ask for its version, and 4.4, of 2016, suffices."""


class _Zsh(ZshComplete):
    source_template = ZshComplete.source_template.replace(
        "        compadd -U -V unsorted -a completions\n",
        "        local -a unfinished finished\n"
        "        unfinished=(${(M)completions:#*[/.=]})\n"
        "        finished=(${completions:#*[/.=]})\n"
        "        (( $#unfinished )) && compadd -U -V unsorted -S '' -a unfinished\n"
        "        (( $#finished )) && compadd -U -V unsorted -a finished\n",
    )


def _engines(_ctx: click.Context, _incomplete: str) -> Iterable[str]:
    from sandbox.engines.registry import ENGINES

    return ENGINES


def _several_engines(ctx: click.Context, incomplete: str) -> Iterable[str]:
    return _list_of(_engines(ctx, incomplete), incomplete)


def _list_of(names: Iterable[str], incomplete: str) -> list[str]:
    """Return the lists `NAME,NAME` that end in each name which the list does not contain yet."""
    before, comma, _ = incomplete.rpartition(",")
    return [before + comma + name for name in names if name not in before.split(",")]


def _scenes(_ctx: click.Context, incomplete: str) -> Iterable[str]:
    return dict.fromkeys([*_shipped(incomplete), *_files(incomplete, SCENE_ENDINGS)])


def _scenes_and_sessions(_ctx: click.Context, incomplete: str) -> Iterable[str]:
    return dict.fromkeys([*_shipped(incomplete), *_files(incomplete, SESSION_ENDINGS)])


def _shipped(incomplete: str) -> list[str]:
    """Return names of shipped scenes: short names, or full names after a folder."""
    from sandbox.scene.files.shipped_scenes import shipped

    names = [scene.name for scene in shipped()]
    if "/" in incomplete:
        return names
    short = [name.rpartition("/")[2] for name in names]
    unique = sorted(name for name in short if short.count(name) == 1)
    return [*unique, *dict.fromkeys(name.rpartition("/")[0] + "/" for name in names)]


def _files(incomplete: str, endings: Sequence[str]) -> list[str]:
    """Return the files and folders that complete a path; hidden ones only after the dot."""
    folder, slash, beginning = incomplete.rpartition("/")
    found: list[str] = []
    within = Path(folder + slash or ".")
    for entry in sorted(within.iterdir() if within.is_dir() else ()):
        if not entry.name.startswith(beginning) or (entry.name.startswith(".") and not beginning):
            continue
        path = folder + slash + entry.name
        if entry.is_dir():
            found.append(path + "/")
        elif entry.name.lower().endswith(tuple(endings)):
            found.append(path)
    return found


def _runs(_ctx: click.Context, incomplete: str) -> Iterable[str]:
    return _files(incomplete, RUN_ENDINGS)


def _levels(_ctx: click.Context, incomplete: str) -> Iterable[str]:
    return _files(incomplete, LEVEL_ENDINGS)


def _folders(_ctx: click.Context, incomplete: str) -> Iterable[str]:
    return _files(incomplete, ())


def _keys(ctx: click.Context, incomplete: str) -> Iterable[str]:
    """Return the keys of `--set`, completed part by part: `ball.`, `ball.cue.`, `ball.cue.velocity=`."""
    from sandbox.scene.files.document import keys_of, list_tables, model_at

    if "=" in incomplete:
        return []
    parts = incomplete.split(".")[:-1]
    lists, document = list_tables(), _document(ctx)
    if not parts:
        return [f"{table}." for table in ("solver", "world", *(each for each in document if each in lists))]
    before = ".".join(parts) + "."
    if len(parts) == 1 and parts[0] in ("solver", "world"):
        return [f"{before}{key}=" for key in keys_of(model_at((parts[0],)))]
    if len(parts) == 1 and parts[0] in document:
        return [f"{before}{name}." for name in _names(document[parts[0]], parts[0])]
    if len(parts) == 2 and parts[0] in lists and parts[0] in document:
        named = dict(zip(_names(document[parts[0]], parts[0]), document[parts[0]], strict=True))
        kind = named.get(parts[1], document[parts[0]][0]).get("kind")
        return [f"{before}{key}=" for key in keys_of(model_at((parts[0], 0, *([kind] if kind else []))))]
    return []


def _names(elements: Sequence[dict[str, Any]], kind: str) -> list[str]:
    from sandbox.scene.description.scene import default_name

    return [str(each.get("name", default_name(kind, k))) for k, each in enumerate(elements)]


def _document(ctx: click.Context) -> dict[str, Any]:
    """Return the document of the first scene of the line; empty if none is typed yet."""
    from sandbox.scene.files.shipped_scenes import find

    # An option without its value ends click's parsing; the arguments before it are then left in `ctx.args`.
    given = ctx.params.get("scene") or ctx.params.get("scenes") or ctx.args
    if not given:
        return {}
    return tomllib.loads(find(given if isinstance(given, str) else str(given[0])).read_text(encoding="utf-8"))


def _metrics(_ctx: click.Context, _incomplete: str) -> Iterable[str]:
    from sandbox.measure.compare.metrics import METRICS

    return METRICS


def _axes(_ctx: click.Context, incomplete: str) -> Iterable[str]:
    from sandbox.measure.extremes.scenarios import AXES

    return _list_of(AXES, incomplete)


def _players(_ctx: click.Context, incomplete: str) -> Iterable[str]:
    return ["random", "skilled", "none", *_files(incomplete, (".json", ".txt"))]


def _tables(_ctx: click.Context, _incomplete: str) -> Iterable[str]:
    from sandbox.scene.files.json_schema import schema

    return list(schema()["properties"])


_WORDS: dict[str, Words] = {
    "scene": _scenes,
    "scenes": _scenes,
    "run": _runs,
    "level": _levels,
    "folder": _folders,
    "engine": _engines,
    "engines": _several_engines,
    "overrides": _keys,
    "sweeps": _keys,
    "sliders": _keys,
    "metric": _metrics,
    "axes": _axes,
    "player": _players,
    "table": _tables,
}
"""Completions by the name of a parameter."""
