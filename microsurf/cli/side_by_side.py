"""Several scenes at a time, each in a process forked from this one; results come in their order.

A scene alone keeps few cores busy: between two bouts of tracing are steps that only one can
do. A fork knows the scenes, the options, and whatever else this process has, so nothing has to
be sent but the results. Processes are forked while this one has a single thread: a fork has
none of the others, nor what they were about to do. Where that can't be, on systems other than
Linux, after tracing by Embree, with a renderer loaded, scenes are done here, one after the other.
"""

import multiprocessing
import os
import sys
import traceback
from collections.abc import Callable, Generator, Iterator, Sequence
from functools import partial
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

import psutil
from tqdm import tqdm

from .. import memory
from ..errors import MicrosurfError
from . import interrupt

T = TypeVar("T")

Tell = Callable[[str], None]
Work = Callable[[str, Tell | None], T]
"""What to do with a scene of some name; where to say what is under way, None if nowhere."""


def possible() -> bool:
    """Whether this process may be forked."""
    return sys.platform == "linux" and int(psutil.Process().num_threads()) == 1


def in_order(
    work: Work[T], names: Sequence[str], processes: int, begin: Callable[[int], None]
) -> Generator[T, None, None]:
    """Do the work for each name, by so many processes; close it to end them.

    ``begin`` is called first in each of several processes, with its number.

    Raises
    ------
    MicrosurfError
        If a process was lost; what the work raises is raised here.

    """
    if processes < 2:
        yield from (work(name, None) for name in names)
        return
    context = multiprocessing.get_context("fork")
    waiting: Any = context.SimpleQueue()
    pipes: dict[Connection, Any] = {}
    bar: tqdm[None] | None = None
    try:
        for number in range(processes):
            here, there = context.Pipe()
            serving = (number, processes, os.getpid(), work, begin, waiting, there)
            process = context.Process(target=_serve, args=serving)
            process.start()
            there.close()
            pipes[here] = process
        for name in [*names, *[None] * processes]:
            waiting.put(name)
        # After the forks: a bar has a thread of its own.
        bar = tqdm(
            total=len(names),
            disable=None,
            desc="scenes",
            smoothing=0,
            bar_format="{desc}: {n_fmt}/{total_fmt}|{bar}| [{elapsed}<{remaining}]{postfix}",
        )
        yield from _received(names, pipes, bar)
    finally:
        if bar is not None:
            bar.close()
        for process in pipes.values():
            process.terminate()
        for process in pipes.values():
            process.join()


def _received(
    names: Sequence[str], pipes: dict[Connection, Any], bar: "tqdm[None]"
) -> Iterator[Any]:
    """Results by the order of names, as soon as all before them are there."""
    results: dict[str, tuple[bool, Any]] = {}
    under_way: dict[Connection, str] = {}
    for name in names:
        while name not in results:
            for pipe in pipes.keys() & set(wait([*pipes])):
                try:
                    what, whose, content = pipe.recv()
                except EOFError:
                    raise _lost(pipes[pipe]) from None
                under_way[pipe] = f"{whose} {content}" if what == "begun" else whose
                if what != "begun":
                    results[whose] = what == "done", content
                    bar.update(1)
                bar.set_postfix_str("; ".join(under_way.values()))
        done, content = results.pop(name)
        if not done:
            raise content
        yield content


def _lost(process: Any) -> MicrosurfError:
    process.join()
    return MicrosurfError(
        f"a process was lost (exit code {process.exitcode}), maybe for want of memory; what is "
        "finished is kept, start again with --resume, with --workers 1 for less at a time"
    )


def _tell(pipe: Connection, name: str, stage: str) -> None:
    pipe.send(("begun", name, stage))


def _serve(
    number: int, processes: int, parent: int, work: Work[Any], begin: Callable[[int], None],
    waiting: Any, pipe: Connection,
) -> None:  # fmt: skip
    """Be one of several processes: take names until none is left."""
    interrupt.serve(parent)
    memory.share(processes)
    begin(number)
    while (name := waiting.get()) is not None:
        try:
            pipe.send(("done", name, work(name, partial(_tell, pipe, name))))
        except Exception as error:  # noqa: BLE001 - raised where the command is
            error.add_note(traceback.format_exc())
            pipe.send(("failed", name, error))
    pipe.recv()  # until the command ends: one that is gone is lost
