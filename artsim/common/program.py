"""A program of several verbs: the command line is read as one of them, and errors are one line."""

import contextlib
import functools
import inspect
import io
import logging
import operator
import os
import platform
import re
import shutil
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, make_dataclass
from importlib.metadata import version
from pathlib import Path
from textwrap import wrap
from typing import Annotated, Any, NoReturn, get_args

import orjson
import tyro

from artsim.common import progress
from artsim.common.extras import import_failure, is_own_module
from artsim.common.files import write_atomic
from artsim.common.messages import Messages
from artsim.common.names import PrintableStream, name_fix
from artsim.common.outputs import check_output
from artsim.common.tables import cut
from artsim.errors import ArtsimError, ConfigError

STDOUT = Path("-")
"""Stands for standard output where a file is named."""


def cores() -> int:
    """Processor cores that this process may use: as many workers a program starts."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


@dataclass(frozen=True, kw_only=True)
class Figures:
    """Options of commands that print figures."""

    json: Path | None = None
    """Print figures in one line of JSON, instead of text; or write them to this .json file."""

    def __post_init__(self) -> None:
        if self.json_file is not None:  # before the work
            check_output(self.json_file)

    @property
    def json_file(self) -> Path | None:
        """The file, if one is named."""
        return None if self.json == STDOUT else self.json

    def say(self, text: str) -> None:
        """Print a piece of the text, unless figures are printed instead."""
        if self.json != STDOUT:
            progress.say(text)

    def finish(self, figures: Any) -> None:
        """Print or write figures, as asked for: what JSON has, and dataclasses, arrays and paths; NaN becomes null."""
        options = orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_NON_STR_KEYS | orjson.OPT_APPEND_NEWLINE
        if self.json == STDOUT:
            sys.stdout.write(orjson.dumps(figures, str, options).decode())
        elif self.json is not None:
            write_atomic(self.json, orjson.dumps(figures, str, options | orjson.OPT_INDENT_2))


Verbs = Mapping[str, tuple[Any, ...]]
"""Commands of a program, by groups."""


def verb_name(verb: Any) -> str:
    """What a command is called: as annotated, or as its class."""
    _, *named = get_args(verb) or (verb,)
    return named[0].name if named else re.sub("(?<!^)(?=[A-Z])", "-", verb.__name__).lower()


def _class_of(verb: Any) -> Any:
    return (get_args(verb) or (verb,))[0]


_ENDS = """Every command takes --help, --verbose, --quiet and --log-json; those that print figures take --json.
--version prints the version; --completion bash (or zsh, fish) prints a script that completes commands.
Exit codes: 0 done, 1 some items failed, 2 a wrong input or option, or a failed check, 130 stopped by Ctrl-C."""
_WIDTH, _TYPED = 110, 34
"""Columns of a line of help, at most, and of those in which an option is typed."""
_ONE_COLUMN = "129"
"""Columns of a terminal on which tyro puts no group beside another."""
_EVERY = "of every command"
"""Title of the options that all commands have."""


def _columns() -> int:
    """Of a line of help; a file takes whole ones."""
    return min(_WIDTH, shutil.get_terminal_size((_WIDTH, 0)).columns)


def _overview(verbs: Verbs, program: str, description: str) -> str:
    """The commands with the first sentence of what each says: it fits a screen."""
    lines = [inspect.cleandoc(description), "", f"Usage: {program} COMMAND [OPTIONS]"]
    wide = max(len(verb_name(verb)) for group in verbs.values() for verb in group)
    for title, group in verbs.items():
        lines += ["", title]
        for verb in group:
            first = inspect.cleandoc(_class_of(verb).__doc__).partition("\n\n")[0]
            text = " ".join(first.split()).partition(". ")[0].rstrip(".")
            lines += wrap(f"  {verb_name(verb):{wide}}  {text}", _columns(), subsequent_indent=" " * (wide + 4))
    return "\n".join([*lines, "", _ENDS])


def parser_of(verbs: Verbs) -> Any:
    """What tyro reads command lines as: a command with its options, and those of every command, at any place."""
    every = tuple(verb for group in verbs.values() for verb in group)
    every_command = Annotated[
        Messages, tyro.conf.arg(name=_EVERY), tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff
    ]
    fields: list[Any] = [
        (
            "verb",
            Annotated[functools.reduce(operator.or_, every), tyro.conf.arg(name=""), tyro.conf.OmitSubcommandPrefixes],
        ),
        ("messages", every_command, field(default_factory=Messages)),
    ]
    made: Any = make_dataclass("Program", fields)
    return Annotated[made, tyro.conf.CascadeSubcommandArgs]


def _printed(parser: Any, program: str, words: list[str], told: str = "") -> str:
    """What tyro prints instead of reading a command line; it exits where that is wrong."""
    before = os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = _ONE_COLUMN
    try:
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            tyro.cli(parser, prog=program, args=words, description=told)
    except SystemExit as stop:
        if stop.code:
            raise
    finally:
        if before is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = before
    return printed.getvalue()


def _brief(full: str) -> str:
    """Tyro's help with a line for each option: how it is typed, and the first sentence on it."""
    above, _, below = full.partition("\n positional arguments ")
    if not below:
        above, _, below = full.partition("\n options ")
    usage, first, *more = above.strip().split("\n\n")
    examples = [text for text in more if re.search(r": art\w+ ", text)][:2]
    lines = [usage, "", *wrap(first, _columns()), *(["", *examples] if examples else [])]
    groups: dict[str, list[list[str]]] = {}
    for row in full[len(above) :].splitlines():
        if re.match(r" \w", row):
            told = groups[row.strip().removesuffix(" options")] = []
        elif re.match(r"  -+$", row.rstrip()):  # what stands above this line is about the group
            told.clear()
        elif re.match(r"  \S", row):
            typed, _, says = row.strip().partition("  ")
            if told and typed[0] != "-" and told[-1][0][0] == "-":  # choices go on in another line
                told[-1][0] += typed
            else:
                told.append([typed, says])
        elif row.startswith("   ") and row.strip():
            told[-1][1] += f" {row}"
    groups[_EVERY] = groups.pop(_EVERY)
    every = [option for options in groups.values() for option in options]
    for option in every:
        option[0] = re.sub(r"\{None\}\||None,|, --no-\S+", "", option[0])
        option[0] = cut(re.sub(r"\[+(\S+) \[\1 \.\.\.\]+", r"\1 ...", option[0]), _TYPED)
    wide = max(len(typed) for typed, _ in every)
    for title, options in groups.items():
        lines += ["", title]
        for typed, says in options:
            says = re.sub(r"\((default: (None|False)?|required|repeatable)\)$", "", " ".join(says.split()))
            says, _, default = says.strip().partition("(default: ")
            says, default = says.partition(". ")[0].rstrip(". "), f" [{default[:-1]}]" if default else ""
            lines.append(f"  {typed:{wide}}  {cut(says, _columns() - wide - 4 - len(default))}{default}")
    return "\n".join([*lines, "", "With --verbose, all that there is to say of each option."])


