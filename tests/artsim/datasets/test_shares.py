"""Several machines make one dataset: they die, come late, and find the same plan, or say that they do not."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import artsim
from artsim.datasets import preparing
from artsim.datasets.description import document_bytes, read_started
from artsim.datasets.merge import merge
from artsim.datasets.preparing import Share
from artsim.datasets.sample_options import SampleOptions
from artsim.errors import AssetError, ConfigError, DatasetError
from artsim.loading.sources import Source, family_sources
from artsim.runs.storage import FolderStorage
from tests.artsim.datasets.troublesome import Troublesome, digests
from tests.conftest import ROOT

quick = pytest.mark.usefixtures("quick_workers")
SOURCES: list[Source] = list(family_sources(["laptop"], 20))


def make(out: Path, sources: list[Source] = SOURCES, **more: Any) -> artsim.datasets.generate.GenerateResult:
    options = {"sample": SampleOptions(num_points=64), "shard_size": 8, "progress": False, "workers": 1, **more}
    return artsim.generate(sources, out, 160, **options)


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(preparing, "_PATIENCE", 0.5)
    monkeypatch.setattr(preparing, "_LOOK", 0.1)


@pytest.mark.slow
@quick
def test_one_machine_of_three_is_gone_and_its_objects_are_prepared_by_others(tmp_path: Path) -> None:
    make(tmp_path / "local")
    for number in (2, 0):
        assert make(tmp_path / "out", share=Share(number, 3)).made > 40
    with pytest.raises(DatasetError, match=r"such as .*\. Fix: run again: --share 1/3$"):
        merge(tmp_path / "out", progress=False)
    with pytest.raises(DatasetError, match=r"several machines are making it in shares\. Fix: artsim merge"):
        make(tmp_path / "out")
    make(tmp_path / "out", share=Share(1, 3))
    merge(tmp_path / "out", check=True, progress=False)
    assert digests(tmp_path / "out") == digests(tmp_path / "local")
    assert not (tmp_path / "out" / "parts").exists()


@quick
def test_other_options_and_objects_are_refused(tmp_path: Path) -> None:
    make(tmp_path / "out", share=Share(0, 1))
    for change, named in (
        ({"seed": 1}, "seed"),
        ({"sources": SOURCES[:3]}, "objects"),
        ({"shard_size": 9}, "shard_size"),
    ):
        with pytest.raises(DatasetError, match=rf"another plan \(different: {named}\)"):
            make(tmp_path / "out", share=Share(0, 1), **change)
    shutil.copytree(tmp_path / "out" / "parts" / "objects", tmp_path / "begun" / "parts" / "objects")
    with pytest.raises(DatasetError, match="its objects were prepared with other options"):
        make(tmp_path / "begun", share=Share(0, 1), seed=1)
    (tmp_path / "strange").mkdir()
    (tmp_path / "strange" / "thesis.txt").touch()
    with pytest.raises(DatasetError, match=r"already holds 'thesis\.txt'"):
        make(tmp_path / "strange", share=Share(0, 2))
    with pytest.raises(ConfigError, match="it is a file, where a folder"):
        make(tmp_path / "strange" / "thesis.txt" / "out", share=Share(0, 2))


@quick
def test_an_object_of_no_use_stops_a_machine_or_is_left_out_by_all(tmp_path: Path) -> None:
    bad: list[Source] = [*SOURCES[:2], Troublesome("leaves")]  # type: ignore[list-item]
    with pytest.raises(AssetError, match=r"1 of 3 objects do not load: leaves: cannot be loaded \(SystemExit: 3\)"):
        make(tmp_path / "out", bad, share=Share(0, 1))
    made = make(tmp_path / "out", bad, share=Share(0, 1), skip_broken=True)
    assert [reason.partition(":")[0] for reason in made.left_out] == ["leaves"]
    merge(tmp_path / "out", progress=False)
    assert len(artsim.open_dataset(tmp_path / "out").plan.objects) == 2


@quick
def test_a_plan_whose_objects_have_other_bytes_is_not_gone_on_with(tmp_path: Path) -> None:
    """As another kind of processor may make them."""
    storage = FolderStorage(tmp_path / "out")
    make(tmp_path / "out", share=Share(0, 1))
    begun = read_started(storage)
    assert begun is not None
    document = begun.document
    document["objects"][0]["file_sha256"] = "0" * 64
    storage.write("plan.json", document_bytes(document))
    with pytest.raises(DatasetError, match=r"sample \d+ of laptop:\d+ cannot be made"):
        make(tmp_path / "out", share=Share(0, 1))


def test_a_share_is_named_as_schedulers_count() -> None:
    assert Share.parse("0/8") == Share(0, 8)
    for text in ("8/8", "-1/8", "1", "1/0", "one/two"):
        with pytest.raises(ConfigError, match="write 0/8 to 7/8"):
            Share.parse(text)
    assert str(replace(Share(3, 8), number=4)) == "4/8"


@pytest.mark.slow
def test_sigterm_in_each_phase_costs_the_work_in_hand_alone(tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [
        sys.executable, str(ROOT / "generate.py"), "--categories", "laptop", "--objects-per-category", "60",
        "--num-samples", "600", "--num-points", "64", "--shard-size", "10", "--workers", "1", "--out",
    ]  # fmt: skip

    def stop(when: Callable[[], bool]) -> None:
        process = subprocess.Popen([*command, str(out), "--share", "0/1"], stderr=subprocess.DEVNULL)
        for _ in range(6000):
            if when() or process.poll() is not None:
                break
            time.sleep(0.01)
        process.send_signal(signal.SIGTERM)
        assert process.wait() == -signal.SIGTERM

    stop(out.exists)
    stop(lambda: len(list(out.glob("parts/objects/*.json"))) >= 2)
    stop(lambda: len(list(out.glob("parts/shards/*.json"))) >= 20)
    kept = {path.name: path.stat().st_mtime_ns for path in out.glob("*.tar")}
    assert 20 <= len(kept) < 60
    subprocess.run([*command, str(out), "--part", "0/1"], check=True, capture_output=True)  # its name before
    assert all((out / name).stat().st_mtime_ns == written for name, written in kept.items())
    merge(out, progress=False)
    subprocess.run([*command, str(tmp_path / "local")], check=True, capture_output=True)
    assert digests(out) == digests(tmp_path / "local")
    assert not list(out.rglob(".*.part"))


_SMALL_FILES = (
    "import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
    "resource.setrlimit(resource.RLIMIT_FSIZE, (9_000, resource.RLIM_INFINITY));"
    "sys.argv[0] = 'generate.py'; from artsim.commands.verbs import generate_main; generate_main()"
)


@pytest.mark.slow
def test_a_disk_that_fills_up_under_a_share_and_clocks_that_jump_leave_no_trace(tmp_path: Path) -> None:
    """A limit on the size of files is a full disk: the same call fails. Each clock is a day off, now and then."""
    (tmp_path / "sitecustomize.py").write_text(
        "import itertools, time\n"
        "_now, _calls = time.time, itertools.count()\n"
        "time.time = lambda: _now() + (-86_400.0, 0.0, 86_400.0)[next(_calls) % 3]\n"
        "time.time_ns = lambda: int(1e9 * time.time())\n"
    )
    options = [
        "--categories", "laptop", "--objects-per-category", "6", "--num-samples", "40", "--num-points", "64",
        "--shard-size", "10", "--workers", "1", "--out",
    ]  # fmt: skip
    jumping = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    whole, out = [sys.executable, str(ROOT / "generate.py"), *options], tmp_path / "out"
    for number in range(2):
        own = [str(out), "--share", f"{number}/2"]
        full = subprocess.run(
            [sys.executable, "-c", _SMALL_FILES, *options, *own],
            env=jumping,
            capture_output=True,
            text=True,
            cwd=ROOT,
        )
        assert full.returncode == 2, full.stderr
        assert "cannot write (File too large)" in full.stderr
        assert not list(out.rglob("*.part"))
        assert not list(out.glob("*.tar"))
    for number in range(2):
        subprocess.run([*whole, str(out), "--share", f"{number}/2"], env=jumping, check=True, capture_output=True)
    merge(out, check=True, progress=False)
    subprocess.run([*whole, str(tmp_path / "local")], check=True, capture_output=True)
    assert digests(out) == digests(tmp_path / "local")
