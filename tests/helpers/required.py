"""What a machine may lack, and CI may not."""

import os
from typing import NoReturn

import pytest


def cannot_run(variable: str, reason: str) -> NoReturn:
    """Skip, unless an environment variable says that here the test has to run."""
    if os.environ.get(variable):
        pytest.fail(reason)
    pytest.skip(reason)
