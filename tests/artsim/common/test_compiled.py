"""Compiled functions do what they say in Python, and bring numba only once they are called."""

from __future__ import annotations

import subprocess
import sys

import pytest

from artsim.common.compiled import compiled


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
