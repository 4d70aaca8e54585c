"""Examples in the documentation: parses the fenced blocks of a Markdown page and runs them.

The blocks of a page run in order in one initially empty folder:

- `python`: executed in one namespace per page. A `text` block right after it is the expected output.
- `console`: lines that begin with `$ ` are commands, the lines below each are its output. Without such lines the output
  must be empty.
- `sh`: one command per line. They must succeed; their output is not compared.
- `toml`: a scene or a part of one; it must not have unknown keys.
- other blocks (`text`, `json` …) are not run.

In outputs `…` or `...` stands for any text within a line, at the end of a line also for none; alone on a line it stands
for any lines. White space within a line counts as one space. A command that fails is marked with its status: `$ sandbox
run bad.toml  # exits with 2`. `sandbox play` and `sandbox replay` are parsed, not run.

An HTML comment on the line above a block changes its treatment:

- `<!-- file: game.py -->`: the block is written to this file; a scene in it must load.
- `<!-- faulty file: bad.toml -->`: the block is written to this file, which has faults on purpose.
- `<!-- slow -->`: the page takes longer than about 20 s, so its test is marked slow.
- `<!-- not run: REASON -->`: the block is not run, for example because it needs a display, another machine or minutes.
"""

import contextlib
import io
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import click
from markdown_it import MarkdownIt

import sandbox
from sandbox.cli.main import cli

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md")))
WINDOWS = ("play", "replay")
EXIT = re.compile(r"\s+# exits with (\d+)$")
BY_TIME = re.compile(r"^(compiling .*|[\d,]+ of [\d,]+ runs done; .*)\n", re.MULTILINE)
"""Lines that depend on time: at the first compilation of kernels, and every ten seconds of a command."""


@dataclass(frozen=True)
class Example:
    """A fenced block."""

    page: Path
    line: int
    language: str
    text: str
    file: str | None
    """name of the file that the block is written to"""
    faulty: bool
    """whether that file has faults on purpose"""
    slow: bool
    skipped: bool
    output: str | None
    """expected output of a `python` block, if given"""

    @property
    def location(self) -> str:
        """Page and line number."""
        page = self.page.relative_to(ROOT) if self.page.is_relative_to(ROOT) else self.page
        return f"{page}:{self.line}"


def examples(page: Path) -> list[Example]:
    """Return the fenced blocks of a page."""
    tokens = MarkdownIt().parse(page.read_text(encoding="utf-8"))
    found: list[Example] = []
    comment = ""
    for previous, token in pairwise([None, *tokens]):
        if token.type == "html_block":
            comment = token.content
            continue
        if token.type != "fence":
            if token.type not in ("list_item_open", "paragraph_close"):
                comment = ""
            continue
        language = token.info.strip()
        if language.startswith("{code-block}"):
            language = language.removeprefix("{code-block}").strip()
        if language == "text" and _is_python(previous):
            before = found.pop()
            found.append(replace(before, output=token.content))
            continue
        file_comment = re.search(r"<!-- (?:faulty )?file: (\S+) -->", comment)
        line = (token.map or [0])[0] + 1
        found.append(
            Example(
                page,
                line,
                language,
                token.content,
                file_comment[1] if file_comment else None,
                "<!-- faulty" in comment,
                "<!-- slow -->" in comment,
                "<!-- not run:" in comment,
                None,
            )
        )
        comment = ""
    return found


def processes(page: Path) -> int:
    """Return the number of commands of a page that run in child processes."""
    lines = [
        line.removeprefix("$ ")
        for example in examples(page)
        if not example.skipped and example.file is None and example.language in ("console", "sh")
        for line in example.text.replace("\\\n", " ").splitlines()
        if example.language == "sh" or line.startswith("$ ")
    ]
    windows = {("sandbox", name) for name in WINDOWS}
    return sum(bool(line.strip()) and tuple(line.split()[:2]) not in windows for line in lines)


def _is_python(token: Any) -> bool:
    return token is not None and token.type == "fence" and token.info.strip() == "python"


