"""What the tests of the invariants share."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from microsurf.trace import work_items
from microsurf.trace.engine import AUTO


@pytest.fixture(scope="session")
def pool():
    """Threads for independent runs."""
    work_items.compiled(AUTO)
    with ThreadPoolExecutor(2) as threads:
        yield threads
