"""Generation runs: reproducible, resumable, and clear when something is wrong."""

from __future__ import annotations

import hashlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import artsim
from artsim.errors import ArtsimError, AssetError, ConfigError, DatasetError
from artsim.plan import SampleOptions
from artsim.sources import Source, find_sources
from artsim.verify import verify
from tests.conftest import ASSETS, BOX_LAPTOP

OPTIONS = SampleOptions(num_points=128)
ROOT = ASSETS.parent


@pytest.fixture
def sources(tmp_path: Path) -> list[Source]:
    """Three different objects of boxes."""
    for i in range(3):
        folder = tmp_path / "objects" / f"laptop_{i}"
        folder.mkdir(parents=True)
        (folder / "mobility.urdf").write_text(BOX_LAPTOP.replace("0.3 0.4 0.02", f"0.3 0.4 0.0{i + 1}"))
    return find_sources([tmp_path / "objects"])


def make(sources: list[Source], out: Path, **options: object) -> artsim.pipeline.GenerateResult:
    defaults = {"num_samples": 60, "sample": OPTIONS, "shard_size": 10, "progress": False, "splits": (1, 1, 1)}
    return artsim.generate(sources, out, **{**defaults, **options})  # type: ignore[arg-type]


def digests(folder: Path) -> dict[str, str]:
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(folder.glob("*.tar"))}


def command(sources_folder: Path, out: Path, *more: str) -> list[str]:
    return [
        sys.executable, str(ROOT / "generate.py"), "--objects", str(sources_folder), "--out", str(out),
        "--num-samples", "3000", "--num-points", "128", "--shard-size", "16", "--workers", "2", *more,
    ]  # fmt: skip


def wait_for_shards(out: Path, count: int) -> None:
    for _ in range(600):
        if len(list(out.glob("*.tar"))) >= count:
            return
        time.sleep(0.05)
    raise AssertionError(f"{out} never got {count} shards")


def test_shards_are_byte_identical_whatever_the_number_of_workers(sources: list[Source], tmp_path: Path) -> None:
    made = [make(sources, tmp_path / str(workers), workers=workers) for workers in (1, 2, 5)]
    first, *others = [digests(result.folder) for result in made]
    assert len(first) == 6
    assert all(other == first for other in others)
    files = [(result.folder / "dataset.json").read_bytes() for result in made]
    assert files[0] == files[1] == files[2]


def test_a_killed_run_resumes_to_the_same_bytes(sources: list[Source], tmp_path: Path) -> None:
    out, whole, objects = tmp_path / "killed", tmp_path / "whole", tmp_path / "objects"
    for shards in (1, 20, 60):
        process = subprocess.Popen(command(objects, out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wait_for_shards(out, shards)
        process.send_signal(signal.SIGKILL)
        process.wait()
    subprocess.run(command(objects, out), check=True, capture_output=True)
    subprocess.run(command(objects, whole), check=True, capture_output=True)
    assert digests(out) == digests(whole)
    assert [p.name for p in out.iterdir() if p.suffix in (".part", ".jsonl")] == []
    assert sorted(s.index for s in artsim.open_dataset(out)) == list(range(3000))


def test_ctrl_c_stops_quietly_and_says_how_to_go_on(sources: list[Source], tmp_path: Path) -> None:
    out, objects = tmp_path / "out", tmp_path / "objects"
    process = subprocess.Popen(
        command(objects, out), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    wait_for_shards(out, 2)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to every process of the group
    printed, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "the same command goes on" in printed
    assert "Traceback" not in errors
    again = subprocess.run(command(objects, out), check=True, capture_output=True, text=True)
    assert "3000 samples" in again.stdout
    assert verify(out, progress=False) == []


def test_a_finished_dataset_is_left_alone(sources: list[Source], tmp_path: Path) -> None:
    make(sources, tmp_path / "out")
    before = {p: p.stat().st_mtime_ns for p in (tmp_path / "out").glob("*.tar")}
    assert make(sources, tmp_path / "out").made == 0
    assert before == {p: p.stat().st_mtime_ns for p in (tmp_path / "out").glob("*.tar")}


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"seed": 1}, "seed"),
        ({"num_samples": 61}, "num_samples"),
        ({"shard_size": 11}, "shard_size"),
        ({"splits": (1, 0, 0)}, "fractions"),
        ({"sample": SampleOptions(num_points=129)}, "sample"),
    ],
)
def test_another_plan_is_refused(change: dict[str, object], named: str, sources: list[Source], tmp_path: Path) -> None:
    make(sources, tmp_path / "out")
    before = digests(tmp_path / "out")
    with pytest.raises(DatasetError, match=f"another plan \\(different: {named}\\)"):
        make(sources, tmp_path / "out", **change)
    with pytest.raises(DatasetError, match=r"another plan \(different: objects\)"):
        make(sources[:2], tmp_path / "out")
    assert digests(tmp_path / "out") == before


def test_a_changed_source_is_another_plan(sources: list[Source], tmp_path: Path) -> None:
    make(sources, tmp_path / "out")
    sources[0].path.write_text(BOX_LAPTOP.replace("2.2", "2.0"))
    with pytest.raises(DatasetError, match="different: objects"):
        make(find_sources([tmp_path / "objects"]), tmp_path / "out")


