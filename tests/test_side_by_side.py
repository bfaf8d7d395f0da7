import os
import signal
import time
from typing import Any

import pytest

from biogrip.command.files import side_by_side


def work_or_die(job: int) -> Any:
    time.sleep(0.5 * (job >= 2))
    if job == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return job, os.getpid(), bytes(1_000_000)


def work_or_fail(job: int) -> bytes:
    if job == 1:
        raise ValueError("of job 1")
    return bytes(10_000_000)


def test_results_come_in_order_until_a_process_is_killed() -> None:
    found = [*side_by_side(work_or_die, range(6), 1)]
    assert [it and it[0] for it in found] == [0, 1, None, None, None, None]
    assert os.getpid() not in {it[1] for it in found if it}
    assert [it and it[0] for it in side_by_side(work_or_die, [3, 1, 0], 3)] == [3, 1, 0]
    assert [*side_by_side(work_or_die, [], 3)] == []


def test_an_error_is_raised_and_nothing_waits_for_ever() -> None:
    with pytest.raises(ValueError, match="of job 1"):
        list(side_by_side(work_or_fail, range(5), 2))
