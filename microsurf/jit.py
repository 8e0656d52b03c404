"""How kernels are compiled, and kept on disk until a source that they depend on changes.

numba's own cache looks at the kernel's file alone, though constants and functions of
other modules are frozen into the machine code; it writes its index before its data, so
that a second process may run code of the old source; and a damaged file, or a home that
can't be written, ends the program. Here a file holds one compiled signature, with a
digest of the sources it was made from and one of its own bytes. What does not fit is made
anew, and what can't be written is not kept. All that numba keys on (signature, processor,
Python's and numba's version, the function's bytecode and closure) is in the key too.

Processes that need the same kernel at the same time compile it once: one does, the others
wait for its file.
"""

import ast
import hashlib
import logging
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from typing import Any

from numba import __version__ as numba_version
from numba import njit
from numba.core import caching, serialize

from .files import whole_file

try:
    import fcntl
except ImportError:  # Windows: there processes compile side by side what they need
    fcntl = None  # type: ignore[assignment]

PACKAGE = Path(__file__).resolve().parent

_STARTED = time.time()
"""Sources changed after this moment may not be those that were imported."""

_said: list[str] = []

_DIGEST = 32
"""Bytes of a SHA-256."""

_TURNS = "compiling.lock"
"""A file beside the kernels: who compiles one locks a byte of it, at most until its end."""
_PATIENCE, _POLL = 60.0, 0.02
"""Seconds to wait for another process's kernel before compiling it too, and between two looks."""

_turns: dict[Path, int] = {}


class KernelCache(caching.FunctionCache):
    """numba's cache of one function, with files that are believed only with proof."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Find compiled code of a signature; None if there is none, or none to believe."""
        target_context.refresh()
        stamp = _stamp(self._source)
        if stamp is None or not self._enabled:
            return None
        key = self._index_key(sig, target_context.codegen())
        code = self._read(stamp, key, target_context)
        if code is None and self._waited(key):
            code = self._read(stamp, key, target_context)
            if code is not None:
                self._let_go(key)
        return code

    def _read(self, stamp: bytes, key: Any, target_context: Any) -> Any:
        # Whatever is wrong with a file, the code can be compiled again.
        with suppress(Exception):
            data = self._path(key).read_bytes()
            proof, payload = data[: 2 * _DIGEST], data[2 * _DIGEST :]
            if proof == stamp + hashlib.sha256(payload).digest():
                stored, reduced = serialize.loads(payload)
                if stored == key:
                    return self._impl.rebuild(target_context, reduced)
        return None

    def _waited(self, key: Any) -> bool:
        """Wait until no other process compiles it, and have its turn; whether there are turns."""
        until = time.monotonic() + _PATIENCE
        with suppress(OSError):  # a folder that can't be written, a file system without locks
            self._impl.locator.ensure_cache_path()
            while not self._locked(key, take=True):
                if time.monotonic() > until:
                    return False
                time.sleep(_POLL)
            return True
        return False

    def _let_go(self, key: Any) -> None:
        with suppress(OSError):
            self._locked(key, take=False)

    def _locked(self, key: Any, *, take: bool) -> bool:
        """Take a kernel's turn, if no other process has it, or let go of it."""
        if fcntl is None:
            return True
        path = Path(self._cache_path) / _TURNS
        if path not in _turns:
            _turns[path] = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        position = int(self._path(key).stem[-7:], 16)
        kind = fcntl.LOCK_EX | fcntl.LOCK_NB if take else fcntl.LOCK_UN
        try:
            fcntl.lockf(_turns[path], kind, 1, position)
        except (BlockingIOError, PermissionError):  # what systems say of another's lock
            return False
        return True

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep compiled code of a signature, if there is a place for it."""
        stamp = _stamp(self._source)
        if stamp is None or not self._enabled or not self._impl.check_cachable(data):
            return
        key = self._index_key(sig, data.codegen)
        payload = serialize.dumps((key, self._impl.reduce(data)))
        try:
            self._impl.locator.ensure_cache_path()
            with whole_file(self._path(key)) as temporary:
                temporary.write_bytes(stamp + hashlib.sha256(payload).digest() + payload)
        except Exception as error:  # noqa: BLE001 - a full disk is no reason not to go on
            _say_not_kept(str(error))
        finally:
            self._let_go(key)

    def flush(self) -> None:
        """Throw away what was kept of this function."""
        for path in Path(self._cache_path).glob(f"{self._stem}-*.nbc"):
            path.unlink(missing_ok=True)

    @property
    def _source(self) -> Path:
        return Path(self._py_func.__code__.co_filename)

    @property
    def _stem(self) -> str:
        name = f"{self._source.stem}.{self._py_func.__qualname__}"
        return name.replace("<", "").replace(">", "")

    def _path(self, key: Any) -> Path:
        """One file for each signature and machine: a new source overwrites the old code."""
        kind = (repr(key), sys.version, numba_version)
        digest = hashlib.sha256(repr(kind).encode()).hexdigest()[:16]
        return Path(self._cache_path) / f"{self._stem}-{digest}.nbc"


@cache
def _stamp(source: Path) -> bytes | None:
    """Digest of all that a kernel of this file may freeze; None if it can't be known."""
    digest = hashlib.sha256(numba_version.encode())
    try:
        for path in sorted(sources_of(source)):
            if path.stat().st_mtime > _STARTED:
                _say_not_kept(f"{path} is newer than this run; look at its date")
                return None
            digest.update(f"{path.name} {path.stat().st_size} ".encode())
            digest.update(path.read_bytes())
    except (OSError, ValueError, SyntaxError):
        return None
    return digest.digest()


