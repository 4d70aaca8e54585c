"""Fuzzing: generated inputs, run one by one in isolated processes with limits on time and memory.

A case is an importable function and one JSON value, its argument:

    {"function": "tools.fuzzing.scene_cases:run_scene", "argument": {"text": "…"}, "about": "past failure"}

A case file is one such JSON object; `python -m tools.fuzzing case FILE` runs it. `tests/hostile/corpus/*.json` are
cases that failed once; `tests/hostile/test_corpus.py` runs each of them. A case passes if the function returns: the
name of the error that refused the input, or None if the input was accepted. Everything else is a failure: an
exception that leaves the function, a violated check (`Violation`), a process that dies, and a case beyond its limit of
CPU time or memory.

The argument of a scene case (`tools.fuzzing.scene_cases:run_scene`) has these keys; only the first is required:

    text      the scene file
    actions   JSON actions, as in a recorded session
    runs      [{"engine", "steps", "public", "audit", "account"}, …]; default: every engine, 10 steps
    also      any of "check", "compare", "session", "recording", "resume", "rewind", "store", "game"
    times     {"1": 1000}: number of repetitions of part 1 of the text, which is then a list of parts
"""
