"""Confinement: what a process may use, and why one died."""

import signal
import sys

MEBIBYTE = 2**20


def limit_memory(mebibytes: int) -> None:
    """Let this process have so much address space, and write no core when it dies; nothing where a system cannot."""
    if sys.platform == "win32":
        return
    import resource

    _, most = resource.getrlimit(resource.RLIMIT_AS)
    wanted = mebibytes * MEBIBYTE
    resource.setrlimit(resource.RLIMIT_AS, (wanted if most == resource.RLIM_INFINITY else min(wanted, most), most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def allow_processor(seconds: float) -> None:
    """Let this process compute for so long from now on; beyond, the system ends it.

    The wall clock is whoever's who waits; this is for a process that nobody waits for any more.
    """
    if sys.platform == "win32":
        return
    import resource

    used = resource.getrusage(resource.RUSAGE_SELF)
    _, most = resource.getrlimit(resource.RLIMIT_CPU)
    wanted = int(used.ru_utime + used.ru_stime + seconds) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (wanted if most == resource.RLIM_INFINITY else min(wanted, most), most))


def cause_of_death(status: int) -> str:
    """Say how a process ended, by its return code: a signal by its name, or the exit status."""
    if status >= 0:
        return f"the process ended with status {status}"
    try:
        name = signal.Signals(-status).name
    except ValueError:
        name = f"signal {-status}"
    return f"the process was killed by {name}"
