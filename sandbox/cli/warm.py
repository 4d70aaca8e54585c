"""Command `warm`: compile all kernels in advance."""

import click

from sandbox.cli.options import quiet_option
from sandbox.cli.progress import duration_text, progress_bars
from sandbox.engines.common.compile_clock import COMPILE_CLOCK


@click.command(name="warm")
@quiet_option("print no progress and no result")
def warm_command(quiet: bool) -> int:
    """Compile all functions of the hand-written engines and of the window now, so that no later command waits for it.

    Compiled functions are kept on disk until the package changes. Without numba there is nothing to compile.
    """
    from sandbox.engines.common.kernel import COMPILED, cache_folder

    if not COMPILED:
        click.echo("numba is not installed or switched off, so nothing is compiled: pip install -e '.[fast]'", err=True)
        return 1
    folder = cache_folder()
    if folder is None:
        click.echo("no folder for compiled functions can be written; XDG_CACHE_HOME names another one", err=True)
        return 1
    # They import numba and pygame
    from sandbox.measure.compare import compare
    from sandbox.window.warm_up import warm_up, warm_ups

    COMPILE_CLOCK.announces = False
    entries = warm_ups()
    with progress_bars(quiet) as bars:
        bar = bars.add("compiling", len(entries) + 1.0)
        for k, (scene, engine) in enumerate(entries.values()):
            bar.update(k, f"{engine}: {scene.title}")
            warm_up(scene, engine, None, lambda _: None)
        bar.update(len(entries), "the comparison of engines")
        compare("tutorial/bounce")  # also calls what measures errors and missed contacts
    if not quiet:
        seconds = COMPILE_CLOCK.seconds
        took = f"compiled in {duration_text(seconds)}" if seconds else "all functions were compiled before"
        click.echo(f"{took}; they are in {folder}")
    return 0
