import os
import signal
import time
from typing import Any

import pytest

from biogrip.command.files import side_by_side


def test_results_come_in_order_and_of_what_was_killed_none() -> None:
    def work(job: int) -> Any:
        time.sleep(0.05 * (job % 3 == 0))
        if job == 2:
            os.kill(os.getpid(), signal.SIGKILL)
        return job, os.getpid(), bytes(1_000_000)

    found = [*side_by_side(work, range(6), 3)]
    assert [it and it[0] for it in found] == [0, 1, None, 3, 4, 5]
    assert len({it[1] for it in found if it} | {os.getpid()}) == 6
    assert [*side_by_side(work, [], 3)] == []


def test_an_error_is_raised_and_nothing_waits_for_ever() -> None:
    def work(job: int) -> bytes:
        if job == 1:
            raise ValueError("of job 1")
        return bytes(10_000_000)

    with pytest.raises(ValueError, match="of job 1"):
        list(side_by_side(work, range(5), 2))
