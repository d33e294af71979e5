"""A program of several verbs: the command line is read as one of them, and errors are one line."""

import contextlib
import inspect
import io
import os
import sys
from importlib.metadata import version
from typing import Any, get_args

import tyro

from artsim.common.extras import import_failure, is_own_module
from artsim.common.names import PrintableStream, printable
from artsim.errors import ArtsimError


def cores() -> int:
    """Processor cores that this process may use: as many workers a program starts."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def _told(verb: Any, description: str | None) -> str:
    """What ``--help`` begins with."""
    return f"{inspect.cleandoc(description or verb.__doc__ or '')}\n\n--version prints the version."


def run_program(verb: Any, program: str, description: str | None = None) -> None:
    """Read the command line as one of some verbs, and run it; errors are one line, and exit with 2."""
    if sys.argv[1:] == ["--version"]:
        print(f"{program} {version('artsim')}")
        return
    if not sys.argv[1:] and get_args(verb):  # of several verbs, none is the default
        sys.argv.append("--help")
    if isinstance(sys.stdout, io.TextIOWrapper):  # a terminal need not know every character
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        chosen = tyro.cli(verb, prog=program, description=_told(verb, description))
        with contextlib.redirect_stdout(PrintableStream(sys.stdout)):  # names out of files are in what is printed
            chosen.run()
    except BrokenPipeError:  # the reader of our output, such as head, has seen enough
        sys.stderr.close()
    except ImportError as error:  # the net below every import of an optional dependency
        if is_own_module(error):
            raise
        print(f"error: {printable(import_failure(error, program), 4000)}", file=sys.stderr)
        sys.exit(2)
    except (ArtsimError, OSError) as error:
        print(f"error: {printable(error, 4000)}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt as stop:  # its text says what is kept
        print("; ".join(["\nstopped", *map(str, stop.args)]), file=sys.stderr)
        sys.exit(130)
