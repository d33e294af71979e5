"""What verification notices."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import artsim
from artsim import StateOptions, ViewOptions, observe, sample_state, sample_view
from artsim.datasets.description import document_bytes
from artsim.datasets.sample_checks import sample_problems
from artsim.datasets.sample_options import SampleOptions
from artsim.datasets.shards import ShardReader, write_shard
from artsim.datasets.verify import verify
from artsim.loading.sources import find_sources
from artsim.observing.sample import Sample
from artsim.runs.storage import FolderStorage
from tests.conftest import ASSETS


@pytest.fixture(scope="module")
def cabinet() -> artsim.ArticulatedObject:
    return artsim.load(ASSETS / "cabinet")


@pytest.fixture(scope="module")
def sample(cabinet: artsim.ArticulatedObject) -> Sample:
    rng = np.random.default_rng(1)
    q = sample_state(cabinet, StateOptions(), rng)
    return observe(cabinet, q, sample_view(cabinet, q, ViewOptions(), rng), images=("depth", "part_mask"), rng=rng)


def turned(s: Sample) -> Sample:
    T = s.T_camera_part.copy()
    T[1, :3, :3] = T[1, :3, :3] @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    return replace(s, T_camera_part=T)


def sheared(s: Sample) -> Sample:
    T = s.T_camera_part.copy()
    T[:, 0, 0] += 0.01
    return replace(s, T_camera_part=T)


def state(s: Sample, value: float) -> Sample:
    q = s.joint_state.copy()
    q[1] = value
    return replace(s, joint_state=q)


def farther(s: Sample, factor: float) -> Sample:
    """Consistent in itself, and still within the boxes: only the surface itself can tell."""
    points = s.points * np.float32(factor)
    p_rest = np.empty((len(points), 3))
    for k, T in enumerate(np.linalg.inv(s.T_camera_part)):
        p_rest[s.part == k] = (points[s.part == k] @ T[:3, :3].T + T[:3, 3]).astype(np.float64)
    size = np.linalg.norm(s.box_size, axis=1)[s.part, None]
    npcs = (p_rest - s.box_center[s.part]) / size + 0.5
    return replace(s, points=points, npcs=npcs.astype(np.float32), depth=None, part_mask=None)


def relabelled(s: Sample) -> Sample:
    part = s.part.copy()
    part[np.flatnonzero(part == 1)[:30]] = 0
    return replace(s, part=part, depth=None, part_mask=None)


WRONG: dict[str, tuple[Callable[[Sample], Sample], str]] = {
    "a part turned": (turned, "part poses do not follow from the joint states"),
    "a sheared pose": (sheared, "a rotation is not a rotation"),
    "another joint state": (lambda s: state(s, 0.123), "part poses do not follow from the joint states"),
    "a state out of limits": (lambda s: state(s, 9.0), "are outside their limits"),
    "points moved": (lambda s: replace(s, points=s.points + np.float32(0.02)), "outside its box|centre of a pixel"),
    "a point not finite": (lambda s: replace(s, points=s.points * np.float32(np.nan)), "points is not finite"),
    "labels swapped": (lambda s: replace(s, part=(s.part + 1) % 4), "outside its box"),
    "a label of no part": (lambda s: replace(s, part=s.part + 9), "belongs to part"),
    "npcs of another scale": (lambda s: replace(s, npcs=s.npcs * np.float32(1.1)), "npcs of part"),
    "another box": (lambda s: replace(s, box_size=s.box_size * 1.1), "boxes are not those of the object"),
    "a fraction above one": (lambda s: replace(s, visible_fraction=s.visible_fraction + 1), "not within 0..1"),
    "an unseen part with points": (lambda s: replace(s, visible_fraction=s.visible_fraction * 0), "fraction of 0"),
    "another object": (lambda s: replace(s, object_sha256="0" * 64), "shows another object"),
    "a missing label": (lambda s: replace(s, part=s.part[1:]), "points is float32 (2048, 3) instead of"),
    "another depth image": (lambda s: replace(s, depth=np.asarray(s.depth) + 1), "do not agree with the depth image"),
    "another mask": (lambda s: replace(s, part_mask=np.asarray(s.part_mask) + 1), "do not agree with the part mask"),
    "posed axes": (lambda s: replace(s, joint_axis_camera=-s.joint_axis_camera), "posed joint axes do not follow"),
    "points farther along their rays, npcs with them": (lambda s: farther(s, 1.002), "where a ray through their pixel"),
    "some labels of the wrong one of two touching parts": (relabelled, "where a ray through their pixel"),
    "points behind the camera": (lambda s: replace(s, points=-s.points), "behind the camera"),
    "a pose that is no number": (lambda s: replace(s, T_camera_part=s.T_camera_part * np.nan), "T_camera_part is not"),
    "no points": (lambda s: replace(s, points=s.points[:0], part=s.part[:0], npcs=s.npcs[:0]), "has no points"),
    "points in double precision": (lambda s: replace(s, points=s.points.astype(np.float64)), "points is float64"),
    "axes at rest": (lambda s: replace(s, joint_axis=-s.joint_axis), "joints are not those of the object"),
    "other limits": (lambda s: replace(s, joint_limits=s.joint_limits + 1), "joints are not those of the object"),
    "another joint type": (lambda s: replace(s, joint_type=("screw",) * 4), "joints are not those of the object"),
    "another diagonal": (lambda s: replace(s, diagonal=s.diagonal * 2), "the diagonal is not that of the object"),
    "another category": (lambda s: replace(s, category="laptop"), "category or object_id"),
    "other part names": (lambda s: replace(s, part_names=s.part_names[::-1]), "part names are not those"),
    "another camera": (lambda s: replace(s, width=300, depth=None, part_mask=None), "outside the image"),
}


def test_a_sound_sample_has_no_problems(sample: Sample, cabinet: artsim.ArticulatedObject) -> None:
    assert list(sample_problems(sample, cabinet)) == []


@pytest.mark.filterwarnings("ignore:invalid value")
@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_sample_is_noticed(case: str, sample: Sample, cabinet: artsim.ArticulatedObject) -> None:
    spoil, message = WRONG[case]
    problems: list[Any] = list(sample_problems(spoil(sample), cabinet))
    assert any(part in problem for problem in problems for part in message.split("|")), problems


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("verify") / "out"
    options = SampleOptions(num_points=100, images=("depth",), views=ViewOptions(width=80, height=60))
    sources = find_sources([ASSETS / "laptop", ASSETS / "scissors"])
    artsim.generate(sources, out, 12, sample=options, shard_size=4, splits=(1, 0, 0), progress=False)
    return out


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    """A dataset of twelve samples to spoil."""
    shutil.copytree(made, tmp_path / "out")
    return tmp_path / "out"


def rewrite(folder: Path, change: Callable[[list[Sample]], list[Sample]]) -> list[str]:
    """Problems once the first shard holds other samples, with a checksum that says it is right."""
    path, description = folder / "train-000000.tar", json.loads((folder / "dataset.json").read_text())
    reader = ShardReader(path)
    samples = list(map(reader.read, reader.keys()))
    size, sha256 = write_shard(FolderStorage(path.parent), path.name, change(samples))
    description["shards"][0] |= {"bytes": size, "sha256": sha256}
    (folder / "dataset.json").write_bytes(document_bytes(description))
    return [str(problem) for problem in verify(folder, progress=False)]


@pytest.mark.slow
def test_a_sound_dataset_has_no_problems(folder: Path) -> None:
    assert verify(folder, progress=False) == []
    assert rewrite(folder, lambda samples: samples) == []


FORGED: dict[str, tuple[Callable[[Sample], Sample], str]] = {
    "another index": (lambda s: replace(s, seed=8), "sample 1: calls itself sample 1 of seed 8"),
    "fewer points": (lambda s: replace(s, points=s.points[:9], part=s.part[:9], npcs=s.npcs[:9]), "has 9 points"),
    "another renderer": (lambda s: replace(s, renderer="pybullet"), "was drawn by pybullet instead of raycast"),
    "no image": (lambda s: replace(s, depth=None), "has images [] instead of ['depth']"),
    "another scale": (lambda s: replace(s, scale=2.0), "its scale of 2"),
    "no scale": (lambda s: replace(s, scale=-1.0), "an object cannot have scale -1.0"),
    "another camera pose": (lambda s: replace(s, T_world_camera=np.eye(4)), "does not stand on the world's origin"),
    "a width that is none": (lambda s: replace(s, width="wide"), "sample 1: "),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("case", FORGED)
def test_a_sample_that_is_not_of_the_plan_is_noticed(case: str, folder: Path) -> None:
    spoil, message = FORGED[case]
    problems = rewrite(folder, lambda samples: [samples[0], spoil(samples[1]), *samples[2:]])
    assert any(message in problem for problem in problems), problems
    assert all("train-000000.tar: sample 1: " in problem for problem in problems), problems


def test_lost_and_foreign_samples_are_noticed(folder: Path) -> None:
    (lost,) = rewrite(folder, lambda samples: samples[1:])
    assert "train-000000.tar: lacks samples ['000000000']" in lost
    (foreign, *_) = rewrite(folder, lambda samples: [replace(samples[0], index=77), *samples])
    assert "['000000077']" in foreign


def test_files_that_are_not_as_they_were_are_noticed(folder: Path) -> None:
    (folder / "train-000000.tar").unlink()
    whole = (folder / "train-000001.tar").read_bytes()
    (folder / "train-000001.tar").write_bytes(whole[:5000])
    (folder / "train-000009.tar").write_bytes(whole)
    (folder / "objects" / "laptop-laptop.npz").write_bytes(b"PK")
    found = "\n".join(map(str, verify(folder, progress=False)))
    assert "train-000000.tar: is missing" in found
    assert "train-000001.tar: has another checksum than when it was written" in found
    assert "train-000009.tar: is no part of this dataset" in found
    assert "objects/laptop-laptop.npz: " in found
    assert "train-000002.tar" not in found
    assert len(found.splitlines()) < 9


def test_an_exchanged_object_is_noticed(folder: Path) -> None:
    shutil.copy(folder / "objects" / "scissors-scissors.npz", folder / "objects" / "laptop-laptop.npz")
    (found,) = verify(folder, progress=False)
    assert found.where == "objects/laptop-laptop.npz"
    assert found.what == "has another checksum than when it was written"
    assert found.fix == f"artsim repair {folder}"


@pytest.mark.slow
def test_several_processes_find_what_one_finds_in_the_same_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    artsim.generate(
        find_sources([ASSETS / "laptop"]), tmp_path, num_samples=12, shard_size=3, workers=1, progress=False,
        sample=SampleOptions(num_points=32),
    )  # fmt: skip
    shards = sorted(tmp_path.glob("*.tar"))
    assert len(shards) >= 4
    description = json.loads((tmp_path / "dataset.json").read_text())
    for path in (shards[0], shards[-1]):  # sealed again, so that only the samples themselves tell
        reader = ShardReader(path)
        samples = [replace(read, diagonal=2 * read.diagonal) for read in map(reader.read, reader.keys())]
        size, sha256 = write_shard(FolderStorage(path.parent), path.name, samples)
        (record,) = (record for record in description["shards"] if record["name"] == path.name)
        record["size"], record["sha256"] = size, sha256
    (tmp_path / "dataset.json").write_bytes(document_bytes(description))
    monkeypatch.setattr("artsim.datasets.verify._WORTH_A_PROCESS", 1)
    alone = verify(tmp_path, progress=False)
    assert {shards[0].name, shards[-1].name} <= {problem.where.split(":")[0] for problem in alone}
    assert verify(tmp_path, progress=False, workers=2) == alone
