"""Reads files in forked processes and says what came of each, as a program of its own: see :func:`read_each`."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import traceback
from pathlib import Path
from typing import Any

from artsim.errors import ArtsimError

SECONDS, MB = 4.0, 500.0
"""2 s on a quiet core; one that is shared takes twice as long, what has no bound minutes."""


def load(path: Path) -> str:
    import artsim
    from artsim.drawing.inspect import describe

    return describe(artsim.load(path))


def view(path: Path) -> str:
    from artsim.drawing.contact_sheet import write_contact_sheet

    return " ".join(str(written.absolute()) for written in write_contact_sheet(path, samples=1))


def base(path: Path) -> str:
    from artperl.retrieval.shape_base_file import read_shape_base

    return f"{len(read_shape_base(path))} objects"


def estimator(path: Path) -> str:
    from artperl.methods.estimator_files import load_estimator

    return str(load_estimator(path).options)


def dataset(path: Path) -> str:
    import artsim

    return str(artsim.open_dataset(path)[0].index)


def motions(path: Path) -> str:
    from artsim.physics.episode_file import open_motions

    return f"{len(open_motions(path))} motions"


def intrinsics(path: Path) -> str:
    from artperl.inputs import read_intrinsics

    return str(read_intrinsics(path))


def points(path: Path) -> str:
    from artperl.inputs import read_points

    return str(read_points(path).shape)


def image(path: Path) -> str:
    from artsim.common.files import open_image

    return str(open_image(path).size)


READERS = {f.__name__: f for f in (load, view, base, estimator, dataset, motions, intrinsics, points, image)}


def outcome(kind: str, path: Path) -> dict[str, Any]:
    """What comes of reading a file: ``said``, or ``error`` and its type; a traceback where it is none of ours."""
    try:
        return {"said": READERS[kind](path)}
    except ArtsimError as error:
        return {"error": str(error), "type": type(error).__name__}
    except BaseException:  # what must not happen is what the test is about
        return {"raw": traceback.format_exc()}


def forked(kind: str, path: Path) -> dict[str, Any]:
    """As :func:`outcome`, in a process of its own, with its processor time in seconds and its memory in MB."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        signal.alarm(30)  # of the clock: what waits for ever ends here
        with os.fdopen(write, "w") as file:
            json.dump(outcome(kind, path), file)
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as file:
        text = file.read()
    _, status, usage = os.wait4(child, 0)
    result = json.loads(text) if text else {"raw": f"ended with status {status}"}
    return result | {"seconds": usage.ru_utime + usage.ru_stime, "mb": usage.ru_maxrss / 1024}


def read_each(wanted: list[tuple[str, Path]], folder: Path) -> list[dict[str, Any]]:
    """What comes of files by kind, each read in a process of its own in a folder."""
    child = subprocess.run(
        [sys.executable, "-m", "tests.hostile_child", json.dumps([(kind, str(path)) for kind, path in wanted])],
        capture_output=True,
        text=True,
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[1]), "OMP_NUM_THREADS": "1"},
    )
    assert child.returncode == 0, child.stderr
    found: list[dict[str, Any]] = json.loads(child.stdout.splitlines()[-1])
    return found


def too_much(outcomes: dict[str, dict[str, Any]]) -> dict[str, tuple[float, int]]:
    """Seconds and MB of those that take too much of either."""
    figures = {name: (round(one["seconds"], 2), round(one["mb"])) for name, one in outcomes.items()}
    return {name: f for name, f in figures.items() if f[0] > SECONDS or f[1] > MB}


if __name__ == "__main__":
    # What libraries take to be imported is not the files' fault: a sound file brings them in, once for all processes.
    load(Path(__file__).parents[1] / "urdf_assets" / "laptop")
    print(json.dumps([forked(kind, Path(path)) for kind, path in json.loads(sys.argv[1])]))