def run_page(page: Path, folder: Path) -> Iterator[str]:
    """Run the examples of a page in an empty folder; yield a message for each failure."""
    namespace: dict[str, Any] = {"__name__": "__main__"}
    for example in examples(page):
        if example.skipped:
            continue
        if example.file is not None:
            target = folder / example.file
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(example.text, encoding="utf-8")
            if target.suffix == ".toml" and "[[ball]" in example.text and not example.faulty:
                yield from _unknown_keys(example)
            continue
        match example.language:
            case "python":
                yield from _python(example, namespace, folder)
            case "console":
                yield from _console(example, folder)
            case "sh":
                for line in example.text.replace("\\\n", " ").splitlines():
                    yield from _command(example, line, None, folder)
            case "toml":
                yield from _unknown_keys(example)


def _python(example: Example, namespace: dict[str, Any], folder: Path) -> Iterator[str]:
    """Execute a block in this process, since later blocks may use its objects."""
    printed = io.StringIO()
    try:
        with contextlib.chdir(folder), contextlib.redirect_stdout(printed):
            exec(compile("\n" * example.line + example.text, str(example.page), "exec"), namespace)
    except Exception as error:  # noqa: BLE001, any exception of an example is reported
        yield f"{example.location}: {type(error).__name__}: {error}"
        return
    if example.output is not None and not _same(example.output, printed.getvalue()):
        yield f"{example.location}: expected\n{example.output}\nprinted\n{printed.getvalue()}"


def _console(example: Example, folder: Path) -> Iterator[str]:
    command, output = None, ""
    for line in [*example.text.replace("\\\n", " ").splitlines(), "$ "]:
        if not line.startswith("$ "):
            output += line + "\n"
            continue
        if command is not None:
            yield from _command(example, command, output, folder)
        command, output = line[2:], ""


def _command(example: Example, line: str, output: str | None, folder: Path) -> Iterator[str]:
    """Run a command with `sh`."""
    if not line.strip() or line.lstrip().startswith("#"):
        return
    exit_comment = EXIT.search(line)
    status = int(exit_comment[1]) if exit_comment else 0
    words = shlex.split(line, comments=True)
    if len(words) > 1 and words[0] == "sandbox" and words[1] in WINDOWS:
        yield from _parsed(example, words[1:])
        return
    environment = {
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "COLUMNS": "120",
        "SDL_VIDEODRIVER": "dummy",
    }
    done = subprocess.run(
        ["sh", "-ec", line],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=280,
    )
    if done.returncode != status:
        yield f"{example.location}: {line}\nexited with {done.returncode}, not {status}\n{done.stderr[-2000:]}"
    elif output is not None and not _same(output, printed := done.stdout + BY_TIME.sub("", done.stderr)):
        yield f"{example.location}: {line}\nexpected\n{output}\nprinted\n{printed}"


def _parsed(example: Example, words: list[str]) -> Iterator[str]:
    context = click.Context(cli)
    command = cli.get_command(context, words[0])
    try:
        command.make_context(words[0], words[1:])
    except click.UsageError as error:
        yield f"{example.location}: {' '.join(words)}: {error.format_message()}"


def _same(expected: str, printed: str) -> bool:
    """Compare an output line by line, so that a row which the page lacks is found."""
    pattern = "".join(map(_line_pattern, expected.replace("…", "...").strip().splitlines()))
    text = "".join(f"{' '.join(line.split())}\n" for line in printed.strip().splitlines())
    return re.fullmatch(pattern, text) is not None


def _line_pattern(line: str) -> str:
    """Return the regular expression of a line of an output, with its end."""
    words = " ".join(line.split())
    if words == "...":
        return r"(?:.*\n)*?"
    parts = map(re.escape, re.sub(r" ?\.\.\.$", "...", words).split("..."))
    return ".*".join(parts) + r"\n"


def _unknown_keys(example: Example) -> Iterator[str]:
    """Yield the unknown keys of a scene or of a part of one."""
    try:
        sandbox.loads(example.text, example.location)
    except sandbox.SceneError as error:
        for fault in error.faults:
            if "unknown key" in fault.message or fault.line is None or example.file is not None:
                yield str(fault)
