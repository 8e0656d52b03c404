"""What all tests share."""

import mpmath
import pytest
from hypothesis import settings

# The machine is busy: how long one example takes says nothing about the law.
settings.register_profile("microsurf", deadline=None)
settings.load_profile("microsurf")


@pytest.fixture(autouse=True)
def _sixty_digits():
    """mpmath's precision is global: what one test sets must not reach the next."""
    with mpmath.workdps(60):
        yield
