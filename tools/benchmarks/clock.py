"""The two clocks of the rows."""

import time

cpu_time = time.process_time
"""s, processor time of this process: the clock of rows with one thread, because other work on the machine disturbs it
less than wall time"""

wall_time = time.perf_counter
"""s, the clock of rows with several threads or processes"""