def sources_of(file: Path) -> frozenset[Path]:
    """Find a file of the package and all of the package that it imports, however far.

    Raises
    ------
    OSError, SyntaxError
        If a source can't be read.
    ValueError
        If the file is not of the package.

    """
    waiting, sources = [file.resolve()], set[Path]()
    while waiting:
        path = waiting.pop()
        if path not in sources:
            sources.add(path)
            waiting += _imported(path)
    return frozenset(sources)


@cache
def _imported(file: Path) -> tuple[Path, ...]:
    here = file.relative_to(PACKAGE).parent.parts
    tree = ast.parse(file.read_bytes())
    return tuple(
        path
        for node in ast.walk(tree)
        for name in _names(node, here)
        if (path := _file(name)) is not None
    )


def _names(node: ast.AST, here: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """What a statement imports of the package, each name as its parts below the package."""
    if isinstance(node, ast.Import):
        for alias in node.names:
            first, *rest = alias.name.split(".")
            if first == PACKAGE.name:
                yield tuple(rest)
    elif isinstance(node, ast.ImportFrom):
        stem = tuple(node.module.split(".")) if node.module else ()
        if node.level:
            base = (*here[: len(here) - node.level + 1], *stem)
        elif stem[0] == PACKAGE.name:
            base = stem[1:]
        else:
            return
        for alias in node.names:
            yield (*base, alias.name)


def _file(name: tuple[str, ...]) -> Path | None:
    """The file of a module, or that of the module which holds the name."""
    for parts in (name, name[:-1]):
        path = PACKAGE.joinpath(*parts)
        if parts and path.with_suffix(".py").is_file():
            return path.with_suffix(".py")
        if (path / "__init__.py").is_file():
            return path / "__init__.py"
    return None


def _say_not_kept(why: str) -> None:
    """Say once why the next run will have to compile again."""
    if _said:
        return
    _said.append(why)
    logging.getLogger(__name__).warning(
        "microsurf: compiled code is not kept, so each run compiles for a minute or two: %s",
        " ".join(why.split()),
    )


def _kernel(function: Callable[..., Any], **options: Any) -> Any:
    dispatcher = njit(nogil=True, error_model="numpy", **options)(function)
    if hasattr(dispatcher, "enable_caching"):  # a plain function under NUMBA_DISABLE_JIT
        try:
            dispatcher._cache = KernelCache(function)  # noqa: SLF001 - as its enable_caching does
        except (RuntimeError, OSError):  # no folder for it anywhere
            dispatcher._cache = _Nowhere()  # noqa: SLF001
    return dispatcher


class _Nowhere(caching.NullCache):
    """No folder can be written: nothing is kept, and that is said where it costs time."""

    def save_overload(self, sig: Any, cres: Any) -> None:
        """Keep nothing."""
        del sig, cres
        _say_not_kept("no folder for it can be written; set NUMBA_CACHE_DIR to one that can")


compiled = partial(_kernel, _nrt=False)
"""A loop of the tracer, or what is called from several places.

Without the interpreter's lock, with numpy's division, and without counting references:
these functions make no arrays, they only read and write those that they are given in
tuples. Counting references to them, an atomic step up and down at each call, took half
of the time.
"""

inlined = partial(_kernel, _nrt=False, forceinline=True)
"""Part of a loop, written apart to be read apart: passing its tuples took a quarter of the time.

Inlined by LLVM: by numba (``inline="always"``) the machine code is as fast and has the same
bits, but its types are sought anew at each call, and the two engines took twice as long to compile.
"""

force_inlined = partial(_kernel, forceinline=True)
"""A walk, or part of one. Inlined by LLVM, walks need not count references to tables."""
