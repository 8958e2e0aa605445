"""Which processes live, and what pieces have noted of themselves; for the tests of pool, cluster and interrupts."""

import time
from pathlib import Path

SOON = 60.0  # s, far more than anything here takes


def is_there(pid):
    """Whether a process lives, or a thread of it: only without any can its parent know that it ended."""
    try:
        ended = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
        return not ended or len(list(Path(f"/proc/{pid}/task").iterdir())) > 1
    except OSError:
        return False


def soon(question):
    """Whether something holds before long."""
    until = time.monotonic() + SOON
    while time.monotonic() < until:
        if question():
            return True
        time.sleep(0.01)
    return False


def gone_soon(*pids):
    return soon(lambda: not any(map(is_there, pids)))


def notes(folder, count=1):
    """What pieces have noted, as soon as this number of them have."""
    assert soon(lambda: sum(bool(note.read_text()) for note in Path(folder).iterdir()) >= count)
    return [note.read_text().split() for note in sorted(Path(folder).iterdir())]
