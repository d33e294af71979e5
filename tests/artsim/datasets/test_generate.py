"""Generation runs: reproducible, resumable, and clear when something is wrong."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tarfile
import time
import uuid
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import artsim
from artsim.datasets.plan import SampleOptions
from artsim.datasets.verify import verify
from artsim.errors import ArtsimError, AssetError, ConfigError, DatasetError
from artsim.loading.sources import Source, find_sources
from artsim.model.draws import sample_view
from artsim.model.kinematics import Array
from tests.artsim.datasets.troublesome import digests
from tests.conftest import BOX_LAPTOP, ROOT

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_workers")]

OPTIONS = SampleOptions(num_points=128)


def write_sources(root: Path) -> list[Source]:
    for i in range(3):
        folder = root / "objects" / f"laptop_{i}"
        folder.mkdir(parents=True)
        (folder / "mobility.urdf").write_text(BOX_LAPTOP.replace("0.3 0.4 0.02", f"0.3 0.4 0.0{i + 1}"))
    return find_sources([root / "objects"])


@pytest.fixture
def sources(tmp_path: Path) -> list[Source]:
    """Three different objects of boxes."""
    return write_sources(tmp_path)


@pytest.fixture(scope="module")
def made_once(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[Source], Path]:
    """Objects and a dataset of them that no test changes."""
    root = tmp_path_factory.mktemp("made_once")
    sources = write_sources(root)
    make(sources, root / "out", workers=1)
    return sources, root / "out"


def make(sources: list[Source], out: Path, **options: object) -> artsim.datasets.generate.GenerateResult:
    defaults = {"num_samples": 60, "sample": OPTIONS, "shard_size": 10, "progress": False, "splits": (1, 1, 1)}
    return artsim.generate(sources, out, **{**defaults, **options})  # type: ignore[arg-type]


def names(folder: Path) -> set[str]:
    return {p.name for p in folder.iterdir() if p.suffix != ".tar"}


COMPLETE = {".lock", ".sources.json", "dataset.json", "objects", "plan.json"}


def command(sources_folder: Path, out: Path, *more: str) -> list[str]:
    return [
        sys.executable, str(ROOT / "generate.py"), "--objects", str(sources_folder), "--out", str(out),
        "--num-samples", "1500", "--num-points", "128", "--shard-size", "16", "--workers", "2", *more,
    ]  # fmt: skip


def wait_until(condition: Callable[[], bool]) -> None:
    for _ in range(1200):
        if condition():
            return
        time.sleep(0.05)
    raise AssertionError("waited for a minute")


def wait_for_shards(out: Path, count: int) -> None:
    wait_until(lambda: (out / ".parts").exists() and len(list(out.glob("*.tar"))) >= count)


def test_shards_are_byte_identical_whatever_the_number_of_workers(
    sources: list[Source], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of new processes, too, which import everything themselves, as runs of users do."""
    copies = make(sources, tmp_path / "copies", workers=5)
    monkeypatch.undo()
    made = [make(sources, tmp_path / str(workers), workers=workers) for workers in (1, 2)]
    first, *others = [digests(result.folder) for result in (*made, copies)]
    assert len([name for name in first if name.endswith(".tar")]) == 6
    assert all(other == first for other in others)


