"""Ctrl-C ends a command within two seconds, whatever it is at.

Python raises KeyboardInterrupt between two steps of its own: not in the middle of sorting
the facets of a large surface, nor while Embree takes a mesh, which lasts many seconds and
holds the interpreter's lock against all other threads. So machine code receives the
signal: it passes it on to Python, which has a second to clean up, and then removes
what is half written and ends the process; so it does where Python raises in a place that swallows
exceptions. Windows has no such alarm; there Python's own way stays.
"""

import atexit
import ctypes
import os
import signal
import sys

from llvmlite import binding as llvm

from ..files import PLACE, PLACES, UNFINISHED

_TEXT = ctypes.create_string_buffer(b"microsurf: interrupted\n")

_CLEAN_UP = "".join(
    f"call i32 @unlink(i64 {ctypes.addressof(UNFINISHED) + number * PLACE})\n"
    for number in range(PLACES)
)

# Nothing is called here but what a signal's handler may call. A second press finds the
# alarm running.
_HANDLERS = f"""
declare i64 @write(i32, i64, i64)
declare void @_exit(i32)
declare i32 @alarm(i32)
declare i32 @PyErr_SetInterruptEx(i32)
declare i32 @unlink(i64)

define void @quiet(i32 %number) {{
    {_CLEAN_UP}
    call void @_exit(i32 130)
    ret void
}}

define void @loud(i32 %number) {{
    {_CLEAN_UP}
    call i64 @write(i32 2, i64 {ctypes.addressof(_TEXT)}, i64 {len(_TEXT) - 1})
    call void @_exit(i32 130)
    ret void
}}

define void @pressed(i32 %number) {{
    %left = call i32 @alarm(i32 1)
    %again = icmp ne i32 %left, 0
    br i1 %again, label %second, label %first
second:
    call void @loud(i32 %number)
    br label %first
first:
    call i32 @PyErr_SetInterruptEx(i32 2)
    ret void
}}
"""

_ON_PARENTS_END = 1  # PR_SET_PDEATHSIG of prctl
_engines: list[llvm.ExecutionEngine] = []


def arm() -> None:
    """Have machine code receive Ctrl-C from now on; who ignores it goes on ignoring it."""
    if sys.platform == "win32" or signal.getsignal(signal.SIGINT) != signal.default_int_handler:
        return
    _build()
    _handle(signal.SIGALRM, "loud")
    _handle(signal.SIGINT, "pressed")
    signal.siginterrupt(signal.SIGINT, True)
    sys.unraisablehook = _unraisable


def serve(parent: int) -> None:
    """In a process of Linux that works for a command: end with it, and not by Ctrl-C itself.

    The command ends it by SIGTERM, and so does the system when the command is gone.
    """
    _build()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _handle(signal.SIGTERM, "quiet")
    ctypes.CDLL(None).prctl(_ON_PARENTS_END, signal.SIGTERM)
    if os.getppid() != parent:  # gone before the system knew
        os._exit(130)


def _build() -> None:
    """Compile the handlers, once."""
    if not _engines:
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        machine = llvm.Target.from_default_triple().create_target_machine()
        _engines.append(llvm.create_mcjit_compiler(llvm.parse_assembly(_HANDLERS), machine))
        _engines[0].finalize_object()
        for used in (
            _engines[0],
            _TEXT,
            UNFINISHED,
        ):  # for ever: the signal may come as Python ends
            ctypes.pythonapi.Py_IncRef(ctypes.py_object(used))
        atexit.register(_ignore)


def disarm() -> None:
    """Leave Ctrl-C to Python again, if it was not pressed."""
    if _engines and signal.getitimer(signal.ITIMER_REAL)[0] == 0:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.unraisablehook = sys.__unraisablehook__


def end() -> None:
    """Say that it was interrupted, once; what is still at work ends within the second."""
    if _engines and signal.getitimer(signal.ITIMER_REAL)[0] > 0:
        _handle(signal.SIGALRM, "quiet")
    _ignore()
    os.write(2, _TEXT.value)


def _ignore() -> None:
    """Let a press change nothing any more.

    Python resets a handler of its own as it ends, and a press in that moment would end the
    process by the signal, without a line; what is ignored stays ignored.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _unraisable(what: "sys.UnraisableHookArgs") -> None:
    """Stay silent where a destructor swallows a Ctrl-C: the alarm ends the command."""
    if what.exc_type is not KeyboardInterrupt:
        sys.__unraisablehook__(what)


def _handle(number: int, name: str) -> None:
    """Install a handler past Python, which would wait for its lock."""
    install = ctypes.CDLL(None).signal
    install.argtypes, install.restype = (ctypes.c_int, ctypes.c_void_p), ctypes.c_void_p
    install(number, _engines[0].get_function_address(name))
