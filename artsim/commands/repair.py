"""The verbs ``artsim verify``, ``artsim repair`` and ``artsim merge``: datasets that are there."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from artsim.commands.having import Workers
from artsim.commands.printing import say_some
from artsim.common.program import Figures, resumable
from artsim.common.tables import plural
from artsim.errors import DatasetError
from artsim.loading.roots import Packages
from artsim.runs.recipe import check_counts


@dataclass(frozen=True)
class Verify(Figures, Workers):
    """Check a dataset: every checksum, the descriptions, the objects, and the ground truth of every sample.

    Nothing is written. Each problem says what to do.
    """

    path: tyro.conf.Positional[Path]
    """Dataset folder."""

    def run(self) -> None:
        from artsim.datasets.problems import repair_command
        from artsim.datasets.verify import verify

        check_counts(workers=self.workers)
        problems = verify(self.path, workers=self.workers)
        say_some(problems, self.say)
        self.finish({"problems": problems})
        if problems:
            raise DatasetError(f"{plural(len(problems), 'problem')} found", self.path, repair_command(self.path))
        self.say(f"{self.path}: sound")


@dataclass(frozen=True)
class Repair(Figures, Packages, Workers):
    """Restore what is damaged or missing of a dataset, to the same bytes, or say why that cannot be.

    Shards and objects are regenerated, plan.json and dataset.json restore each other. A dataset
    that was stopped is completed. What cannot be restored is listed, and the exit code is 2.
    """

    path: tyro.conf.Positional[Path]
    """Dataset folder."""
    objects: tuple[Path, ...] = ()
    """Where objects lie that were loaded from files, if they are not where they were."""

    def run(self) -> None:
        from artsim.datasets.repair import repair
        from artsim.loading.sources import find_sources

        with resumable("what was restored stays", self.path):
            result = repair(self.path, find_sources(self.objects, self.package_root), self.workers)
        say_some([f"restored: {file}" for file in result.restored], self.say)
        say_some(result.failed, self.say)
        self.finish(result)
        if result.failed:
            raise DatasetError(f"{len(result.failed)} problems are left", self.path)
        done = f"{len(result.restored)} files restored" if result.restored else "nothing to repair"
        self.say(f"{self.path}: {done}")


@dataclass(frozen=True)
class Merge(Figures):
    """Complete a dataset that several machines made with artsim generate --share.

    Nothing is complete before: shards that are missing are named, with the shares to run again.

    Example: artsim merge s3://bucket/first --check
    """

    path: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FOLDER|URL")]
    """Folder or URL that the shares wrote to."""
    check: bool = False
    """Read every file again, and compare its checksum; otherwise sizes alone are compared."""

    def run(self) -> None:
        from artsim.datasets.merge import merge

        result = merge(self.path, self.check)
        if result.already:
            self.say(f"{result.place}: already complete, {result.num_samples} samples")
        else:
            self.say(f"{result.place}: {result.num_samples} samples in {result.num_shards} shards, complete")
        self.finish(result)
