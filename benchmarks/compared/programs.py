"""Programs started anew: what a user waits for before the work begins."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from . import Work


def started(folder: Path, code: str) -> Callable[[], Work]:
    """A line of Python in a new process."""
    return lambda: _run("-c", code)


def command(folder: Path, program: str, *arguments: str) -> Callable[[], Work]:
    """An installed program, of this checkout."""
    code = f"import sys; sys.argv[0] = {program!r}; from {program}.cli import main; main()"
    return lambda: _run("-c", code, *arguments)


def cold_estimate(folder: Path) -> Callable[[], Work]:
    """``artperl estimate`` of a cloud in a PLY file."""
    import artsim
    from artsim.datasets.sample_options import SampleOptions, draw_sample
    from artsim.renderers import make_renderer

    sample = draw_sample(artsim.make("laptop", 7), SampleOptions(num_points=1024), 0, 0, make_renderer("raycast"))
    cloud = folder / "cloud.ply"
    header = "ply\nformat ascii 1.0\nelement vertex 1024\nproperty float x\nproperty float y\nproperty float z\n"
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in sample.points.tolist())
    cloud.write_text(f"{header}end_header\n{rows}")
    return command(folder, "artperl", "estimate", str(cloud), "--category", "laptop")


def _run(*arguments: str) -> Work:
    run = subprocess.run([sys.executable, *arguments], capture_output=True, text=True)
    if run.returncode:
        raise RuntimeError((run.stderr or run.stdout).strip()[-200:])
    return Work(1)
