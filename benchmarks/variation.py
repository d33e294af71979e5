"""Do variations of real objects hold what their originals hold? ``python -m benchmarks.variation``.

Takes objects of ``ARTSIM_PARTNET_DIR``, categories in turn, and writes variations of each as ``artsim vary`` does, with
parts of the category's other objects at hand. Each file is loaded again and passed through the gates that the original
passes. The last line is one JSON object: the shares of variations that pass (``passed``) and that did so at the first
draw (``first_draw``), and the numbers of different trees and topologies.
"""

from __future__ import annotations

import json
import os
import platform
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass
from itertools import chain, zip_longest
from pathlib import Path

import tyro

from artsim.common.progress import say, track
from artsim.errors import ArtsimError, ConfigError
from artsim.loading.sources import FileSource, find_sources
from artsim.loading.urdf import load
from artsim.variation.folder import VariationSummary, write_variations
from artsim.variation.standard import Standard


@dataclass(frozen=True)
class Options:
    """Vary real objects, and pass the variations through the gates that the originals pass."""

    objects: int = 50
    """Real objects, categories in turn."""
    count: int = 4
    """Variations of each."""
    seed: int = 0
    partnet: Path | None = Path(os.environ["ARTSIM_PARTNET_DIR"]) if "ARTSIM_PARTNET_DIR" in os.environ else None
    """Folder of real objects."""
    out: Path | None = None
    """Keep the variations in this folder."""


def main(options: Options) -> None:
    """Print a row for each object, totals, and the JSON line."""
    if options.partnet is None:
        raise ConfigError("there are no real objects", "partnet", "set ARTSIM_PARTNET_DIR, or pass --partnet")
    start = time.perf_counter()
    print(f"{platform.processor() or platform.machine()}, one process")
    sources = in_turn(find_sources([options.partnet]))[: options.objects]
    total = VariationSummary(Path(), ())
    asked = passed = 0
    print(f"{'object':32s}{'made':>6s}{'first':>6s}{'draws':>6s}{'pass':>6s}{'trees':>6s}{'topol.':>7s}  operations")
    with tempfile.TemporaryDirectory() as temporary:
        for source in track("objects", sources, unit="object", leave=False):
            summary, good = vary_one(source, options, options.out or Path(temporary))
            asked, passed = asked + options.count, passed + good
            used = ", ".join(f"{name} {number}" for name, number in sorted(summary.operations.items()))
            name = "/".join(source.path.parent.parts[-2:])
            say(f"{name:32s}{summary.whole:6d}{summary.first:6d}{summary.draws:6d}{good:6d}{len(summary.trees):6d}"
                f"{len(summary.topologies):7d}  {used}")  # fmt: skip
            total.first, total.draws = total.first + summary.first, total.draws + summary.draws
            total.operations += summary.operations
            total.rejected += summary.rejected
            total.trees |= summary.trees
            total.topologies |= {f"{name} {topology}" for topology in summary.topologies}
    shares = {"passed": passed / max(1, asked), "first_draw": total.first / max(1, asked)}
    print(
        f"\n{len(sources)} objects, {asked} variations: {100 * shares['passed']:.1f} % pass the gates of their "
        f"original, {100 * shares['first_draw']:.1f} % at the first draw"
    )
    trees, topologies = len(total.trees), len(total.topologies)
    print(f"{trees} different trees, {topologies} topologies; {time.perf_counter() - start:.0f} s")
    counts = {"operations": dict(total.operations), "rejected": dict(total.rejected)}
    print(json.dumps({"variations": asked, **shares, "trees": trees, "topologies": topologies, **counts}))


def in_turn(sources: list[FileSource]) -> list[FileSource]:
    """The first object of each category, then the second of each, and so on."""
    groups: dict[str, list[FileSource]] = defaultdict(list)
    for source in sources:
        groups[source.path.parent.parent.name].append(source)
    return [source for source in chain.from_iterable(zip_longest(*groups.values())) if source is not None]


def vary_one(source: FileSource, options: Options, out: Path) -> tuple[VariationSummary, int]:
    """Variations of one object, and how many of their files pass the gates that it passes."""
    category = source.path.parent.parent
    folder = out / category.name / source.path.parent.name
    alone = sum(1 for _ in category.glob("*/mobility.urdf")) < 2
    try:
        summary = write_variations(
            source.path, folder, options.count, options.seed, [] if alone else [category], progress=False
        )
        standard = Standard.of(load(source.path))
    except ArtsimError as error:
        say(str(error))
        return VariationSummary(folder, ()), 0
    files = [path.parent for path in folder.glob("*/mobility.urdf")]
    return summary, sum(not standard.failed(load(file)) for file in files)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
