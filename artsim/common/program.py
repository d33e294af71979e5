"""A program of several verbs: the command line is read as one of them, and errors are one line."""

import contextlib
import functools
import inspect
import io
import operator
import os
import re
import sys
from importlib.metadata import version
from typing import Annotated, Any, get_args

import tyro

from artsim.common.extras import import_failure, is_own_module
from artsim.common.names import PrintableStream, name_fix, printable
from artsim.errors import ArtsimError, ConfigError


def cores() -> int:
    """Processor cores that this process may use: as many workers a program starts."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def _told(verb: Any, description: str | None) -> str:
    """What ``--help`` begins with."""
    return f"{inspect.cleandoc(description or verb.__doc__ or '')}\n\n{_ENDS}"


_ENDS = """--version prints the version; --completion bash (or zsh, fish) prints a script that completes commands.
Exit codes: 0 done, 1 some items failed, 2 a wrong input or option, or a failed check, 130 stopped by Ctrl-C."""


def _in_brief(verbs: Any) -> Any:
    """Verbs with the first paragraph of what each says, so that a list of them fits a screen."""
    brief = []
    for verb in get_args(verbs):
        kind, *named = get_args(verb) or (verb,)
        first = inspect.cleandoc(kind.__doc__).partition("\n\n")[0]
        brief.append(Annotated[kind, tyro.conf.subcommand(named[0].name if named else None, description=first)])
    return functools.reduce(operator.or_, brief)


def _completion(verb: Any, program: str, shell: str) -> str:
    """Tyro's script that completes what is typed, with its descriptions in one line each, and with names of files."""
    shells = ("bash", "zsh", "fish")
    if shell not in shells:
        raise ConfigError(f"there is no script for {shell!r:.40}", "completion", name_fix(shell, shells))
    with contextlib.redirect_stdout(io.StringIO()) as printed, contextlib.suppress(SystemExit):
        tyro.cli(verb, prog=program, args=["--tyro-print-completion", shell])
    script = re.sub("^COMPLETION_SPEC = .*", lambda spec: spec[0].replace("\\n", " "), printed.getvalue(), flags=re.M)
    return script.replace("complete -F", "complete -o default -F")


def run_program(verb: Any, program: str, description: str | None = None) -> None:
    """Read the command line as one of some verbs, and run it; errors are one line, and exit with 2."""
    if sys.argv[1:] == ["--version"]:
        print(f"{program} {version('artsim')}")
        return
    if get_args(verb) and sys.argv[1:] in ([], ["-h"], ["--help"]):  # of several verbs, none is the default
        sys.argv[1:], verb = ["--help"], _in_brief(verb)
    if isinstance(sys.stdout, io.TextIOWrapper):  # a terminal need not know every character
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        if sys.argv[1:2] == ["--completion"]:
            print(_completion(verb, program, "".join(sys.argv[2:3])))
            return
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
