"""Objects of files: which are learnt from, which choose the best estimator, and which test it."""

from __future__ import annotations

import json
import logging
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from artperl.data.categories import Parts, order_parts
from artsim.checks.conventions import doubts
from artsim.common.files import read_json, write_atomic
from artsim.common.progress import track
from artsim.datasets.splits import SPLITS, assign_splits
from artsim.errors import AssetError, ConfigError, DatasetError
from artsim.loading.sources import FileSource
from artsim.model.objects import ArticulatedObject

log = logging.getLogger(__name__)

_SHARES = (0.6, 0.2, 0.2)
_LEAST = 5
"""Objects of which these shares leave one for validation and one for the test."""
_MAX_BYTES = 16_000_000


@dataclass(frozen=True, eq=False)
class Split:
    """Objects that a run learns from (``train``), is validated on and tested on; the same ones where none are held out.

    The shares are drawn by digests of the files' content: they depend neither on names nor on the order, and copies of
    one object stay together.
    """

    train: list[ArticulatedObject]
    val: list[ArticulatedObject]
    test: list[ArticulatedObject]
    frozen: dict[str, list[dict[str, str]]]
    """``file`` and ``sha256`` of each object, by split; empty where none are held out."""

    @classmethod
    def of(cls, sources: Sequence[FileSource], parts: Parts, name: str | None) -> Split:
        """Read objects, say what looks wrong with them, and hold some out if they are a category with a name.

        Raises
        ------
        AssetError
            When files cannot be used: each is named first.
        ConfigError
            When there are too few objects to hold some out.
        """
        objects = [order_parts(obj, parts) for obj in _read(sources)]
        for where, what in doubts(objects, [source.name for source in sources]):
            log.warning(f"{where} looks wrong: {what}")
        if name is None:
            return cls(objects, objects, objects, {})
        objects = [replace(obj, category=name) for obj in objects]
        if (different := len({obj.sha256 for obj in objects})) < _LEAST:
            raise ConfigError(
                f"{different} different objects are too few to hold some out for a test", name,
                f"artsim vary {shlex.quote(str(sources[0].path))} --count 20 --out varied, and add varied to --objects;"
                " or leave out --name, to learn these very objects",
            )  # fmt: skip
        drawn = assign_splits([(name, obj.sha256) for obj in objects], _SHARES, 0)
        own = {split: [obj for obj, to in zip(objects, drawn, strict=True) if to == split] for split in SPLITS}
        frozen = {
            split: [
                {"file": source.name, "sha256": obj.sha256}
                for source, obj, to in zip(sources, objects, drawn, strict=True)
                if to == split
            ]
            for split in SPLITS
        }
        return cls(own["train"], own["val"], own["test"], frozen)

    def freeze(self, path: Path) -> None:
        """Write the split into a file, or see that it is the one that the file has.

        Raises
        ------
        DatasetError
            When it is another one.
        """
        if not self.frozen:
            return
        if not path.exists():
            write_atomic(path, (json.dumps(self.frozen, indent=1) + "\n").encode())
            log.info(", ".join(f"{split} {len(own)}" for split, own in self.frozen.items()) + f" objects: {path}")
        elif read_json(path, "the split", DatasetError, _MAX_BYTES) != self.frozen:
            raise DatasetError(
                "the objects are not those that this run was begun with", path, "restore them, or give another --out"
            )


def _read(sources: Sequence[FileSource]) -> list[ArticulatedObject]:
    objects, problems = list[ArticulatedObject](), list[AssetError]()
    for source in track("objects", sources, unit="object", leave=False):
        try:
            objects.append(source.load())
        except AssetError as error:
            problems.append(error)
    if len(problems) == 1:
        raise problems[0]
    if problems:
        for problem in problems:
            log.error(problem)
        raise AssetError(
            f"{len(problems)} of {len(sources)} objects cannot be used", "--objects", "mend them, or leave them out"
        )
    return objects
