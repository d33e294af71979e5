"""Freezing ArtSim-10K, or making it again: ``python -m benchmarks.artsim_10k --out FOLDER``.

With ``--freeze`` it writes the manifest of the package. The last line is one JSON object: what was made, in how many
minutes.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import tyro

from artsim import datasets
from artsim.common.files import write_atomic
from artsim.datasets.frozen import Manifest, freeze, make_frozen, read_manifest
from artsim.datasets.sample_options import SampleOptions
from artsim.datasets.splits import SPLITS, assign_splits
from artsim.families import FAMILIES
from artsim.loading.sources import family_sources

MANIFEST = Path(datasets.__file__).with_name("artsim-10k.json")
ABOUT = (
    "10,200 procedural articulated objects: 200 of each of 51 categories, made by artsim from seeds alone, with one "
    "labelled partial point cloud of each. For training and comparing estimators of the 9D poses of parts. Objects are "
    "synthetic: neither scans nor models of products. Depth has no sensor noise. Cameras look at the front of objects "
    "and above, as ViewOptions(preset='artimage') draws them."
)
FIRST_SEED = 2_000_000
"""Beyond the seeds of test and validation sets, and below those of streams: no shipped weights have seen an object."""
PER_CATEGORY, SHARES = 200, (0.8, 0.1, 0.1)


@dataclass(frozen=True)
class Options:
    """Make it, and say how long that takes."""

    out: Path
    """Folder to write to; made if missing."""
    splits: tuple[str, ...] = ()
    """By default all."""
    workers: int = 1
    freeze: bool = False
    """Write the manifest of what comes out."""


def unfrozen() -> Manifest:
    """ArtSim-10K without digests."""
    sources = family_sources(sorted(FAMILIES), PER_CATEGORY, FIRST_SEED)
    splits = assign_splits([(source.category, source.sha256) for source in sources], SHARES, seed=0)
    objects: dict[str, dict[str, dict[str, str]]] = {split: {} for split in SPLITS}
    for source, split in zip(sources, splits, strict=True):
        objects[split].setdefault(source.category, {})[str(source.seed)] = ""
    return Manifest("ArtSim-10K", ABOUT, "Apache-2.0", "", 0, 1, SampleOptions(), objects, {})


def main(options: Options) -> None:
    """Make it; see :class:`Options`."""
    manifest = unfrozen() if options.freeze else read_manifest("artsim-10k")
    made = make_frozen(manifest, options.out, options.splits, options.workers)
    if options.freeze:
        text = json.dumps(asdict(freeze(manifest, options.out)), separators=(",", ":"))
        write_atomic(MANIFEST, f"{text}\n".encode())
    size = sum(path.stat().st_size for path in options.out.rglob("*") if path.is_file())
    figures = {"samples": made.total, "made": made.made, "minutes": round(made.seconds / 60, 1),
               "workers": options.workers, "gigabytes": round(size / 1e9, 2),
               "manifest_kilobytes": round(MANIFEST.stat().st_size / 1e3)}  # fmt: skip
    print(json.dumps(figures))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
