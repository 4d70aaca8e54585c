"""Notes what child processes of tests execute: imported at the start of Python by a `.pth` file, see `contexts`."""

import atexit
import contextlib
import os

if "MUTATION_CONTEXTS" in os.environ and "PYTEST_CURRENT_TEST" in os.environ:
    from tools.mutation import contexts

    @atexit.register
    def _record() -> None:
        with contextlib.suppress(OSError):  # tests of a full disk allow no process to write
            contexts.record(os.environ["PYTEST_CURRENT_TEST"].rsplit(" ", 1)[0], 0.0, 0.0)
