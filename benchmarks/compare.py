"""Speed beside an older revision: ``python -m benchmarks.compare REVISION``.

Checks the revision out into a git worktree, prepares the same work in it and in this working tree, and does it by
turns, one thread at a time: A B B A A B B A. Figures are ratios of processor time, so that a machine that does other
things disturbs them little. It says whether both give the same bytes. The last line is one JSON object.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from artsim.common.progress import track
from artsim.errors import ConfigError

ROOT = Path(__file__).resolve().parents[1]
_CLOUDS = """
from artsim import CATEGORIES, SampleOptions, make, make_renderer
from artsim.datasets.sample_options import draw_sample
objects, renderer = [make(name, 0) for name in CATEGORIES[:20]], make_renderer("raycast")
options = SampleOptions({options})
def work():
    made = [draw_sample(obj, options, 0, i, renderer) for i, obj in enumerate(objects * 2)]
    return len(made), b"".join(sample.points.tobytes() for sample in made)
"""
_ESTIMATES = """
import artperl
from artperl.evaluation.artimage import row_objects, row_samples
clouds = [s.points[:{points}] for s in row_samples("procedural", row_objects("procedural", "{category}", objects=5), 5)]
estimator = artperl.load_estimator("{category}")
def work():
    return len(clouds), b"".join(estimator(cloud).T_camera_part.round(4).tobytes() for cloud in clouds)
"""
_DATASET = """
import shutil
from artsim import family_sources, generate, open_dataset, verify
sources = family_sources(["laptop", "drawer", "scissors", "eyeglasses"], 2)
generate(sources, "dataset", num_samples=1000, shard_size=50, workers=1, progress=False)
"""
MEASURES = {
    "clouds": _CLOUDS.format(options=""),
    "noise": _CLOUDS.format(options="noise='d435'"),
    "images": _CLOUDS.format(options="images=('depth', 'part_mask')"),
    "dataset": _DATASET + "def work():\n"
    "    shutil.rmtree('made', ignore_errors=True)\n"
    "    generate(sources, 'made', num_samples=1000, workers=1, progress=False)\n"
    "    return 1000, b''\n",
    "verify": _DATASET + "def work():\n    return 1000, str(verify('dataset', progress=False)).encode()\n",
    "reads": _DATASET + "dataset = open_dataset('dataset')\ndef work():\n"
    "    return 1000, b''.join(dataset[7 * i % 1000].points.tobytes() for i in range(1000))\n",
    "load": "import artsim\ndef work():\n"
    f"    files = ['{ROOT}/urdf_assets/' + name for name in ('laptop', 'cabinet', 'scissors')]\n"
    "    return 3, ''.join(artsim.load(file).sha256 for file in files).encode()\n",
    "import": "import subprocess, sys\ndef work():\n"
    "    return 1, bytes(subprocess.run([sys.executable, '-c', 'import artsim']).returncode)\n",
    "estimates": _ESTIMATES.format(category="laptop", points=8192),
    "estimates-512": _ESTIMATES.format(category="laptop", points=512),
}
"""Code that defines ``work``, which does something and gives how many things it did, and bytes that must be equal."""

_SERVER = """
import hashlib, json, os, resource, sys, time
answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)  # what the measured code prints is no answer
exec(sys.argv[1])
work()
def seconds():
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime
print(file=answers, flush=True)
for line in sys.stdin:
    start = seconds()
    count, content = work()
    print(json.dumps([(seconds() - start) / count, hashlib.sha256(content).hexdigest()]), file=answers, flush=True)
"""


@dataclass(frozen=True)
class Options:
    """Compare the speed of this working tree with another revision's."""

    revision: Annotated[str, tyro.conf.Positional]
    """What git knows it by: a commit, a tag, HEAD~3."""
    only: tuple[str, ...] = tuple(MEASURES)
    """Names of measures."""
    code: str = ""
    """Code to compare instead: it defines `work()`, which returns a count and bytes."""
    rounds: int = 4
    """How often both do each piece of work."""

    def __post_init__(self) -> None:
        if self.rounds < 1:
            raise ConfigError(f"{self.rounds} rounds measure nothing", "rounds", "use 1 or more")
        if unknown := set(self.only) - MEASURES.keys():
            raise ConfigError(f"no measure is called {min(unknown)}", "only", f"use some of {', '.join(MEASURES)}")


def main(options: Options) -> None:
    """Compare, and print a table."""
    results: dict[str, Any] = {}
    with worktree(options.revision) as (tree, commit):
        print(f"{commit[:12]} against {ROOT}: ratios above 1 say that the latter is faster")
        for name, code in {"code": options.code}.items() if options.code else ((n, MEASURES[n]) for n in options.only):
            results[name] = compare(name, code, (tree, ROOT), options.rounds)
            print(f"{name:14} {results[name]}", flush=True)
    print(json.dumps({"revision": commit, "measures": results}))


def compare(name: str, code: str, trees: tuple[Path, Path], rounds: int) -> dict[str, Any]:
    """Ratio of the processor time of two checkouts; why there is none."""
    seconds: tuple[list[float], list[float]] = [], []
    digests: tuple[set[str], set[str]] = set(), set()
    with ExitStack() as stack:
        sides = []
        for tree in trees:
            threads = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
            own = {**os.environ, "PYTHONPATH": str(tree), **threads}
            side = subprocess.Popen(
                [sys.executable, "-c", _SERVER, code], env=own, text=True,
                cwd=stack.enter_context(tempfile.TemporaryDirectory()), stdin=-1, stdout=-1, stderr=subprocess.DEVNULL,
            )  # fmt: skip
            stack.enter_context(side)
            stack.callback(side.kill)
            sides.append(side)
            assert side.stdout is not None
            if not side.stdout.readline():
                return {"failed": f"{tree} cannot do it"}
        for number in track(name, range(rounds), leave=False):
            for which in (0, 1) if number % 2 == 0 else (1, 0):
                stdin, stdout = sides[which].stdin, sides[which].stdout
                assert stdin is not None
                assert stdout is not None
                print(file=stdin, flush=True)
                spent, digest = json.loads(stdout.readline())
                seconds[which].append(spent)
                digests[which].add(digest)
    ratios = np.array(seconds[0]) / np.array(seconds[1])
    low, middle, high = np.quantile(ratios, [0.0, 0.5, 1.0]).round(3).tolist()
    each = [float(f"{np.median(own):.4g}") for own in seconds]
    return {"ratio": middle, "least": low, "most": high, "seconds_each": each, "same": digests[0] == digests[1]}


@contextmanager
def worktree(revision: str) -> Iterator[tuple[Path, str]]:
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
