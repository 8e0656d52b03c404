"""What numbers depend on beside their inputs: sources, libraries, the processor."""

import hashlib
import json
import platform
import secrets
import time
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version

from llvmlite import binding as llvm

from ..jit import PACKAGE

_COMPUTING = ("embreex", "llvmlite", "numba", "numpy", "scipy", "trimesh", "xarray")
_STARTED = time.time()
"""Sources changed after this moment may not be those that were imported."""


@cache
def state_of_the_code(without: tuple[str, ...] = ()) -> str:
    """Digest of the package's sources, of the libraries that compute, and the processor.

    Results made in another state may differ, in the last digits or altogether. ``without``
    names folders of the package on which what is made does not depend.
    """
    versions = {}
    for name in _COMPUTING:
        with suppress(PackageNotFoundError):
            versions[name] = version(name)
    digest = hashlib.sha256(
        json.dumps(
            [versions, platform.python_version(), platform.machine(), llvm.get_host_cpu_name()]
        ).encode()
    )
    for path in sorted(PACKAGE.rglob("*.py")):
        if path.relative_to(PACKAGE).parts[0] in without:
            continue
        digest.update(f"{path.relative_to(PACKAGE).as_posix()} {path.stat().st_size} ".encode())
        digest.update(path.read_bytes())
        if path.stat().st_mtime > _STARTED:  # not what was imported: nothing may be found by it
            digest.update(secrets.token_bytes(16))
    return digest.hexdigest()
