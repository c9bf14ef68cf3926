"""Resources of processes, from Linux's /proc: processor time, resident memory and open files, with all children."""

from __future__ import annotations

import os
from pathlib import Path

TICK = 1.0 / os.sysconf("SC_CLK_TCK")  # s
PAGE = os.sysconf("SC_PAGE_SIZE")  # bytes
USER_TIME, SYSTEM_TIME = 11, 12  # fields of /proc/PID/stat after the name of the program (proc(5): 14 and 15)


def family(pid: int) -> list[int]:
    """Return `pid` and all its running descendants."""
    try:
        tasks = list(Path(f"/proc/{pid}/task").iterdir())
        started = [int(word) for task in tasks for word in (task / "children").read_text().split()]
    except (FileNotFoundError, ProcessLookupError):
        return []
    return [pid, *(member for child in started for member in family(child))]


def processor_seconds(pid: int) -> float:
    """Return the processor time (s) of one process so far; 0 if it has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return 0.0
    return TICK * (int(fields[USER_TIME]) + int(fields[SYSTEM_TIME]))


def resident_bytes(pid: int) -> int:
    """Return the memory of one process that is in RAM."""
    return PAGE * int(Path(f"/proc/{pid}/statm").read_text().split()[1])


def open_files(pid: int) -> int:
    """Return the number of file descriptors of a process."""
    return len(os.listdir(f"/proc/{pid}/fd"))
