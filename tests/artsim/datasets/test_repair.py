"""Damage to a dataset: all of it is found, and repaired to the same bytes or refused with the reason."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import artsim
from artsim.common.files import write_atomic
from artsim.datasets.description import document_bytes
from artsim.datasets.repair import repair
from artsim.datasets.sample_options import SampleOptions
from artsim.datasets.verify import verify
from artsim.errors import ArtsimError, DatasetError
from artsim.loading.sources import Source, family_sources, find_sources
from tests.artsim.datasets.troublesome import digests
from tests.conftest import BOX_LAPTOP

pytestmark = pytest.mark.usefixtures("quick_workers")

OPTIONS = SampleOptions(num_points=32)
SHARD, OTHER = "train-000000.tar", "train-000001.tar"
MADE, LOADED = "objects/drawer-1.npz", "objects/unknown-box_laptop.npz"


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> list[Source]:
    """Two procedural objects of each of two categories, and one from a file."""
    path = tmp_path_factory.mktemp("sources") / "box_laptop.urdf"
    path.write_text(BOX_LAPTOP)
    return [*family_sources(["laptop", "drawer"], 2), *find_sources([path])]


@pytest.fixture(scope="module")
def sound(sources: list[Source], tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("sound") / "out"
    artsim.generate(sources, out, 60, sample=OPTIONS, shard_size=8, splits=(1, 0, 1), workers=1, progress=False)
    return out


@pytest.fixture
def folder(sound: Path, tmp_path: Path) -> Path:
    """A sound dataset to damage."""
    shutil.copytree(sound, tmp_path / "out")
    return tmp_path / "out"


def flip(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def swap(one: Path, two: Path) -> None:
    first = one.read_bytes()
    one.write_bytes(two.read_bytes())
    two.write_bytes(first)


def replaced_by_folder(path: Path, holding: str | None) -> None:
    path.unlink()
    path.mkdir()
    if holding:
        (path / holding).write_text("precious")


def replaced_by_link(path: Path) -> None:
    elsewhere = path.parent.parent / f"elsewhere_{path.name}"
    path.rename(elsewhere)
    path.symlink_to(elsewhere)


def replaced_by_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def forged_header(path: Path) -> None:
    with np.load(path) as archive:
        arrays = dict(archive)
    header = json.loads(arrays["header"].tobytes())
    header["category"] = "lapdog"
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    with path.open("wb") as file:
        np.savez(file, **arrays)


def edited(path: Path, change: Callable[[Any], object]) -> None:
    """The description with something changed, as an editor would leave it."""
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))


def forged(path: Path, change: Callable[[Any], object]) -> None:
    """The description with something changed, and a digest that says it is right."""
    document = json.loads(path.read_text())
    change(document)
    path.write_bytes(document_bytes(document))


def set_at(*keys: Any) -> Callable[[Any], None]:
    """Sets the value given last at the keys before."""
    *way, last, value = keys

    def change(document: Any) -> None:
        for key in way:
            document = document[key]
        document[last] = value

    return change


@dataclass(frozen=True)
class Damage:
    """What is done to a folder, what finds it, and what becomes of it."""

    do: Callable[[Path], object]
    found: str
    refused: str | None = None
    """Why it cannot be repaired, if it cannot."""


DESCRIPTION_DAMAGED = "dataset.json"
DAMAGES = {
    "a flipped bit in a shard": Damage(lambda f: flip(f / SHARD), f"{SHARD}: has another checksum"),
    "a shard cut short": Damage(lambda f: cut(f / SHARD), f"{SHARD}: has another checksum"),
    "an empty shard": Damage(lambda f: (f / SHARD).write_bytes(b""), f"{SHARD}: has another checksum"),
    "a missing shard": Damage(lambda f: (f / SHARD).unlink(), f"{SHARD}: is missing"),
    "two shards under each other's names": Damage(lambda f: swap(f / SHARD, f / OTHER), f"{OTHER}: has another"),
    "a foreign shard": Damage(
        lambda f: shutil.copy(f / SHARD, f / "train-000077.tar"), "train-000077.tar: is no part", "is no part"
    ),
    "an empty folder in place of a shard": Damage(lambda f: replaced_by_folder(f / SHARD, None), "is a folder"),
    "a folder that holds something in place of a shard": Damage(
        lambda f: replaced_by_folder(f / SHARD, "thesis.tex"), f"{SHARD}: is a folder", "move it away"
    ),
    "a link in place of a shard": Damage(lambda f: replaced_by_link(f / SHARD), f"{SHARD}: is a link"),
    "a pipe in place of a shard": Damage(lambda f: replaced_by_pipe(f / SHARD), f"{SHARD}: is no regular file"),
    "a flipped bit in an object": Damage(lambda f: flip(f / MADE), f"{MADE}: has another checksum"),
    "an object cut short": Damage(lambda f: cut(f / MADE), f"{MADE}: has another checksum"),
    "a missing object": Damage(lambda f: (f / MADE).unlink(), f"{MADE}: is missing"),
    "a missing object that came from a file": Damage(lambda f: (f / LOADED).unlink(), f"{LOADED}: is missing"),
    "another object in its place": Damage(
        lambda f: shutil.copy(f / "objects/laptop-0.npz", f / MADE), f"{MADE}: has another checksum"
    ),
    "an object with a forged header": Damage(lambda f: forged_header(f / MADE), f"{MADE}: has another checksum"),
    "a foreign object": Damage(
        lambda f: shutil.copy(f / MADE, f / "objects/mine.npz"), "objects/mine.npz: is no part", "is no part"
    ),
    "no objects at all": Damage(lambda f: shutil.rmtree(f / "objects"), f"{MADE}: is missing"),
    "no dataset.json": Damage(lambda f: (f / "dataset.json").unlink(), "the dataset is not complete"),
    "dataset.json cut short": Damage(lambda f: cut(f / "dataset.json"), "dataset.json: is damaged"),
    "dataset.json is empty": Damage(lambda f: (f / "dataset.json").write_text(""), "dataset.json: is damaged"),
    "a wrong checksum in dataset.json": Damage(
        lambda f: edited(f / "dataset.json", set_at("shards", 0, "sha256", "0" * 64)), "it is not as it was written"
    ),
    "a wrong split in dataset.json": Damage(
        lambda f: edited(f / "dataset.json", set_at("objects", 0, "split", "val")), "it is not as it was written"
    ),
    "an unknown key in dataset.json": Damage(
        lambda f: edited(f / "dataset.json", set_at("colour", "red")), "it has no key colour"
    ),
    "dataset.json nested deeply": Damage(
        lambda f: (f / "dataset.json").write_text("[" * 100_000), "dataset.json: is damaged"
    ),
    "a forged number of samples": Damage(
        lambda f: forged(f / "dataset.json", set_at("num_samples", 999_999_999)),
        "it has 125000000 shards, over 1000000",
    ),
    "a forged split in dataset.json": Damage(
        lambda f: forged(f / "dataset.json", set_at("shards", 0, "split", "test")), "dataset.json: is damaged"
    ),
    "a shard of dataset.json outside the folder": Damage(
        lambda f: forged(f / "dataset.json", set_at("shards", 0, "name", "../../etc/x.tar")), "name is"
    ),
    "an object of dataset.json outside the folder": Damage(
        lambda f: forged(f / "dataset.json", set_at("objects", 0, "key", "../../x")), "key is"
    ),
    "no plan.json": Damage(lambda f: (f / "plan.json").unlink(), "plan.json: is missing"),
    "plan.json cut short": Damage(lambda f: cut(f / "plan.json"), "plan.json: is damaged"),
    "plan.json of another dataset": Damage(
        lambda f: forged(f / "plan.json", set_at("seed", 7)), "plan.json: is not the plan of dataset.json"
    ),
    "garbage in a journal": Damage(
        lambda f: (f / "progress.jsonl").write_bytes(b'{"name": 3}\n\xff[[[' * 9), "progress.jsonl: is left over"
    ),
    "files of a killed run": Damage(
        lambda f: [write_atomic(f / name, b"x") for name in (f".{SHARD}.12.part", "objects/.prepared/3.npz")],
        "objects/.prepared/3.npz: is left over",
    ),
}


def problems(folder: Path) -> str:
    """What verification says, which writes nothing."""
    before = sorted((p.relative_to(folder), p.lstat().st_mtime_ns) for p in folder.rglob("*"))
    try:
        found = "\n".join(map(str, verify(folder, progress=False)))
    except DatasetError as error:
        found = str(error)
    assert before == sorted((p.relative_to(folder), p.lstat().st_mtime_ns) for p in folder.rglob("*"))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("case", DAMAGES)
def test_damage_is_found_and_repaired_or_refused(case: str, folder: Path, sound: Path) -> None:
    damage = DAMAGES[case]
    assert problems(folder) == ""
    damage.do(folder)
    found = problems(folder)
    assert damage.found in found
    assert all("Fix: " in line for line in found.splitlines())
    result = repair(folder, workers=1, progress=False)
    if damage.refused is None:
        assert result.restored or not result.failed
        assert result.failed == ()
        assert problems(folder) == ""
        assert digests(folder) == digests(sound)
        assert not list(folder.glob("**/.*.part"))
        assert not (folder / SHARD).is_symlink()
    else:
        assert damage.refused in str(result.failed[0])
        assert problems(folder) == found
    assert repair(folder, workers=1, progress=False).restored == ()


def test_there_are_more_than_twenty_kinds_of_damage() -> None:
    assert len(DAMAGES) >= 20


@pytest.mark.slow
def test_the_same_generate_command_repairs_too(folder: Path, sound: Path, sources: list[Source]) -> None:
    (folder / MADE).unlink()
    flip(folder / SHARD)  # of the right size: only its sum tells
    cut(folder / "plan.json")
    again = artsim.generate(
        sources, folder, 60, sample=OPTIONS, shard_size=8, splits=(1, 0, 1), workers=1, progress=False
    )
    assert again.made == 8
    assert set(again.restored) == {"plan.json", MADE, SHARD}
    assert digests(folder) == digests(sound)


@pytest.mark.parametrize("gone", [True, False])
def test_an_object_whose_source_is_gone_or_changed_is_not_restored(
    gone: bool, folder: Path, sources: list[Source], tmp_path: Path
) -> None:
    """Unless somebody says where the source lies now."""
    original = Path(sources[-1].path)  # type: ignore[union-attr]
    noted, moved = folder / ".sources.json", tmp_path / "moved"
    if gone:
        noted.write_text(noted.read_text().replace("box_laptop", "nowhere"))
    else:
        changed = tmp_path / "box_laptop.urdf"
        changed.write_text(BOX_LAPTOP.replace("2.2", "2.0"))
        noted.write_text(noted.read_text().replace(str(original), str(changed)))
    (folder / LOADED).unlink()
    (shown,) = (o.split for o in artsim.open_dataset(folder).plan.objects if o.file == LOADED)
    (folder / f"{shown}-000000.tar").unlink()
    result = repair(folder, workers=1, progress=False)
    assert [problem.where for problem in result.failed] == [LOADED, f"{shown}-000000.tar"]
    assert "is gone or has changed" in result.failed[0].what
    assert "artsim repair --objects PATH" in str(result.failed[0])
    assert "it shows objects that are lost, such as unknown-box_laptop" in result.failed[1].what
    assert artsim.open_dataset(folder, "test" if shown == "train" else "train")[0]  # what is sound stays of use
    moved.mkdir()
    shutil.copy(original, moved)
    assert repair(folder, find_sources([moved]), workers=1, progress=False).failed == ()
    assert verify(folder, progress=False) == []


def test_bytes_that_come_out_otherwise_are_never_put_in_place(folder: Path) -> None:
    """As on a processor that rounds otherwise; here, the description asks for what nobody can make."""
    for name in ("dataset.json", "plan.json"):
        (folder / name).write_bytes((folder / name).read_bytes())
    forged(folder / "dataset.json", set_at("shards", 0, "sha256", "0" * 64))
    before = (folder / SHARD).read_bytes()
    (problem,) = repair(folder, workers=1, progress=False).failed
    assert problem.where == SHARD
    assert "regenerated, it has another checksum (another processor, or another version" in problem.what
    assert (folder / SHARD).read_bytes() == before


def test_repair_runs_no_code_that_a_dataset_names(folder: Path) -> None:
    for name in ("dataset.json", "plan.json"):
        forged(folder / name, set_at("sample", "views", "custom", "this:never"))
    (folder / SHARD).unlink()
    with pytest.raises(DatasetError, match="is not run because a dataset names it"):
        repair(folder, workers=1, progress=False)


def test_a_stopped_run_is_completed(folder: Path, sound: Path) -> None:
    shards = json.loads((folder / "dataset.json").read_text())["shards"]
    for shard in shards[:-1]:
        write_atomic(folder / ".parts" / "shards" / f"{shard['name']}.json", json.dumps(shard).encode())
    (folder / "dataset.json").unlink()
    kept = (folder / SHARD).stat().st_mtime_ns
    assert repair(folder, workers=1, progress=False).restored == (shards[-1]["name"], "dataset.json")
    assert (folder / SHARD).stat().st_mtime_ns == kept
    assert digests(folder) == digests(sound)


def test_nothing_that_says_what_a_dataset_was_is_a_clear_error(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="no dataset here"):
        repair(tmp_path / "nowhere")
    cut(folder / "dataset.json")
    cut(folder / "plan.json")
    with pytest.raises(DatasetError, match=r"dataset\.json is damaged"):
        repair(folder)


def mutated(value: Any, rng: np.random.Generator) -> Any:
    """A JSON document in which something is something else."""
    wrong = [None, -1, 2**63, 1e308, "", "../x", "\x1b[2J", [], {}, [[]], True, 0.5, "a" * 300]
    if rng.random() < 0.2 or not isinstance(value, dict | list) or not value:
        return wrong[rng.integers(len(wrong))]
    copy = dict(value) if isinstance(value, dict) else list(value)
    keys: list[Any] = list(copy) if isinstance(copy, dict) else list(range(len(copy)))
    key = keys[rng.integers(len(keys))]
    if rng.random() < 0.2:
        del copy[key]
    else:
        copy[key] = mutated(copy[key], rng)
    return copy


def test_no_forged_description_ends_in_anything_but_a_clear_error(folder: Path) -> None:
    rng = np.random.default_rng(0)
    for name in ("dataset.json", "plan.json"):
        document = json.loads((folder / name).read_text())
        for _ in range(300):
            changed = mutated(document, rng)
            sealed = isinstance(changed, dict) and rng.random() < 0.8
            (folder / name).write_bytes(document_bytes(changed) if sealed else json.dumps(changed).encode())
            try:
                text = str(artsim.open_dataset(folder))
            except ArtsimError as error:
                text = str(error)
            assert "\x1b" not in text
        (folder / name).write_text(json.dumps(document))


def test_a_dataset_is_read_without_being_written_to(folder: Path, sources: list[Source]) -> None:
    """Not even a lock, which a read-only folder would not take."""
    (folder / ".lock").unlink()
    before = sorted((p, p.stat().st_mtime_ns) for p in [folder, *folder.rglob("*")])
    assert len(list(artsim.open_dataset(folder))) == 60
    assert verify(folder, progress=False) == []
    assert repair(folder, progress=False).restored == ()
    options = {"sample": OPTIONS, "shard_size": 8, "splits": (1, 0, 1), "progress": False}
    assert artsim.generate(sources, folder, 60, **options).made == 0  # type: ignore[arg-type]
    assert before == sorted((p, p.stat().st_mtime_ns) for p in [folder, *folder.rglob("*")])


def test_other_formats_are_refused_by_number(folder: Path) -> None:
    edited(folder / "dataset.json", set_at("format", 99))
    with pytest.raises(DatasetError, match="format 99 is not 2"):
        artsim.open_dataset(folder)


def test_a_dataset_of_another_format_is_refused(folder: Path, sources: list[Source]) -> None:
    for name in ("dataset.json", "plan.json"):
        document = json.loads((folder / name).read_text())
        (folder / name).write_text(json.dumps({**document, "format": 1}))
    with pytest.raises(DatasetError, match=r"format 1 is not 2.*read it with the artsim that wrote it"):
        artsim.open_dataset(folder)
    with pytest.raises(DatasetError, match="format 1 is not 2"):
        artsim.generate(sources, folder, 60, sample=OPTIONS, shard_size=8, splits=(1, 0, 1), progress=False)
    with pytest.raises(DatasetError, match="format 1 is not 2"):
        repair(folder, progress=False)