def test_a_killed_run_resumes_to_the_same_bytes(sources: list[Source], tmp_path: Path) -> None:
    out, whole, objects = tmp_path / "killed", tmp_path / "whole", tmp_path / "objects"
    for shards in (0, 3, 40):
        process = subprocess.Popen(command(objects, out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wait_for_shards(out, shards)
        process.kill()  # the parent alone: its workers must notice by themselves
        process.wait()
    subprocess.run(command(objects, out), check=True, capture_output=True)
    subprocess.run(command(objects, whole), check=True, capture_output=True)
    assert digests(out) == digests(whole)
    assert names(out) == COMPLETE
    members: list[str] = []
    for path in out.glob("*.tar"):
        with tarfile.open(path) as tar:
            members += [name for name in tar.getnames() if name.endswith(".json")]
    assert sorted(members) == [f"{i:09d}.json" for i in range(1500)]


def test_workers_do_not_outlive_their_parent(sources: list[Source], tmp_path: Path) -> None:
    mark = f"ARTSIM_TEST={uuid.uuid4().hex}"
    name, _, value = mark.partition("=")
    process = subprocess.Popen(
        command(tmp_path / "objects", tmp_path / "out"),
        env={**os.environ, name: value},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    wait_for_shards(tmp_path / "out", 1)
    assert len(marked(mark)) >= 3
    process.kill()
    process.wait()
    wait_until(lambda: not marked(mark))


def marked(mark: str) -> list[int]:
    """Processes with an entry in their environment."""
    found = []
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError):
            if entry.name.isdigit() and mark.encode() in (entry / "environ").read_bytes():
                found.append(int(entry.name))
    return found


@pytest.mark.parametrize("shards", [0, 2])
def test_ctrl_c_stops_quietly_and_says_how_to_go_on(shards: int, sources: list[Source], tmp_path: Path) -> None:
    out, objects = tmp_path / "out", tmp_path / "objects"
    process = subprocess.Popen(
        command(objects, out), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a job in the background ignores Ctrl-C
    )  # fmt: skip
    wait_for_shards(out, shards)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to every process of the group
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "rerun the command to resume" in errors
    assert "Traceback" not in errors
    assert not list(out.glob("**/.*.part"))
    if shards:
        again = subprocess.run(command(objects, out), check=True, capture_output=True, text=True)
        assert "1500 samples" in again.stderr
        assert len(list(artsim.open_dataset(out))) == 1500


def test_a_finished_dataset_is_left_alone(sources: list[Source], tmp_path: Path) -> None:
    make(sources, tmp_path / "out")
    before = {p: p.stat().st_mtime_ns for p in (tmp_path / "out").glob("*.tar")}
    assert make(sources, tmp_path / "out").made == 0
    assert before == {p: p.stat().st_mtime_ns for p in (tmp_path / "out").glob("*.tar")}


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"seed": 1}, "seed"),
        ({"num_samples": 59}, "num_samples"),
        ({"shard_size": 11}, "shard_size"),
        ({"splits": (1, 0, 0)}, "fractions"),
        ({"sample": SampleOptions(num_points=129)}, "sample.num_points"),
        ({"sample": SampleOptions(128, views=artsim.ViewOptions(fov=50.0))}, "sample.views.fov"),
    ],
)
def test_another_plan_is_refused(change: dict[str, object], named: str, made_once: tuple[list[Source], Path]) -> None:
    sources, out = made_once
    before = digests(out)
    with pytest.raises(DatasetError, match=rf"another plan \(different: {named}\)"):
        make(sources, out, **change)
    with pytest.raises(DatasetError, match=r"another plan \(different: objects\)"):
        make(sources[:2], out)
    assert digests(out) == before


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
    (tmp_path / "mine" / "thesis.tex").unlink()
    (tmp_path / "mine" / "objects" / "laptop").mkdir(parents=True)
    with pytest.raises(DatasetError, match=r"already holds 'objects/laptop'"):
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
    with pytest.raises(AssetError, match=r"1 of 3 objects do not load: .*laptop_1.*has no <link>"):
        make(found, tmp_path / "out")
    result = make(found, tmp_path / "out", skip_broken=True)
    assert "laptop_1" in result.left_out[0]
    assert len(artsim.open_dataset(result.folder).plan.objects) == 2
    again = make(found, tmp_path / "out", skip_broken=True)
    assert again.made == 0
    assert again.left_out == result.left_out


