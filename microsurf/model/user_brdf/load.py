"""Find a user BRDF by what stands on the command line: `load`."""

import contextlib
import importlib
import inspect
import operator
import sys
from pathlib import Path

from ...errors import InputError
from .brdf import UserBrdf
from .mitsuba_named import PREFIX, load_mitsuba
from .table import read_table

_LINE = 200


def load(name: str) -> UserBrdf:
    """Find a user BRDF: ``package.module:callable``, ``mitsuba:PLUGIN,…`` or the name of a table.

    A table's name ends in .csv. Modules are looked for in the current folder too.

    Raises
    ------
    InputError
        If there is none, or it is not callable.

    """
    if name.startswith(PREFIX):
        return load_mitsuba(name)
    if name.lower().endswith(".csv"):
        table = read_table(Path(name))
        return UserBrdf(name, table, table=table)
    module, colon, attribute = name.partition(":")
    if not (module and colon and attribute):
        raise InputError(
            f"--model {name}: must be package.module:callable, a table FILE.csv of f, "
            "or mitsuba:PLUGIN,KEY=VALUE,…"
        )
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        with contextlib.redirect_stdout(sys.stderr):
            function = operator.attrgetter(attribute)(importlib.import_module(module))
    except AttributeError as error:
        raise InputError(f"--model {name}: {error}; name a callable of that module") from error
    except (Exception, SystemExit) as error:
        raise InputError(
            f"--model {name}: can't be imported ({type(error).__name__}: {str(error)[:_LINE]}); "
            "give package.module:callable, seen from here or installed"
        ) from error
    if not callable(function) or inspect.isclass(function):
        raise InputError(
            f"--model {name}: is a {type(function).__name__}; must be a callable f(i, o)"
        )
    try:
        takes_scene = "scene" in inspect.signature(function).parameters
    except (TypeError, ValueError):  # compiled without a signature
        takes_scene = False
    return UserBrdf(name, function, takes_scene)
