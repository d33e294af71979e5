"""Progress of long work, on a terminal and in a log."""

import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios

import pytest

from artsim.common import progress
from artsim.common.progress import Lines, say, track

SCRIPT = """
import time
from artsim.common import progress
progress.FIRST = progress.EVERY = 0.05
with progress.track("views", total=4, initial=1, unit="view") as bar:
    for _ in range(3):
        time.sleep(0.12)
        bar.set_postfix_str("all well")
        bar.update()
    progress.say("a result")
"""


@pytest.fixture
def clock(monkeypatch):
    """A clock that is put forward by hand."""
    now = [100.0]
    monkeypatch.setattr(progress, "monotonic", lambda: now[0])
    return now


def test_a_log_gets_a_line_soon_then_one_a_minute_and_one_at_the_end(clock, capsys):
    for _ in track("objects", range(330), unit="object"):
        clock[0] += 1.0
    lines = capsys.readouterr().err.splitlines()
    assert [line.split()[2].split("/")[0] for line in lines] == ["10", "70", "130", "190", "250", "310", "330"]
    assert all(line.startswith("objects:") for line in lines)
    assert "70/330 [01:10<04:20" in lines[1]


def test_the_last_line_comes_once(clock, capsys):
    for _ in track("scenes", range(1)):
        clock[0] += 65.0
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_short_work_says_nothing_in_a_log(clock, capsys):
    with track("samples", total=10) as bar:
        for _ in range(10):
            clock[0] += 0.9
            bar.update()
    assert isinstance(bar, Lines)
    assert bar.n == 10
    assert capsys.readouterr().err == ""


def test_work_that_was_partly_done_counts_from_there(clock, capsys):
    with track("samples", total=1000, initial=900) as bar:
        clock[0] += 60.0
        bar.update(50)
    assert "950/1000 [01:00<01:00" in capsys.readouterr().err.splitlines()[0]


def test_what_is_not_to_be_shown_says_nothing(clock, capsys):
    done = []
    for item in track("objects", iter("abc"), shown=False):
        clock[0] += 100.0
        done.append(item)
    assert done == ["a", "b", "c"]
    assert capsys.readouterr().err == ""


def test_results_are_printed_at_once(capsys):
    say("score 1.25")
    assert capsys.readouterr().out == "score 1.25\n"


def test_a_file_gets_lines(tmp_path):
    log = tmp_path / "log"
    with log.open("w") as file:
        subprocess.run([sys.executable, "-c", SCRIPT], stdout=file, stderr=file, check=True)
    text = log.read_text()
    lines = text.splitlines()
    assert "\r" not in text
    assert lines[0].startswith("views:  50% 2/4")
    assert lines[0].endswith("all well]")
    assert lines[-1] == "a result"
    assert lines[-2].startswith("views: 100% 4/4")


def test_a_terminal_gets_a_bar():
    main, terminal = pty.openpty()
    fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("4H", 24, 100, 0, 0))
    subprocess.run([sys.executable, "-c", SCRIPT], stdout=terminal, stderr=terminal, check=True)
    os.close(terminal)
    shown = os.read(main, 100_000).decode()
    os.close(main)
    assert "\rviews: 100%|" in shown
    assert "a result" in shown
