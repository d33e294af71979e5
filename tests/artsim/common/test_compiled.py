"""Compiled functions do what they say in Python, and bring numba only once they are called."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from artsim.common.compiled import compiled
from tests.conftest import ROOT


@compiled
def triangle(count: int) -> int:
    """Sum of the first numbers."""
    total = 0
    for i in range(count):
        total += above(i)
    return total


@compiled
def above(number: int) -> int:
    """The next one."""
    return number + 1


@pytest.mark.slow
def test_compiled_functions_call_each_other_and_give_what_python_gives() -> None:
    expected = triangle.python(10)
    assert expected == 55
    assert triangle(10) == expected
    assert above(4) == 5
    assert triangle.__doc__ == "Sum of the first numbers."


def test_numba_comes_with_the_first_call_alone() -> None:
    code = "import sys, artsim.common.compiled as c; c.compiled(len); sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.slow
def test_it_is_said_once_that_loops_are_compiled_and_not_when_they_are_read(tmp_path: Path) -> None:
    (tmp_path / "loops.py").write_text(
        "from artsim.common.compiled import compiled\n"
        "@compiled\ndef twice(n):\n    return 2 * n\n"
        "@compiled\ndef thrice(n):\n    return 3 * n\n"
    )
    code, said = "import loops; assert loops.twice(2) + loops.thrice(1) == 7", []
    for _ in range(2):
        run = subprocess.run(
            [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True,
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": f"{ROOT}:{tmp_path}"},
        )  # fmt: skip
        said.append(run.stderr.count("compiles its loops"))
    assert said == [1, 0]
