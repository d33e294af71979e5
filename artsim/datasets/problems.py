"""What can be wrong with a dataset on disk, and what to do about it."""

import shlex
from dataclasses import dataclass
from pathlib import Path

from artsim.runs.storage import is_url


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong."""

    where: str
    """File of the dataset, or sample in one."""
    what: str
    fix: str | None = None

    def __str__(self) -> str:
        text = f"{self.where}: {self.what}"
        return text if self.fix is None else f"{text.rstrip('.')}. Fix: {self.fix}"


def repair_command(folder: Path | str) -> str:
    """What to type to have a dataset repaired."""
    if is_url(folder):
        return "run the same generate command again"
    return f"artsim repair {shlex.quote(str(folder))}"
