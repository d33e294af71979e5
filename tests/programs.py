"""Programs run in this process: to start Python anew takes longer than most of what tests ask of them."""

from __future__ import annotations

import contextlib
import io
import os
import runpy
import sys
from pathlib import Path
from subprocess import CompletedProcess
from unittest.mock import patch

from artsim.errors import ArtsimError

ROOT = Path(__file__).resolve().parents[1]


def run_here(program: str, *words: object, folder: Path = ROOT) -> CompletedProcess[str]:
    """What a program prints and exits with: ``python -m program words``, or a script where its name ends in ``.py``."""
    out, err = io.StringIO(), io.StringIO()
    code: object = 0
    arguments, before = [program, *map(str, words)], Path.cwd()
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        patch.object(sys, "argv", arguments),
        patch.dict(os.environ, COLUMNS="300"),
    ):
        os.chdir(folder)
        try:
            if program.endswith(".py"):
                runpy.run_path(str(ROOT / program), run_name="__main__")
            else:
                runpy.run_module(program, run_name="__main__", alter_sys=True)
        except SystemExit as stop:
            code = stop.code or 0
        except ArtsimError as error:  # as the hook of benchmarks does
            code = 2
            print(f"error: {error}", file=sys.stderr)
        finally:
            os.chdir(before)
    return CompletedProcess(arguments, code if isinstance(code, int) else 1, out.getvalue(), err.getvalue())
