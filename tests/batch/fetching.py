"""Running one job as the driver does: fetch its stored run, or run it and store the run."""

from collections.abc import Callable

from sandbox.batch.job import Job, RunOptions, RunRecord, fetch, run_job, store_run, with_earlier_audit
from sandbox.batch.store import Store

DEFAULT = RunOptions()


def run_or_fetch(
    job: Job, store: Store | None = None, options: RunOptions = DEFAULT, progress: Callable[[float], None] | None = None
) -> RunRecord:
    """Return the stored run of a job, or run the job and store the run."""
    found = None if store is None else fetch(job, store, options)
    if isinstance(found, RunRecord):
        return found
    completed = run_job(job, with_earlier_audit(job, store, options), progress)
    if store is None:
        return RunRecord.of(job, completed.stored, None, repeated=False, computed=completed.trajectory)
    return store_run(store, job, completed, found)
