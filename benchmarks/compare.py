"""Speed beside an older revision: ``python -m benchmarks.compare REV``.

Checks the revision out into a git worktree of its own, prepares the same work in it and in this working tree, and does
it by turns, one thread at a time: A B B A A B B A. Figures are ratios of processor time, so that a machine that does
other things disturbs them little; a few lines, marked so, compare wall time. Where two revisions have to give the
same bytes, it says whether they do. The last line is one JSON object.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Annotated, Any

import numpy as np
import tyro

from artsim.common.progress import track
from artsim.errors import ConfigError
from benchmarks.compared import MEASURES

ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Options:
    """Compare the speed of this working tree with another revision's."""

    revision: Annotated[str, tyro.conf.Positional]
    """What git knows it by: a commit, a tag, HEAD~3."""
    only: tuple[str, ...] = ()
    """Names of measures, or beginnings of them: clouds noise reads. By default all; --names lists them."""
    rounds: int = 4
    """How often both do each piece of work."""
    names: bool = False
    """Name the measures, and do nothing."""

    def __post_init__(self) -> None:
        if self.rounds < 1:
            raise ConfigError(f"{self.rounds} rounds measure nothing", "rounds", "use 1 or more")
        if not self.measures:
            raise ConfigError(
                f"no measure is called {' or '.join(self.only)}", "only", f"use some of {', '.join(MEASURES)}"
            )

    @property
    def measures(self) -> list[str]:
        """Those that were asked for."""
        return [name for name in MEASURES if not self.only or name.startswith(self.only)]


class Checkout:
    """A process that does the work in one checkout."""

    def __init__(self, tree: Path, folder: Path):
        self.folder = folder
        # The measured packages are the tree's; what measures them is this checkout's, whatever the tree has.
        start = (
            f"import sys; sys.path.insert(0, {str(tree)!r}); sys.path.append({str(ROOT / 'benchmarks')!r});"
            "from compared.serve import main; main()"
        )
        environment = {**os.environ, "PYTHONPATH": str(tree), **_ONE_THREAD}
        # Programs start as those of users do, who compile modules once.
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        self._process = subprocess.Popen(
            [sys.executable, "-c", start],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd=tree,
            env=environment,
            text=True,
        )

    def __enter__(self) -> Checkout:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._process.kill()
        self._process.wait()

    def _ask(self, task: dict[str, str]) -> dict[str, Any]:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(task) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        answer: dict[str, Any] = json.loads(line) if line else {"failed": "the process ended"}
        return answer

    def prepare(self, measure: str) -> str | None:
        """Prepare a measure; why it cannot be taken."""
        return self._ask({"do": "prepare", "measure": measure, "folder": str(self.folder / measure)}).get("failed")

    def work(self) -> dict[str, Any]:
        """Do the prepared work once."""
        return self._ask({"do": "work"})


_ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")}


@dataclass
class Figure:
    """What came of a measure: seconds for each thing, of the older and of this revision, round by round."""

    seconds: tuple[list[float], list[float]] = field(default_factory=lambda: ([], []))
    digests: tuple[set[str], set[str]] = field(default_factory=lambda: (set(), set()))
    facts: list[dict[str, float]] = field(default_factory=lambda: [{}, {}])

    def add(self, which: int, answer: dict[str, Any]) -> None:
        """Take in one answer."""
        self.seconds[which].append(answer["seconds"] / answer["count"])
        self.digests[which].add(answer["digest"])
        self.facts[which] = answer["facts"]

    @property
    def ratios(self) -> list[float]:
        """How many times as fast this revision was in each round."""
        return [old / new for old, new in zip(*self.seconds, strict=True)]

    @property
    def same(self) -> bool | None:
        """Whether both gave the same bytes; None where that is not asked."""
        return None if self.digests[0] == {""} else self.digests[0] == self.digests[1]

    def record(self) -> dict[str, Any]:
        """For the JSON line."""
        old, new = (float(np.median(values)) for values in self.seconds)
        return {
            "ratio": round(float(np.median(self.ratios)), 3),
            "least": round(min(self.ratios), 3),
            "most": round(max(self.ratios), 3),
            "seconds_each": [float(f"{old:.4g}"), float(f"{new:.4g}")],
            **({} if self.same is None else {"same": self.same}),
            **({"facts": self.facts} if any(self.facts) else {}),
        }


def main(options: Options) -> None:
    """Compare, and print a table."""
    if options.names:
        print("\n".join(f"{name:22} {measure.what}" for name, measure in MEASURES.items()))
        return
    results: dict[str, Any] = {}
    with older_tree(options.revision) as (tree, commit):
        print(f"{commit[:12]} against {ROOT}: ratios above 1 say that the latter is faster")
        print(f"{'measure':20} {'older':>10} {'this':>10}  ratio (least, most)  same  what")
        for name in options.measures:
            results[name] = _compare(name, tree, options.rounds)
            print(_line(name, results[name]), flush=True)
    print(json.dumps({"revision": commit, "measures": results}))


def _compare(name: str, tree: Path, rounds: int) -> dict[str, Any]:
    """One measure, by turns."""
    figure = Figure()
    with (
        tempfile.TemporaryDirectory() as folder,
        Checkout(tree, Path(folder) / "older") as older,
        Checkout(ROOT, Path(folder) / "this") as this,
    ):
        sides = older, this
        for side, title in zip(sides, ("older", "this"), strict=True):
            reason = side.prepare(name)
            if reason is not None:
                return {"failed": f"{title}: {reason}"}
        for number in track(name, range(rounds), leave=False):
            for which in (0, 1) if number % 2 == 0 else (1, 0):
                answer = sides[which].work()
                if "failed" in answer:
                    return {"failed": answer["failed"]}
                figure.add(which, answer)
    return figure.record()


def _line(name: str, result: dict[str, Any]) -> str:
    """A row of the table."""
    if "failed" in result:
        return f"{name:20} cannot be compared: {result['failed']}"
    old, new = (f"{1e3 * seconds:.3g} ms" for seconds in result["seconds_each"])
    spread = f"{result['ratio']:5.2f} ({result['least']:.2f}, {result['most']:.2f})"
    same = {None: "", True: "yes", False: "NO"}[result.get("same")]
    facts = "".join(
        f"; {fact}: {value:.4g}, {result['facts'][1].get(fact, float('nan')):.4g}"
        for fact, value in result.get("facts", [{}])[0].items()
    )
    wall = ", wall time" if MEASURES[name].clock == "wall" else ""
    return f"{name:20} {old:>10} {new:>10}  {spread:20} {same:4}  {MEASURES[name].what}{wall}{facts}"


@contextmanager
def older_tree(revision: str) -> Iterator[tuple[Path, str]]:
    """A worktree of a revision, removed in the end; and the commit."""
    commit = _git("rev-parse", "--verify", "--quiet", f"{revision}^{{commit}}")
    if commit is None:
        raise ConfigError(f"git knows no revision {revision!r}", str(ROOT), "name a commit: git log --oneline")
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        if _git("worktree", "add", "--detach", str(tree), commit) is None:
            raise ConfigError(f"git makes no worktree of {revision!r}", str(ROOT), "git worktree prune")
        try:
            yield tree, commit
        finally:
            _git("worktree", "remove", "--force", str(tree))


def _git(*arguments: str) -> str | None:
    """What git prints; None where it refuses."""
    run = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True)
    return run.stdout.strip() if run.returncode == 0 else None


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
