"""What tests of datasets share."""

from __future__ import annotations

import hashlib
import os
import time
from dataclasses import dataclass
from pathlib import Path

from artsim.families import make
from artsim.model.objects import ArticulatedObject


def digests(folder: Path) -> dict[str, str]:
    """Checksum of everything that belongs to a dataset."""
    files = [*folder.glob("*.tar"), *folder.glob("objects/*"), folder / "dataset.json", folder / "plan.json"]
    return {p.relative_to(folder).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


@dataclass(frozen=True)
class Troublesome:
    """A source that gives its loader trouble."""

    name: str
    sha256: str = "1" * 64

    def load(self) -> ArticulatedObject:
        """Whatever its name says."""
        if self.name == "kills":
            os.kill(os.getpid(), 9)
        if self.name == "crashes":
            os.abort()
        if self.name == "stalls":
            time.sleep(600)
        if self.name == "leaves":
            raise SystemExit(3)
        if self.name == "runs out of memory":
            raise MemoryError
        if self.name == "recurses":
            return Troublesome(self.name).load()
        return make("laptop", 0)
