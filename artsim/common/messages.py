"""What programs say beside their results: ``logging`` under ``artsim`` and ``artperl``, shown on standard error.

Modules log to ``logging.getLogger(__name__)``. Nothing is set up at an import: a program shows messages by
:meth:`Messages.shown`, and whoever uses the packages from Python does as with any other library.
"""

import contextlib
import json
import logging
import sys
from collections.abc import Iterator
from dataclasses import dataclass

from artsim.common.names import printable
from artsim.errors import ConfigError

LOGGERS = ("artsim", "artperl")

_MOST = 4000
"""Characters of a line: a message may quote files that nobody vouches for."""
_PREFIXES = {logging.DEBUG: "debug: ", logging.WARNING: "warning: ", logging.ERROR: "error: "}


@dataclass(frozen=True)
class Messages:
    """Options of every command: what it says on standard error."""

    verbose: bool = False
    """Also say versions, times, and where in the code an error is raised."""
    quiet: bool = False
    """Say warnings and errors alone: no progress, no notes."""
    log_json: bool = False
    """Say it as JSON: time, level, logger and message, an object in each line."""

    def __post_init__(self) -> None:
        if self.verbose and self.quiet:
            raise ConfigError("they exclude one another", "verbose, quiet", "leave one of them out")

    @contextlib.contextmanager
    def shown(self) -> Iterator[None]:
        """Show messages on standard error within a block."""
        before = _shown
        _show(self)
        try:
            yield
        finally:
            _show(before)


_shown: Messages | None = None


def _show(messages: Messages | None) -> None:
    global _shown
    _shown = messages
    if messages is not None:
        _HANDLER.setFormatter(_AsJson() if messages.log_json else _AsText())
    for logger in map(logging.getLogger, LOGGERS):
        if messages is None:
            logger.removeHandler(_HANDLER)
            logger.setLevel(logging.NOTSET)
        else:
            logger.addHandler(_HANDLER)
            logger.setLevel(logging.DEBUG if messages.verbose else logging.WARNING if messages.quiet else logging.INFO)


def messages_shown() -> Messages | None:
    """How this process shows messages; None where no program does."""
    return _shown


def note(text: str) -> None:
    """Say what must be known at once: a message, printed on standard error where no program shows messages."""
    if _shown is None:
        print(text, file=sys.stderr, flush=True)
    else:
        logging.getLogger("artsim").info(text)


class _Handler(logging.Handler):
    """Writes above the bars that there are; a closed pipe is the program's to answer."""

    def emit(self, record: logging.LogRecord) -> None:
        from tqdm import tqdm  # here, since modules that import fast import this one

        tqdm.write(self.format(record), file=sys.stderr)
        sys.stderr.flush()


class _AsText(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        lines = f"{_PREFIXES.get(record.levelno, '')}{super().format(record)}".split("\n")
        return "\n".join(printable(line, _MOST) for line in lines)


class _AsJson(logging.Formatter):
    default_msec_format = "%s.%03d"

    def format(self, record: logging.LogRecord) -> str:
        said = {"level": record.levelname.lower(), "logger": record.name, "message": super().format(record)}
        return json.dumps({"time": self.formatTime(record), **said})


_HANDLER = _Handler()