def test_the_same_object_twice_counts_once(sources: list[Source], tmp_path: Path) -> None:
    result = make([*sources, *sources], tmp_path / "out")
    assert len(artsim.open_dataset(result.folder).plan.objects) == 3
    assert len(list((tmp_path / "out" / "objects").iterdir())) == 3
    assert make([*sources, *sources], tmp_path / "out").made == 0
    assert make(sources, tmp_path / "out").made == 0


def test_files_of_one_name_are_different_objects(sources: list[Source], tmp_path: Path) -> None:
    """Two sources may have the same name: the folders' names are all that tells them apart, or not even those."""
    same = [replace(source, name="mobility.urdf") for source in sources]
    dataset = artsim.open_dataset(make(same, tmp_path / "out").folder)
    assert len({o.sha256 for o in dataset.plan.objects}) == 3
    assert verify(tmp_path / "out", progress=False) == []


def test_unwritable_places_are_clear_errors(sources: list[Source], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ArtsimError, match="it is a file, where a folder"):
        make(sources, tmp_path / "file" / "out")


def test_an_object_that_cannot_be_written_is_not_a_broken_one(sources: list[Source], tmp_path: Path) -> None:
    """A full disk while objects are compiled must never end in a dataset without them."""
    digest = make(sources, tmp_path / "straight").objects[1].file_sha256
    in_the_way = tmp_path / "out" / ".parts" / "objects" / f"{digest}.npz"
    in_the_way.mkdir(parents=True)
    with pytest.raises(ConfigError, match=r"npz: it is a folder"):
        make(sources, tmp_path / "out", skip_broken=True)
    in_the_way.rmdir()
    make(sources, tmp_path / "out", skip_broken=True)
    assert len(artsim.open_dataset(tmp_path / "out").plan.objects) == 3


def test_a_full_disk_is_a_clear_error_and_nothing_is_left_half_written(sources: list[Source], tmp_path: Path) -> None:
    """A limit on the size of files stands in for a full disk: the same system call fails in the same place."""
    code = (
        "import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, resource.RLIM_INFINITY));"
        "sys.argv[0] = 'generate.py'; from artsim.commands.verbs import generate_main; generate_main()"
    )
    out = tmp_path / "out"
    whole = command(tmp_path / "objects", out, "--skip-broken")
    whole[whole.index("1500")] = "40"
    result = subprocess.run(
        [sys.executable, "-c", code, *whole[2:]], capture_output=True, text=True, cwd=ROOT, timeout=60
    )
    assert result.returncode == 2, result.stderr
    assert "error:" in result.stderr
    assert "cannot write (File too large)" in result.stderr
    assert "Traceback" not in result.stderr
    assert list(out.glob("*.tar")) == []
    assert list(out.glob("**/.*.part")) == []
    subprocess.run(whole, check=True, capture_output=True)
    assert len(artsim.open_dataset(out).plan.objects) == 3
    assert verify(out, progress=False) == []


