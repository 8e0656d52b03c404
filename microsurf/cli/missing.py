"""What to install if a package that microsurf needs is absent; loads only what Python brings."""

import re
from importlib.metadata import PackageNotFoundError, requires

_MODULES = {"PIL": "pillow"}
"""Modules that are not called as their package is."""


def sentence(error: ImportError) -> str | None:
    """Name the package of a missing module and its installation; None if it is none or ours."""
    # Packages that look for others say so in words of their own.
    said = re.match(r"No module named '([\w.]+)'", str(error))
    absent = error.name if isinstance(error, ModuleNotFoundError) else said and said[1]
    module = (absent or "").partition(".")[0]
    if module in ("", "microsurf"):
        return None
    wanted = _requirement(_MODULES.get(module, module))
    return f'needs {module}, which is not installed; do `pip install "{wanted}"`'


def _requirement(package: str) -> str:
    """Give a package with the versions that microsurf takes, as far as it asks for it itself."""
    try:
        requirements = requires("microsurf") or []
    except PackageNotFoundError:
        requirements = []
    for line in requirements:
        name = re.match(r"[\w.-]+", line)
        if name and _plain(name[0]) == _plain(package):
            return line.partition(";")[0].strip()
    return package


def _plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
