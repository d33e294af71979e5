"""Programs that print the figures of README and docs: ``python -m benchmarks.NAME --help``."""

import sys
from types import TracebackType

from artsim.common.extras import import_failure, is_own_module
from artsim.errors import ArtsimError


def _one_line(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Print an error that is the user's to mend as one line, and exit with 2, as the other programs do."""
    if isinstance(error, ImportError) and not is_own_module(error):
        error = import_failure(error, "benchmarks")
    if not isinstance(error, ArtsimError):
        sys.__excepthook__(kind, error, trace)
        return
    print(f"error: {error}", file=sys.stderr)
    sys.stdout.flush()
    raise SystemExit(2)


# Modules of benchmarks import what they measure at their top, before any code of theirs could catch an error. While
# "python -m benchmarks.NAME" is looking for NAME, and only then, the program is called -m.
if sys.argv[0] == "-m":
    sys.excepthook = _one_line