def test_a_worker_that_dies_is_a_clear_error(
    sources: list[Source], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A view function that kills its process is what running out of memory looks like."""
    options = SampleOptions(num_points=16, views=artsim.ViewOptions(custom="tests.artsim.datasets.test_generate:die"))
    monkeypatch.setenv("ARTSIM_TEST_DIE", "1")
    with pytest.raises(AssetError, match=r"laptop_1.*a worker process died of it \(SIGKILL: out of memory\?\)"):
        make(sources, tmp_path / "out", sample=options)
    monkeypatch.setenv("ARTSIM_TEST_DIE", str(tmp_path / "out" / "plan.json"))  # once it is there
    with pytest.raises(DatasetError, match=r"a worker process died of it.* while .*\.tar was made"):
        make(sources, tmp_path / "out", sample=options)
    monkeypatch.delenv("ARTSIM_TEST_DIE")
    make(sources, tmp_path / "out", sample=options)
    assert verify(tmp_path / "out", progress=False) == []
    assert names(tmp_path / "out") == COMPLETE


def die(rng: np.random.Generator, obj: artsim.ArticulatedObject, q: Array) -> artsim.Camera:
    when = os.environ.get("ARTSIM_TEST_DIE")
    if when == "1" or (when is not None and Path(when).exists()):
        os.kill(os.getpid(), signal.SIGKILL)
    return sample_view(obj, q, artsim.ViewOptions(), rng)


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


def test_damaged_descriptions_are_clear_errors_or_written_again(sources: list[Source], tmp_path: Path) -> None:
    out = tmp_path / "out"
    make(sources, out)
    before = digests(out)
    (out / "dataset.json").write_text('{"format": 1, "seed"')
    with pytest.raises(DatasetError, match=r"dataset\.json is damaged"):
        artsim.open_dataset(out)
    make(sources, out)
    assert digests(out) == before
    (out / "plan.json").write_text('{"format": 1, "seed"')
    assert make(sources, out).restored == ("plan.json",)
    assert digests(out) == before
    for name in ("dataset.json", "plan.json"):
        (out / name).write_text('{"format": 1, "seed"')
    with pytest.raises(DatasetError, match=r"is damaged"):
        make(sources, out)


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ({"num_samples": 0}, "num_samples: 0 is not a count"),
        ({"workers": 0}, "workers: 0 is not a count"),
        ({"shard_size": -1}, "shard_size: -1 is not a count"),
        ({"seed": -1}, "-1 is not a seed"),
        ({"splits": (0, 0, 0)}, "are not shares"),
        ({"splits": (float("nan"), 1, 1)}, "are not shares"),
    ],
)
def test_options_that_make_no_sense_are_refused_at_once(
    option: dict[str, object], message: str, sources: list[Source], tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=message):
        make(sources, tmp_path / "out", **option)
    with pytest.raises(AssetError, match="no objects to show"):
        make([], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_folders_are_searched_for_objects(sources: list[Source], tmp_path: Path) -> None:
    assert [s.name for s in sources] == [f"objects/laptop_{i}/mobility.urdf" for i in range(3)]
    (tmp_path / "empty").mkdir()
    with pytest.raises(AssetError, match="no URDF, MJCF, USD or joint file below this folder"):
        find_sources([tmp_path / "empty"])
    with pytest.raises(AssetError, match="no such file"):
        find_sources([tmp_path / "nowhere"])
    (tmp_path / "linked").mkdir()
    (tmp_path / "linked" / "one").symlink_to(tmp_path / "objects" / "laptop_1")
    (tmp_path / "linked" / "circle").symlink_to(tmp_path / "linked")
    assert [s.name for s in find_sources([tmp_path / "linked"])] == ["linked/one/mobility.urdf"]
    assert find_sources([sources[0].path])[0].name == "laptop_0/mobility.urdf"


def test_objects_that_a_killed_run_has_prepared_are_not_loaded_again(sources: list[Source], tmp_path: Path) -> None:
    """A run of real files is killed after some objects; the next one loads the others, and makes the same bytes."""
    straight, out = tmp_path / "straight", tmp_path / "out"
    files = {planned.source: planned.file_sha256 for planned in make(sources, straight).objects}
    first, second, last = (f"{files[source.name]}.npz" for source in sources)
    prepared = out / ".parts" / "objects"
    (prepared / last).mkdir(parents=True)  # the last object cannot be written
    with pytest.raises(ConfigError, match=rf"{last}: it is a folder"):
        make(sources, out, workers=1)
    (prepared / last).rmdir()
    records = sorted(prepared.glob("*.json"))
    assert [json.loads(record.read_text())["answers"][0]["file_sha256"] for record in records] == [
        first[:-4],
        second[:-4],
    ]
    records[1].write_bytes(records[1].read_bytes()[:50])
    times = {path.name: path.stat().st_mtime_ns for path in prepared.glob("*.npz")}
    for planned in make(sources, out).objects:
        compiled = (out / planned.file).stat().st_mtime_ns
        assert (compiled == times[first]) == (planned.source == sources[0].name)
    assert not prepared.exists()
    assert digests(out) == digests(straight)
