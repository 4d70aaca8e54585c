"""Fuzz the program: generated inputs, run in isolated processes with limits on time and memory.

    python -m tools.fuzzing scenes --count 20000 --seed 1 --workers 2 --keep found
    python -m tools.fuzzing files --count 2000 --seed 1 --workers 2 --keep found
    python -m tools.fuzzing case found/*.json

Exit status: 0 no case failed; 1 a case failed; 2 wrong options; 130 interrupted.
"""

import argparse
import re
import signal
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

from tools.fuzzing.damaged_files import file_cases
from tools.fuzzing.isolated import Case, Failure, Limits, Outcome, run_cases
from tools.fuzzing.scene_mutants import scene_cases

SLOW = 5.0  # s of CPU time; slower cases are reported even within their limit


def main() -> int:
    """Run a command; return the exit status."""
    options = _parser().parse_args()
    limits = Limits(options.time_limit, options.memory_limit)
    if options.command == "case":
        cases: Iterator[Case] = map(Case.load, options.files)
    else:
        make_cases = {"scenes": scene_cases, "files": file_cases}[options.command]
        cases = make_cases(options.seed, options.count, options.first)
    summary = Summary()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        for case, outcome in run_cases(cases, limits, options.workers):
            summary.add(case, outcome)
            if summary.count % 500 == 0:
                print(summary.line(), file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        summary.report(options.keep)
        return 130
    summary.report(options.keep)
    return 1 if summary.failures else 0


class Summary:
    """Counts of outcomes, and failures grouped by location."""

    def __init__(self) -> None:
        self.count = 0
        self.failures: dict[str, Failure] = {}
        self._kinds: Counter[str] = Counter()
        self._cpu, self._start_time = 0.0, perf_counter()
        self._slow: list[tuple[float, Case]] = []

    def add(self, case: Case, outcome: Outcome) -> None:
        """Count one case."""
        self.count += 1
        self._kinds[outcome.kind] += 1
        self._cpu += outcome.cpu
        if outcome.cpu > SLOW:
            self._slow.append((outcome.cpu, case))
        if outcome.failed:
            known = self.failures.get(outcome.group)
            if known is None:
                print(f"{outcome.group}\n    {case.about}", file=sys.stderr, flush=True)
            self.failures[outcome.group] = (
                Failure(1, case, outcome) if known is None else known.joined_by(case, outcome)
            )

    def line(self) -> str:
        """Return the counts as one line."""
        kinds = ", ".join(f"{count} {kind}" for kind, count in sorted(self._kinds.items()))
        mean = self._cpu / max(self.count, 1)
        return f"{self.count} cases in {perf_counter() - self._start_time:.0f} s, {mean:.3f} s CPU each: {kinds}"

    def report(self, keep: Path | None) -> None:
        """Print the failures, most frequent first, and write the smallest case of each."""
        for number, (group, failure) in enumerate(sorted(self.failures.items(), key=lambda each: -each[1].count)):
            print(f"\n{failure.count}× {group}   ({failure.case.about})")
            print("    " + "\n    ".join(failure.outcome.detail.strip().splitlines()[-12:]))
            if keep is not None:
                keep.mkdir(parents=True, exist_ok=True)
                stem = re.sub(r"[^A-Za-z0-9]+", "-", group.partition(" in ")[0]).strip("-").lower()
                (keep / f"{number:03}-{stem[:80]}.json").write_text(failure.case.to_json(), encoding="utf-8")
        for seconds, case in sorted(self._slow, key=lambda each: -each[0])[:10]:
            print(f"slow: {seconds:.1f} s CPU, {case.about}")
        print(self.line())


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    scenes = commands.add_parser("scenes", help="mutants of the shipped scenes, with actions, on every engine")
    files = commands.add_parser("files", help="damaged files of every kind, through the commands that read them")
    for each in (scenes, files):
        each.add_argument("--count", type=int, default=1000, help="number of mutants or damaged files")
        each.add_argument("--seed", type=int, default=1)
        each.add_argument("--first", type=int, default=0, metavar="K", help="index of the first")
    case = commands.add_parser("case", help="case files, one after the other")
    case.add_argument("files", type=Path, nargs="+", metavar="FILE")
    for each in (scenes, files, case):
        each.add_argument("--workers", type=int, default=2, help="processes")
        each.add_argument("--time-limit", type=float, default=20.0, metavar="S", help="CPU time of one stage of a case")
        each.add_argument("--memory-limit", type=_bytes, default=4 * 2**30, metavar="SIZE", help="such as 4GiB")
        each.add_argument("--keep", type=Path, metavar="DIR", help="write the smallest case of each failure here")
    return parser


def _bytes(text: str) -> int:
    found = re.fullmatch(r"(\d+(?:\.\d+)?)\s*(KiB|MiB|GiB|B|)", text)
    if found is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 4GiB")
    return int(float(found[1]) * {"KiB": 2**10, "MiB": 2**20, "GiB": 2**30, "B": 1, "": 1}[found[2]])


if __name__ == "__main__":
    sys.exit(main())
