"""The child process of ``python -m benchmarks.compare``: prepares a measure in one checkout, and repeats its work.

It reads a line of JSON for each task from standard input and answers with one. Standard output belongs to the answers,
so that what the measured code prints goes to standard error.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from . import MEASURES, Work


def processor_seconds() -> float:
    """Of this process and of the children that have ended."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def prepare(name: str, folder: Path) -> Callable[[], Work]:
    """The work of a measure, warmed up."""
    measure = MEASURES[name]
    module, _, function = measure.prepare.partition(":")
    folder.mkdir(parents=True)
    work: Callable[[], Work] = getattr(import_module(f"{__package__}.{module}"), function)(folder, *measure.arguments)
    work()
    return work


def timed(work: Callable[[], Work], clock: str) -> dict[str, object]:
    """Do it once; seconds, and what it was."""
    wall, processor = time.perf_counter(), processor_seconds()
    done = work()
    seconds = processor_seconds() - processor if clock == "processor" else time.perf_counter() - wall
    return {"seconds": seconds, "count": done.count, "digest": done.digest(), "facts": done.facts}


def main() -> None:
    """Answer until standard input ends."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    work: Callable[[], Work] | None = None
    name = ""
    for line in sys.stdin:
        task = json.loads(line)
        try:
            if task["do"] == "prepare":
                name = task["measure"]
                work = prepare(name, Path(task["folder"]))
                answer: dict[str, object] = {}
            else:
                assert work is not None
                answer = timed(work, MEASURES[name].clock)
        except Exception as error:  # an older revision may lack anything: the parent says so in its table
            answer = {"failed": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)
