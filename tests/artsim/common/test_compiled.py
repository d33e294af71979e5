"""Compiled functions do what they say in Python, and bring numba only once they are called."""

from __future__ import annotations

import subprocess
import sys
import time

import pytest

from artsim.common import compiled as module
from artsim.common.compiled import compiled, said_if_slow


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


def test_what_takes_long_is_said_once(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_SAID_AFTER", 0.01)
    monkeypatch.setattr(module._Said, "already", False)
    with said_if_slow():
        pass
    assert capsys.readouterr().err == ""
    for _ in range(2):
        with said_if_slow():
            time.sleep(0.2)
    assert capsys.readouterr().err.count("compiles its loops") == 1
