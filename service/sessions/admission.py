"""Whether one more stream may begin, by the load that is measured.

Model: a new stream is refused where the event loop is busy, or would be if hands moved all live streams, or where
    blocks are late. So those that were admitted keep their blocks. The load of a new stream shows after
    PROVEN_SECONDS; until then it counts as unproven. MANY may be at a time while the loop has room, one in ONE_IN
    from half of the bounds on; the others wait for their turn.
Limits: per process. Streams that are under way are never ended; a stream that becomes heavier may make all late.
"""

from __future__ import annotations

from asyncio import sleep

from service.operations.load_meter import LoadMeter
from service.problems import Problem

FEW = 4  # streams of a process that begin whatever the load
MANY = 32  # unproven streams at a time where there is room: usual ones take a third of a processor
PROVEN_SECONDS = 0.5  # half of the window of the measurement: by then the mean lateness has risen
ONE_IN = 32  # streams under way per unproven one where there is little room; FEW at least
LATE_SECONDS = 0.02  # mean lateness: two blocks of the usual length; a process with room has less than 1 ms
TURN_SECONDS = 5.0  # of waiting for a turn
LOOK_SECONDS = 0.05  # between two looks while a stream waits
RETRY_SECONDS = 5


async def stream_admitted(load: LoadMeter, full_at: float) -> None:
    """Return once another stream may begin.

    full_at: part of a second in which the event loop may be busy; 1: streams are admitted whatever the load.
    Raises Problem (full) where the process is at its capacity, and where too many streams begin at a time.
    """
    if full_at < 1.0:
        waited = 0.0
        while load.begun(PROVEN_SECONDS) >= _unproven(load, full_at):
            if waited >= TURN_SECONDS:
                raise _full("More streams begin than the service can measure.", 1)
            await sleep(LOOK_SECONDS)
            waited += LOOK_SECONDS
        if load.streams >= FEW and (load.expected > full_at or load.late > LATE_SECONDS):
            raise _full(_measured(load, full_at), RETRY_SECONDS)
    load.begins()


def _unproven(load: LoadMeter, full_at: float) -> int:
    """Return how many streams may be unproven."""
    if load.busy < 0.5 * full_at and load.late < 0.5 * LATE_SECONDS:
        return MANY
    return max(FEW, load.streams // ONE_IN)


def _measured(load: LoadMeter, full_at: float) -> str:
    """Return what was measured, and what to change."""
    busy = f"{100.0 * load.busy:.0f} % of the time"
    if load.expected > full_at:
        cause = f"was busy for {busy}"
        if load.busy <= full_at:
            cause += f", which would be {100.0 * load.expected:.0f} % if hands moved its {load.resting} resting streams"
        cause += f" (RIDGEWAVE_FULL_AT: {100.0 * full_at:.0f} %)"
        mend = "End other streams, ask for longer blocks, or run more workers."
    else:
        cause = f"was busy for {busy} only, but its blocks were {1e3 * load.late:.0f} ms late"
        cause += f" (allowed: {1e3 * LATE_SECONDS:.0f} ms)"
        mend = "Other work on this machine takes its processors: end it, or give the service a machine of its own."
    begin = f"This process is at its capacity with {load.streams} streams: in the last second its event loop "
    return f"{begin}{cause}. {mend}"


def _full(detail: str, seconds: int) -> Problem:
    return Problem("full", detail, headers={"Retry-After": str(seconds)})
