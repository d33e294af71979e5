"""The verb ``artsim generate``, and ``generate.py``."""

import logging
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from artsim.commands.convert import Convert
from artsim.commands.having import Having, Workers, categories_named
from artsim.commands.printing import log_made
from artsim.common.program import Figures, resumable
from artsim.datasets.plan import SampleOptions
from artsim.errors import ConfigError
from artsim.families.constraints import Constraints
from artsim.formats.base import FormatName
from artsim.loading.roots import Opened

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Generate(Figures, Opened, Workers):
    """Generate a dataset of labelled partial point clouds.

    Poses each object in random joint states, looks at it from random viewpoints, and writes clouds with full ground
    truth as WebDataset tar shards. Objects are made (--categories), loaded (--objects), or both. Stop it at any moment:
    rerun the command to resume; damaged files are regenerated. With a larger --num-samples it extends
    the dataset. The result depends on the options and the seed alone, never on the number of workers.

    To make objects: artsim generate --categories laptop drawer --objects-per-category 200 --out out/first

    To load objects: artsim generate --objects path/to/partnet_mobility/Laptop --out out/real --num-samples 500
    """

    out: Annotated[str, tyro.conf.arg(metavar="FOLDER|URL")]
    """Folder of the dataset, made if missing; or a URL such as s3://bucket/first."""
    categories: tuple[str, ...] = ()
    """Procedural categories, such as laptop or drawer; 'all' for every one."""
    objects_per_category: int = 50
    """Procedural objects of each category."""
    first_object: int = 0
    """Seed of the first procedural object; the others count up from it."""
    having: Having = ()
    objects: tuple[Path, ...] = ()
    """URDF, MJCF, USD and joint files, object folders, or folders of them (such as an unpacked PartNet-Mobility)."""
    num_samples: int = 1000
    """Samples in all; every object gets about the same number."""
    seed: int = 0
    """Seed of the dataset; sample i depends on (seed, i) only."""
    ray: str | None = None
    """Use a Ray cluster instead: auto (the one that this machine belongs to), local (starts one), or HOST:PORT. Nodes
    need the same artsim, and no disk in common."""
    share: Annotated[str | None, tyro.conf.arg(metavar="I/N", aliases=("--part",))] = None
    """Do the share of machine I of N, from 0/N on, of one --out: for array jobs. Then artsim merge completes it."""
    sample: Annotated[SampleOptions, tyro.conf.arg(name="")] = field(default_factory=SampleOptions)
    splits: tuple[float, float, float] = (0.8, 0.1, 0.1)
    """Shares of each category's objects in train, val and test: by object, never by view."""
    shard_size: int = 256
    """Samples of each tar file."""
    skip_broken: bool = False
    """Leave out objects that do not load, or that no view sees, and say which, instead of stopping."""
    strict: bool = False
    """Refuse objects that were repaired while loading; with --skip-broken, leave them out."""
    load_limit: float = 300.0
    """Seconds that an object may take to load."""
    format: FormatName | None = None
    """Also convert the finished dataset to this format, into the folder <out>_<format>; see artsim convert."""

    def run(self) -> None:
        from artsim.datasets.generate import generate
        from artsim.datasets.preparing import Share
        from artsim.datasets.summary import object_lines
        from artsim.loading.sources import Source, family_sources, find_sources
        from artsim.runs.storage import is_url

        share = None if self.share is None else Share.parse(self.share)
        if self.format is not None:  # before hours are spent on a dataset that it does not take
            from artsim.formats.conversion import FORMATS

            if is_url(self.out) or share is not None:
                raise ConfigError("a whole dataset in a folder is converted", "format", "leave --format out")
            FORMATS[self.format].check(self.sample, Path(self.out))
        sources: list[Source] = [*find_sources(self.objects, self.package_root, self.body)]
        categories, constraints = categories_named(self.categories), Constraints.parse(self.having)
        sources += family_sources(categories, self.objects_per_category, self.first_object, constraints)
        with resumable("whole shards are kept", self.out):
            result = generate(
                sources, self.out, self.num_samples, self.seed, self.sample, self.workers, self.shard_size, self.splits,
                self.skip_broken, strict=self.strict, load_limit=self.load_limit, ray=self.ray, share=share,
            )  # fmt: skip
        figures = vars(result) | {"objects": len(result.objects)}
        for reason in result.left_out:
            log.warning("left out: %s", reason)
        if share is not None:
            log.info(f"{result.folder}: share {share} is done, {result.made} samples made now")
            log.info(f"when all are: artsim merge {result.folder}")
            self.finish(figures)
            return
        for line in object_lines(str(result.folder), result.objects):
            self.say(line)
        if result.grown_from is not None:
            kept = result.num_samples - result.made
            log.info(f"extended from {result.grown_from} samples, {kept} of which are kept in their shards")
        for file in result.restored:
            log.info(f"regenerated: {file}")
        log_made(result.folder, f"{result.num_samples} samples", result.made, "samples", result.seconds)
        if result.made:
            log.info(f"look at them: artsim view {result.folder}")
        if self.format is not None:
            Convert(Path(self.out), self.format, Path(f"{self.out}_{self.format}"), workers=self.workers).run()
        self.finish(figures)
