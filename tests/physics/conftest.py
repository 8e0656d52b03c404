"""What the tests of the laws share."""

from hypothesis import settings

# The machines that run the tests are busy: how long an example takes says nothing.
settings.register_profile("physics", deadline=None)
settings.load_profile("physics")
