"""What commands say beside their results: to people, to scripts, and to logs."""

from __future__ import annotations

import json
import logging
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from artsim.common.messages import LOGGERS, Messages
from artsim.common.progress import track
from artsim.runs.pool import WorkerPool
from tests.conftest import ROOT
from tests.programs import run_here as run

CHAIN = "urdf_assets/quirks/chain"


def logged(number: int) -> None:
    """Work of a process that has something to say."""
    logging.getLogger("artsim.elsewhere").info("square %d", number**2)


def test_imports_set_up_no_logging() -> None:
    code = (
        "import logging, artsim, artperl, artsim.commands.verbs, artperl.commands.verbs\n"
        "loggers = [logging.root, *(logging.getLogger(name) for name in ('artsim', 'artperl'))]\n"
        "assert not any(own.handlers for own in loggers) and loggers[1].level == logging.NOTSET"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True)


def test_json_holds_what_the_file_says_and_nothing_else_is_printed() -> None:
    told = run("artsim", "inspect", CHAIN, "--json", "--quiet")
    assert told.stderr == ""
    found = {own["joint"]["name"]: own["joint"] for own in json.loads(told.stdout)["parts"][1:]}
    joints = {own.get("name"): own for own in ElementTree.parse(ROOT / CHAIN / "chain.urdf").iter("joint")}
    assert found.keys() <= joints.keys()
    limited = [name for name in found if found[name]["lower"] is not None]
    assert len(limited) > 2
    for name in limited:
        limit = joints[name].find("limit")
        assert limit is not None
        assert found[name]["lower"] == pytest.approx(float(limit.get("lower", 0.0)))
        assert found[name]["type"] == joints[name].get("type")


def test_options_of_messages_stand_anywhere_and_json_goes_to_a_file_that_is_named(tmp_path: Path) -> None:
    file = tmp_path / "figures.json"
    text = run("artsim", "--log-json", "inspect", CHAIN, "--json", str(file), "--verbose")
    assert "7 parts, 6 free joints" in text.stdout
    assert len(json.loads(file.read_text())["parts"]) == 7
    lines = [json.loads(line) for line in text.stderr.splitlines()]
    assert {line["level"] for line in lines} == {"debug"}
    assert {line["logger"] for line in lines} == {"artsim"}
    both = run("artsim", "inspect", CHAIN, "--verbose", "--quiet")
    assert (both.returncode, both.stdout) == (2, "")


@pytest.mark.slow
def test_estimates_that_are_taken_for_the_file_of_figures_are_not_overwritten(tmp_path: Path) -> None:
    estimates = tmp_path / "estimates.json"
    estimates.write_text("[]")
    refused = run("artperl", "score", "--json", str(estimates), "--data", str(tmp_path))
    assert refused.returncode == 2
    assert "no estimates" in refused.stderr
    assert estimates.read_text() == "[]"


def test_errors_are_messages_and_keep_their_exit_code() -> None:
    for options, level in (((), None), (("--log-json",), "error"), (("--quiet",), None)):
        failed = run("artsim", "inspect", "nowhere", *options)
        assert (failed.returncode, failed.stdout) == (2, "")
        (line,) = failed.stderr.splitlines()
        assert line.startswith("error: nowhere") if level is None else json.loads(line)["level"] == level
    assert "Traceback" in run("artsim", "inspect", "nowhere", "--verbose").stderr


def test_an_escape_sequence_of_a_file_never_reaches_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    for messages in (Messages(), Messages(log_json=True)):
        with messages.shown():
            logging.getLogger("artperl.inputs").warning("cloud '\x1b[31mred'")
        assert "\x1b" not in (said := capsys.readouterr().err)
        assert "[31mred" in said


@pytest.mark.slow
def test_processes_of_a_pool_say_it_as_the_program_does(capfd: pytest.CaptureFixture[str]) -> None:
    for messages, said in ((Messages(log_json=True), {"square 9", "square 16"}), (Messages(quiet=True), set())):
        with messages.shown(), WorkerPool(1) as pool:
            assert len(list(pool.run(logged, [(n, (n,)) for n in (3, 4)]))) == 2
        assert {json.loads(line)["message"] for line in capfd.readouterr().err.splitlines()} == said
    assert all(not logging.getLogger(name).handlers for name in LOGGERS)


def test_quiet_work_shows_no_progress(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("artsim.common.progress.FIRST", 0.0)
    with Messages(quiet=True).shown():
        assert list(track("objects", range(3))) == [0, 1, 2]
    assert capsys.readouterr().err == ""
    with Messages(log_json=True).shown():
        assert list(track("objects", range(3))) == [0, 1, 2]
    assert "3/3" in json.loads(capsys.readouterr().err.splitlines()[-1])["message"]
