"""Fuzzing: generated inputs, run case by case in isolated processes with limits of time and memory.

A case is an importable function and one JSON value that it is called with:

    {"function": "tools.fuzzing.scene_cases:run_scene", "argument": {"text": "…"}, "about": "what once broke"}

A case file is one such JSON object; `python -m tools.fuzzing case FILE` runs it. `tests/hostile/corpus/*.json` are the
cases that once broke; `tests/hostile/test_corpus.py` runs each of them. A case passes where the function returns: it
returns the name of the error that refused the input, or None where nothing was refused. Everything else is a failure:
an exception that leaves the function, a violated check (`Violation`), a process that dies, and a case that exceeds its
limit of CPU time or memory.

A case of a scene (`tools.fuzzing.scene_cases:run_scene`) has these keys, of which only the first is required:

    text      the scene file
    actions   JSON actions, as in a recorded session
    runs      [{"engine", "steps", "public", "audit", "account"}, …]; default: every engine, 10 steps
    also      any of "check", "compare", "session", "recording", "resume", "rewind", "store", "game"
    times     {"1": 1000}: how often part 1 of a text is repeated; the text is then a list of its parts
"""
