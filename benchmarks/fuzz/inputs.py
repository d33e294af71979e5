"""Input ``i`` of a run, out of (seed, i) and the kinds alone; findings as files that can be read again."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

from benchmarks.fuzz.corpus import Seed
from benchmarks.fuzz.mutations import mutated
from benchmarks.fuzz.targets import TARGETS


@dataclass(frozen=True)
class Input:
    """A mutated seed."""

    seed: Seed
    data: bytes

    @property
    def file_name(self) -> str:
        """Name for the data alone: the seed's kind, its name, and the mutated file's own ending."""
        return f"{self.seed.kind}-{self.seed.name}{Path(self.seed.member).suffix}"


def input_at(seed: int, i: int, kinds: Sequence[str], corpus: Sequence[Seed]) -> Input:
    """Input ``i`` of a run."""
    rng = Random(f"{seed}:{i}")
    kind = rng.choices(kinds, [TARGETS[kind].weight for kind in kinds])[0]
    seeds = [s for s in corpus if s.kind == kind]
    chosen = rng.choice(seeds)
    others = tuple(s.files[s.member] for s in seeds if s.form == chosen.form and s is not chosen)
    return Input(chosen, mutated(rng, chosen.files[chosen.member], chosen.form, others))


def input_of(file: Path, corpus: Sequence[Seed]) -> Input:
    """The input that a file holds which a run, or a test, has stored: its name begins with kind and seed."""
    kind, name, *_ = file.stem.split("-")
    (seed,) = (s for s in corpus if (s.kind, s.name) == (kind, name))
    return Input(seed, file.read_bytes())


class Desk:
    """Folders, one for each seed, in which the mutated file is replaced again and again."""

    def __init__(self, root: Path):
        self.root = root

    def lay_out(self, given: Input) -> Path:
        """A folder that holds an input and the files beside it."""
        seed = given.seed
        folder = self.root / f"{seed.kind}-{seed.name}"
        if not folder.is_dir():
            for name, content in seed.files.items():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                (folder / name).write_bytes(content)
        (folder / seed.member).write_bytes(given.data)
        return folder

    def clear(self) -> None:
        """Remove all of them."""
        shutil.rmtree(self.root, ignore_errors=True)
