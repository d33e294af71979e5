"""Frozen datasets: a small manifest from which everybody makes the same procedural objects and samples again.

Each split is a dataset of its own, in a folder of its name, so that one of them can be made alone.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

from artsim.common.files import read_json
from artsim.common.json_records import SHA256, from_json_values
from artsim.common.tables import first_of
from artsim.datasets.dataset import Dataset
from artsim.datasets.generate import generate
from artsim.datasets.sample_options import SampleOptions
from artsim.datasets.splits import SPLITS
from artsim.errors import ConfigError, DatasetError
from artsim.loading.family_source import FamilySource
from artsim.runs.tasks import RunResult

_DIGEST = re.compile(r"[0-9a-f]{12}")
"""The start of a SHA-256: a chance of 1e-10 that two of ten thousand objects share one."""
_MAX_BYTES = 16_000_000
_LISTED = 5

Splits = Mapping[str, Mapping[str, Annotated[str, _DIGEST]]]


@dataclass(frozen=True)
class Manifest:
    """All that a frozen dataset follows from, and digests of what has to come out."""

    name: str
    about: str
    """What it is, where it is from, and what it is for."""
    licence: str
    """An SPDX expression."""
    artsim_version: str
    """That the digests are of."""
    seed: Annotated[int, range(2**63)]
    views: Annotated[int, range(1, 1_000_001)]
    """Samples of each object."""
    sample: SampleOptions
    objects: Mapping[str, Splits]
    """Split -> category -> seed -> first 12 digits of the SHA-256 of the object's file."""
    shards: Mapping[str, Annotated[str, SHA256]]
    """SHA-256 of each tar file, by its path: ``test/test-000000.tar``."""

    def sources(self, split: str) -> list[FamilySource]:
        """Procedural objects of a split.

        Raises
        ------
        ConfigError
            When it has no such split.
        """
        if split not in self.objects:
            raise ConfigError(f"{self.name} has no split {split!r:.40}", "splits", f"use {', '.join(self.objects)}")
        return [FamilySource(category, int(n)) for category, own in self.objects[split].items() for n in own]


def read_manifest(name: str | Path) -> Manifest:
    """The manifest that the package has by this name, such as ``artsim-10k``, or that of a file.

    Raises
    ------
    ConfigError
        When there is none, or it is damaged.
    """
    packed = {path.stem: path for path in sorted(Path(__file__).parent.glob("*.json"))}
    path = packed.get(str(name), Path(name))
    if not path.is_file():
        fix = f"use {', '.join(packed)}, or a manifest's file"
        raise ConfigError(f"there is no frozen dataset {str(name)!r:.80}", "dataset", fix)
    try:
        manifest = from_json_values(Manifest, read_json(path, "manifest", ConfigError, _MAX_BYTES))
        if not manifest.objects or any(split not in SPLITS for split in manifest.objects):
            raise ValueError(f"its splits are {', '.join(manifest.objects)!r:.80}")
        for split in manifest.objects:
            for source in manifest.sources(split):
                if FamilySource.named(source.name) != source:
                    raise ValueError(f"there is no object {source.name!r:.80}")
    except ValueError as error:
        raise ConfigError(f"not a manifest ({error})", path, "restore the file") from error
    return manifest


def make_frozen(
    manifest: Manifest, out: str | Path, splits: Sequence[str] = (), workers: int = 2, progress: bool = True
) -> RunResult:
    """Make splits of a frozen dataset, or resume that, and compare all that came out with the manifest.

    Parameters
    ----------
    manifest : Manifest
    out : path
        Folder, made if missing. Split ``test`` becomes the dataset ``<out>/test``.
    splits : sequence of str
        By default all.
    workers : int
        Processes. The result does not depend on it.
    progress : bool
        Show progress bars.

    Raises
    ------
    ConfigError
        When there is no such split.
    DatasetError
        When a folder holds something else, or what came out differs from the manifest.
    """
    result = RunResult(Path(out), 0, 0, 0.0)
    asked = {split: manifest.sources(split) for split in splits or manifest.objects}
    for split, sources in asked.items():
        shares = tuple(float(name == split) for name in SPLITS)
        made = generate(
            sources, result.folder / split, len(sources) * manifest.views, manifest.seed, manifest.sample, workers,
            splits=(shares[0], shares[1], shares[2]), progress=progress,
        )  # fmt: skip
        _compare(manifest, split, result.folder / split)
        result = replace(
            result, total=result.total + made.num_samples, made=result.made + made.made,
            seconds=result.seconds + made.seconds,
        )  # fmt: skip
    return result


def frozen_name(dataset: Dataset) -> str:
    """Name and split of the frozen dataset of this package that this is, such as ``ArtSim-10K, test``; else empty."""
    found = {planned.source: planned.file_sha256[:12] for planned in dataset.plan.objects}
    for path in sorted(Path(__file__).parent.glob("*.json")):
        manifest = read_manifest(path)
        for split in manifest.objects:
            wanted = {s.name: manifest.objects[split][s.category][str(s.seed)] for s in manifest.sources(split)}
            options = manifest.seed, manifest.views * len(wanted), manifest.sample
            if wanted == found and options == (dataset.plan.seed, dataset.plan.num_samples, dataset.plan.sample):
                return f"{manifest.name}, {split}"
    return ""


def freeze(manifest: Manifest, folder: Path) -> Manifest:
    """The manifest with the digests of what this version of artsim made of it, in ``folder``."""
    objects: dict[str, dict[str, dict[str, str]]] = {}
    shards: dict[str, str] = {}
    for split in manifest.objects:
        dataset = Dataset(folder / split)
        found = {planned.source: planned.file_sha256[:12] for planned in dataset.plan.objects}
        for source in manifest.sources(split):
            objects.setdefault(split, {}).setdefault(source.category, {})[str(source.seed)] = found[source.name]
        shards |= {f"{split}/{shard.name}": shard.sha256 for shard in dataset.shards}
    return replace(manifest, artsim_version=version("artsim"), objects=objects, shards=shards)


def _compare(manifest: Manifest, split: str, folder: Path) -> None:
    """Refuse a dataset that differs from the manifest.

    A sample's record names the version of artsim: shards are compared where that is the manifest's. A manifest that is
    about to be frozen has no digests.
    """
    found = freeze(replace(manifest, objects={split: manifest.objects[split]}), folder.parent)
    wrong = [
        f"{category}:{number}"
        for category, own in manifest.objects[split].items()
        for number, digest in own.items()
        if digest and found.objects[split][category][number] != digest
    ]
    if found.artsim_version == manifest.artsim_version:
        wrong += [name for name, digest in found.shards.items() if manifest.shards.get(name, digest) != digest]
    if wrong:
        what = f"{len(wrong)} files differ from {manifest.name}: {first_of(wrong, _LISTED)}"
        raise DatasetError(what, folder, f"use artsim {manifest.artsim_version} and the versions of constraints.txt")