def _completion(parser: Any, program: str, shell: str) -> str:
    """Tyro's script that completes what is typed, with its descriptions in one line each, and with names of files."""
    shells = ("bash", "zsh", "fish")
    if shell not in shells:
        raise ConfigError(f"there is no script for {shell!r:.40}", "completion", name_fix(shell, shells))
    script = _printed(parser, program, ["--tyro-print-completion", shell])
    script = re.sub("^COMPLETION_SPEC = .*", lambda spec: spec[0].replace("\\n", " "), script, flags=re.M)
    return script.replace("complete -F", "complete -o default -F")


def _with_stdout(words: list[str]) -> list[str]:
    """Words of a command line, in which --json without a file names standard output."""
    return [
        f"{word}={STDOUT}" if word == "--json" and after != str(STDOUT) and not after.endswith(".json") else word
        for word, after in zip(words, [*words[1:], ""], strict=False)
    ]


@contextlib.contextmanager
def resumable(kept: str, place: object) -> Iterator[None]:
    """Say what is kept of a run that Ctrl-C stops."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"{kept} in {place}: rerun the command to resume") from None


def run_program(verbs: Verbs, program: str, description: str = "") -> None:
    """Read the command line as one of some commands, and run it; errors are one line, and exit with 2.

    Parameters
    ----------
    verbs : mapping of str to tuple
        Commands by groups: dataclasses with a method ``run``. Of one alone, the name is not typed.
    program : str
        What is typed.
    description : str
        What the list of several commands begins with.
    """
    words, every = _with_stdout(sys.argv[1:]), [verb for group in verbs.values() for verb in group]
    if isinstance(sys.stdout, io.TextIOWrapper):  # a terminal need not know every character
        sys.stdout.reconfigure(errors="backslashreplace")
    names = {*map(verb_name, every)}
    if len(every) > 1 and words and not words[0].startswith("-") and words[0] not in names:
        words = words[:1]  # a slip is said, whether help is asked for or not
    first, asked = _class_of(every[0]), {"-h", "--help"} & {*words}
    told = inspect.cleandoc(first.__doc__ if len(every) == 1 else description)
    start, log = time.monotonic(), logging.getLogger(first.__module__.partition(".")[0])
    with Messages().shown(), contextlib.ExitStack() as stack:
        try:
            if words == ["--version"]:
                print(f"{program} {version('artsim')}")
            elif words[:1] == ["--completion"]:
                print(_completion(parser_of(verbs), program, "".join(words[1:2])))
            elif len(every) > 1 and (not words or asked) and not names & {*words}:
                print(_overview(verbs, program, description))
            elif asked and "--verbose" not in words:
                print(_brief(_printed(parser_of(verbs), program, words, told)))
            else:
                chosen = tyro.cli(parser_of(verbs), prog=program, args=words, description=told)
                stack.enter_context(chosen.messages.shown())
                log.debug("artsim %s, Python %s, %s", version("artsim"), platform.python_version(), platform.platform())
                with contextlib.redirect_stdout(PrintableStream(sys.stdout)):  # it has names out of files
                    chosen.verb.run()
                log.debug("done in %.1f s", time.monotonic() - start)
        except BrokenPipeError:  # the reader of our output, such as head, has seen enough
            sys.stderr.close()
        except ImportError as error:  # the net below every import of an optional dependency
            if is_own_module(error):
                raise
            _fail(log, import_failure(error, program))
        except (ArtsimError, OSError) as error:
            _fail(log, error)
        except KeyboardInterrupt as stop:  # its text says what is kept
            print(file=sys.stderr)  # below the ^C of a terminal
            log.info("; ".join(["stopped", *map(str, stop.args)]))
            sys.exit(130)


def _fail(log: logging.Logger, error: Exception) -> NoReturn:
    log.error(error, exc_info=error if log.isEnabledFor(logging.DEBUG) else None)
    sys.exit(2)
