"""Runs that write many objects: bytes by seed alone, nothing made twice, nothing left over."""

from __future__ import annotations

import csv
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from artsim.checks.strict_urdf import strict_urdf
from artsim.errors import ConfigError, DatasetError
from artsim.export import FORMATS, export
from artsim.export.batch import generate_objects
from artsim.families import make
from tests.conftest import installed


def content(folder: Path) -> dict[str, bytes]:
    """Bytes of every file below a folder."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.slow
def test_bytes_depend_on_the_seed_alone_and_whole_objects_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")  # the date in SimReady packages
    formats = [name for name in FORMATS if name != "usd"]
    one = generate_objects(["laptop", "drawer"], tmp_path / "one", 2, 5, formats, workers=1, progress=False)
    two = generate_objects(["laptop", "drawer"], tmp_path / "two", 2, 5, formats, workers=2, progress=False)
    assert (one.total, one.made) == (two.total, two.made) == (4, 4)
    assert content(tmp_path / "one") == content(tmp_path / "two")

    # One object lost, one half made, one of another version: only these are made.
    for file in sorted((tmp_path / "two/laptop/5").rglob("*"), reverse=True):
        file.rmdir() if file.is_dir() else file.unlink()
    (tmp_path / "two/laptop/5").rmdir()
    (tmp_path / "two/laptop/.5.123.part").mkdir()
    meta = tmp_path / "two/drawer/6/meta.json"
    meta.write_text(meta.read_text().replace('"version": "', '"version": "0.0.'))
    kept = (tmp_path / "two/laptop/6/mobility.urdf").stat().st_mtime_ns
    again = generate_objects(["laptop", "drawer"], tmp_path / "two", 2, 5, formats, workers=1, progress=False)
    assert again.made == 2
    assert (tmp_path / "two/laptop/6/mobility.urdf").stat().st_mtime_ns == kept
    assert content(tmp_path / "one") == content(tmp_path / "two")
    assert generate_objects(["laptop", "drawer"], tmp_path / "two", 2, 5, formats, progress=False).made == 0

    rows = list(csv.DictReader((tmp_path / "two/index.csv").read_text().splitlines()))
    assert [row["folder"] for row in rows] == ["laptop/5", "laptop/6", "drawer/5", "drawer/6"]
    for row in rows:
        obj = make(row["category"], int(row["object_id"]))
        assert row["parts"].split() == [part.name for part in obj.parts]
        assert row["sha256"] == obj.sha256
        assert (tmp_path / "two" / row["folder"] / FORMATS["mjcf"]).is_file()


def test_usd_is_written_to_the_same_bytes_each_time(tmp_path: Path) -> None:
    installed("pxr")
    for name in ("one", "two"):
        export(make("laptop", 1), tmp_path / name, ["usd"])
    assert content(tmp_path / "one") == content(tmp_path / "two")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("more", "problem"),
    [
        ({"categories": ["lapdog"]}, "lapdog"),
        ({"categories": []}, "no category"),
        ({"count": 0}, "count"),
        ({"workers": 0}, "workers"),
        ({"seed": -1}, "seed"),
        ({"formats": ["step"]}, "step"),
        ({"formats": []}, "formats"),
    ],
)
def test_options_that_make_no_sense_are_refused(more: dict[str, object], problem: str, tmp_path: Path) -> None:
    options: dict[str, object] = {"categories": ["laptop"], "out": tmp_path / "out", "count": 1, **more}
    with pytest.raises(ConfigError, match=problem):
        generate_objects(**options)  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written_to_is_named(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file")
    with pytest.raises(ConfigError, match="it is a file, where a folder"):
        generate_objects(["laptop"], tmp_path / "out", 1, progress=False)


def test_two_runs_do_not_share_a_folder(tmp_path: Path) -> None:
    import fcntl

    with (tmp_path / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(DatasetError, match="another run"):
            generate_objects(["laptop"], tmp_path, 1, progress=False)


@pytest.mark.slow
def test_ctrl_c_keeps_whole_objects_and_leaves_nothing_else(tmp_path: Path) -> None:
    options = ["--category", "laptop", "--count", "2000", "--workers", "1", "--out", str(tmp_path)]
    run = subprocess.Popen(
        [sys.executable, "-c", "from artsim.commands.verbs import main; main()", "generate-objects", *options],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a job in the background ignores Ctrl-C
    )
    deadline = time.monotonic() + 60
    while not list(tmp_path.glob("laptop/[0-9]*")) and time.monotonic() < deadline:
        time.sleep(0.05)
    run.send_signal(signal.SIGINT)
    _, output = run.communicate(timeout=60)
    assert run.returncode == 130
    assert "whole objects are kept" in output
    made = sorted((tmp_path / "laptop").iterdir())
    assert made
    assert all(folder.name.isdigit() for folder in made)
    assert all(strict_urdf(folder) == [] for folder in made)
    assert not (tmp_path / "index.csv").exists()