def test_foreign_folders_and_second_runs_are_refused(sources: list[Source], tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("precious")
    with pytest.raises(DatasetError, match=r"already holds 'thesis\.tex'"):
        make(sources, tmp_path / "mine")
    out = tmp_path / "out"
    process = subprocess.Popen(command(tmp_path / "objects", out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_for_shards(out, 1)
    with pytest.raises(DatasetError, match="another run is writing here"):
        make(sources, out)
    process.kill()
    process.wait()


def test_broken_objects_stop_the_run_or_are_left_out_by_name(sources: list[Source], tmp_path: Path) -> None:
    (tmp_path / "objects" / "laptop_1" / "mobility.urdf").write_text("<robot/>")
    found = find_sources([tmp_path / "objects"])
    with pytest.raises(AssetError, match=r"1 of 3 objects do not load:\n.*laptop_1.*has no <link>"):
        make(found, tmp_path / "out")
    result = make(found, tmp_path / "out", skip_broken=True)
    assert "laptop_1" in result.left_out[0]
    assert len(artsim.open_dataset(result.folder).plan.objects) == 2
    assert make(found, tmp_path / "out", skip_broken=True).made == 0


def test_the_same_object_twice_counts_once(sources: list[Source], tmp_path: Path) -> None:
    result = make([*sources, *sources], tmp_path / "out")
    assert len(artsim.open_dataset(result.folder).plan.objects) == 3


def test_unwritable_places_are_clear_errors(sources: list[Source], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ArtsimError, match="cannot write"):
        make(sources, tmp_path / "file" / "out")


def test_a_full_disk_is_a_clear_error_and_nothing_is_left_half_written(sources: list[Source], tmp_path: Path) -> None:
    """A limit on the size of files stands in for a full disk: the same system call fails in the same place."""
    code = (
        "import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, resource.RLIM_INFINITY));"
        "sys.argv[0] = 'generate.py'; from artsim.cli import generate_main; generate_main()"
    )
    out = tmp_path / "out"
    arguments = [sys.executable, "-c", code, *command(tmp_path / "objects", out)[2:]]
    arguments[arguments.index("3000")] = "40"
    result = subprocess.run(arguments, capture_output=True, text=True, cwd=ROOT, timeout=60)
    assert result.returncode == 2, result.stderr
    assert "error:" in result.stderr
    assert "Traceback" not in result.stderr
    assert list(out.glob("*.tar")) == []
    assert list(out.glob(".*.part")) == []
    resumed = command(tmp_path / "objects", out)
    resumed[resumed.index("3000")] = "40"
    subprocess.run(resumed, check=True, capture_output=True)
    assert verify(out, progress=False) == []
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] == resource.RLIM_INFINITY


def test_a_worker_that_dies_is_a_clear_error(sources: list[Source], tmp_path: Path) -> None:
    """A view function that kills its process is what running out of memory looks like."""
    options = SampleOptions(num_points=16, views=artsim.ViewOptions(custom="tests.test_pipeline:die"))
    with pytest.raises(DatasetError, match="a worker process died"):
        make(sources, tmp_path / "out", sample=options)


def die(*_: object) -> artsim.Camera:
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError("unreachable")


def test_damaged_shards_are_noticed_and_made_again(sources: list[Source], tmp_path: Path) -> None:
    out = tmp_path / "out"
    make(sources, out)
    before = digests(out)
    shard = out / "train-000000.tar"
    whole = shard.read_bytes()
    shard.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(DatasetError, match=r"train-000000\.tar"):
        list(artsim.open_dataset(out))
    assert any("train-000000.tar" in p.where for p in verify(out, progress=False))
    assert make(sources, out).made == 10  # shorter than it should be: made again
    assert digests(out) == before
    shard.write_bytes(whole[:3000] + bytes([whole[3000] ^ 1]) + whole[3001:])
    assert any("another checksum" in p.what for p in verify(out, progress=False))
    shard.unlink()
    make(sources, out)
    assert digests(out) == before


def test_counts_that_make_no_sense_are_refused(sources: list[Source], tmp_path: Path) -> None:
    for name in ("num_samples", "workers", "shard_size"):
        with pytest.raises(ArtsimError, match="is not a count"):
            make(sources, tmp_path / "out", **{name: 0})
    with pytest.raises(AssetError, match="no objects to show"):
        make([], tmp_path / "out")


def test_folders_are_searched_for_objects(sources: list[Source], tmp_path: Path) -> None:
    assert [s.name for s in sources] == [f"objects/laptop_{i}/mobility.urdf" for i in range(3)]
    (tmp_path / "empty").mkdir()
    with pytest.raises(AssetError, match="no URDF file below this folder"):
        find_sources([tmp_path / "empty"])
    with pytest.raises(AssetError, match="no such file"):
        find_sources([tmp_path / "nowhere"])
    shutil.rmtree(tmp_path / "objects")
    with pytest.raises((AssetError, ConfigError)):
        find_sources([tmp_path / "objects"])
