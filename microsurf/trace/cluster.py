"""A cluster of dask.distributed as an Executor; the only file that knows it."""

import logging
import socket
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from urllib.parse import urlsplit

import numpy as np

from .. import __version__
from ..errors import InputError

WAIT = 5
"""Seconds to wait for a scheduler to answer, and for a first worker to be there."""

RETRIES = 3
"""How often a work item is done again that failed; one whose worker was lost is, in any case."""


@dataclass(frozen=True)
class WorkerPool:
    """Workers that take work items: an executor, and how many work items they do at once."""

    executor: Executor
    workers: int


def versions() -> tuple[str, str]:
    """What must be the same everywhere."""
    return __version__, np.__version__


@contextmanager
def connected(address: str) -> Iterator[WorkerPool]:
    """Have the workers of the scheduler at ``address`` (tcp://host:port).

    Raises
    ------
    InputError
        If dask is not installed, nobody answers there, there are no workers, or they
        have another microsurf or numpy.

    """
    try:
        from distributed import Client  # noqa: PLC0415 - an extra, may be absent
    except ImportError as error:
        raise InputError(
            f"--scheduler {address}: needs dask.distributed; "
            'install it with pip install "microsurf[cluster]"'
        ) from error
    # It logs each lost connection with a traceback; what matters comes back as an error.
    for name in list(logging.root.manager.loggerDict):
        if name.startswith("distributed"):
            logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        # At once where nobody listens; a Client would try again and again.
        url = urlsplit(address)
        socket.create_connection((url.hostname or "", url.port or 0), timeout=WAIT).close()
        client = Client(address, timeout=WAIT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"--scheduler {address}: no scheduler answers there ({_first_line(error)}); "
            "start one with `dask scheduler`, its address is like tcp://host:8786"
        ) from error
    with client:
        try:
            client.wait_for_workers(1, timeout=WAIT)
        except TimeoutError as error:
            raise InputError(
                f"--scheduler {address}: it has no workers; "
                f"start some with `dask worker {address} --nthreads 1`"
            ) from error
        _check_versions(address, client.run(versions, on_error="return"))
        executor = client.get_executor(pure=False, retries=RETRIES)
        yield WorkerPool(executor, sum(client.nthreads().values()))


def _check_versions(address: str, by_worker: dict[str, object]) -> None:
    here = versions()
    for worker, there in by_worker.items():
        if there != here:
            has = there if isinstance(there, Exception) else "microsurf {}, numpy {}".format(*there)  # type: ignore[misc]
            raise InputError(
                f"--scheduler {address}: worker {worker} does not have the same software "
                f"({has}); here are microsurf {here[0]}, numpy {here[1]}: install these there"
            )


def _first_line(error: Exception) -> str:
    return (str(error) or type(error).__name__).splitlines()[0]
