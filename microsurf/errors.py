"""The errors a user sees: one line that names the value, what is allowed and what to do."""


class MicrosurfError(Exception):
    """Something could not be finished; what was finished is kept. Exit code 3."""

    exit_code = 3


class InputError(MicrosurfError, ValueError):
    """What was asked for makes no sense. Exit code 2."""

    exit_code = 2
