"""Objects and datasets are the same bytes whatever the processor can do."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import artsim
from artsim.families import CATEGORIES
from tests.conftest import absent
from tests.processors import NEEDS, NO_AVX512, PROCESSORS, can_run, left_out
from tests.reproduce import NUM_SAMPLES, RECORD, packages

ROOT = Path(artsim.__file__).resolve().parent
HERE = [name for name in PROCESSORS if can_run(name)]
EXACT = ("objects", "families", "compiled objects", "labels", "noise")
SINGLE_PRECISION = 2e-6
"""Metres: less than what one ray moves the middle of a cloud by."""


def on(processor: str, *command: str) -> str:
    """What a program prints where libraries take this processor for another one."""
    run = subprocess.run(
        [sys.executable, "-W", "ignore", *command],
        env=os.environ | PROCESSORS.get(processor, {}),
        capture_output=True,
        text=True,
        cwd=ROOT.parent,
    )
    assert run.returncode == 0, f"{processor}: exit code {run.returncode}\n{run.stderr}"
    return run.stdout


@cache
def made(processor: str) -> dict[str, Any]:
    """What ``tests.reproduce`` makes on a processor."""
    if processor in PROCESSORS and not can_run(processor):
        pytest.skip(left_out(processor))
    options = ["--exact"] if processor in PROCESSORS else []  # Embree's code is chosen otherwise
    return json.loads(on(processor, "-m", "tests.reproduce", *options))


@pytest.fixture(scope="module")
def record() -> dict[str, Any]:
    """What was made once, on a processor with AVX-512."""
    document = json.loads(RECORD.read_text())
    other = {name: of for name, of in packages().items() if of != document["packages"][name]}
    if other:
        absent(f"the record is of other versions than {other}: nothing is compared with it. See tests/reproduce.py")
    return document


@pytest.mark.slow
@pytest.mark.parametrize("processor", ["as it is", *PROCESSORS])
def test_objects_labels_and_noise_are_those_of_the_record(processor: str, record: dict[str, Any]) -> None:
    found = made(processor)
    for section in EXACT:
        assert found[section] == record[section], f"{section}, {processor}"
    assert len(record["objects"]) == 2 * len(record["families"]) == 2 * len(CATEGORIES)
    assert len(record["compiled objects"]) >= 30
    assert len(record["labels"]) == NUM_SAMPLES


@pytest.mark.slow
@pytest.mark.parametrize("processor", PROCESSORS)
def test_every_file_is_the_same_bytes_with_the_code_of_every_processor(processor: str) -> None:
    """Embree apart, whose code no variable chooses."""
    here, other = made("as it is"), made(processor)
    assert other["files"] == here["files"]
    assert sum(name.endswith(".tar") for name in here["files"]) == NUM_SAMPLES // 40
    assert other["real object"] == here["real object"]


@pytest.mark.slow
def test_clouds_of_every_code_of_embree_are_those_of_the_record(record: dict[str, Any]) -> None:
    """Those with AVX make the same bits. By older code and other makers, a ray may pass an edge that others meet."""
    found = made("as it is")["clouds"]
    assert len(found) == len(HERE)
    assert len({json.dumps(found[code]) for code in found if code.startswith("avx")}) <= 1
    for code, clouds in found.items():
        away = [
            np.abs(np.subtract(clouds[category], mean)).max() > SINGLE_PRECISION
            for category, mean in record["clouds"].items()
        ]
        assert len(away) == len(CATEGORIES)
        assert sum(away) <= 1, f"{code}: more than a single ray passes an edge that it met for the record"


@pytest.mark.slow
def test_the_processors_do_differ() -> None:
    """Where NumPy's own functions give the same bits on all of them, the tests above show nothing."""
    numpy_own = (
        "import numpy as np; x = np.random.default_rng(0).uniform(0.1, 7, 9999);"
        "print(np.exp(x).tobytes().hex()[-99999:] + (x.reshape(-1, 3) @ x[:9].reshape(3, 3)).tobytes().hex())"
    )
    assert len({on(processor, "-c", numpy_own) for processor in HERE}) == len(HERE)


def test_nothing_is_left_out_that_linux_says_is_there() -> None:
    """So that no test is skipped for a name that NumPy changes."""
    flags = set(Path("/proc/cpuinfo").read_text().split())
    has = {
        "with AVX-512": {"avx512f", "avx512cd", "avx512bw", "avx512dq", "avx512vl"} <= flags,
        "with AVX2": {"avx2", "fma", "f16c", "bmi1", "bmi2", "abm", "movbe"} <= flags,
        "with SSE4": {"sse4_2"} <= flags,
    }
    told = os.environ.get("NPY_DISABLE_CPU_FEATURES", "").split()
    assert [name for name in PROCESSORS if has[name] and NEEDS[name] not in told] == HERE


def test_code_that_the_processor_lacks_is_left_out_and_named() -> None:
    everything = dict.fromkeys(("X86_V2", "X86_V3", "X86_V4"), True)
    assert [name for name in PROCESSORS if can_run(name, everything)] == ["with AVX-512", "with AVX2", "with SSE4"]
    haswell = {**everything, "X86_V4": False}
    assert [name for name in PROCESSORS if can_run(name, haswell)] == ["with AVX2", "with SSE4"]
    assert [name for name in PROCESSORS if can_run(name, {"X86_V2": True})] == ["with SSE4"]
    assert [name for name in PROCESSORS if can_run(name, {})] == []  # ARM
    assert "AVX-512" in left_out("with AVX-512")


@pytest.mark.slow
def test_a_processor_that_is_stood_in_for_runs_no_code_of_a_newer_one() -> None:
    """NumPy is told what to leave out, and this very module is asked what it would run."""
    asked = "import tests.test_reproducible as t; print(*t.HERE, sep=',')"
    for i, name in enumerate(HERE):
        assert on(name, "-c", asked).strip() == ",".join(HERE[i:])
    refused = subprocess.run(
        [sys.executable, "-W", "ignore", "-m", "tests.processors", "with AVX-512", "true"],
        env=os.environ | {"NPY_DISABLE_CPU_FEATURES": NO_AVX512},
        capture_output=True,
        text=True,
        cwd=ROOT.parent,
    )
    assert refused.returncode == 1
    assert "not run" in refused.stderr


MODULES = {
    "common": ("elementary", "products"),
    "families": sorted(path.stem for path in (ROOT / "families").glob("*.py")),
    "loading": ("bodies", "joint_xml", "meshes", "primitives", "rest_state", "xml_values"),
    "making": ("assembly", "draws", "outlines", "solid", "solids"),
    "model": ("camera", "details", "draws", "joints", "kinematics", "objects", "transforms"),
    "observing": ("capture", "noise", "sample", "sensor"),
    "renderers": ("outlines", "ray_kernels", "raycast", "scene", "view_batch"),
    "scenes": ("placement", "props", "random_scene"),
}
PATH_OF_THE_BYTES = [ROOT / room / f"{name}.py" for room, names in MODULES.items() for name in names]
FORBIDDEN = re.compile(
    r"a?(rc)?(sin|cos|tan)h?|a(rc)?tan2|exp(2|m1)?|log(2|10|1p)?|(float_)?pow(er)?|cbrt|gamma|hypot|(geom|log)space|v?dot"
    r"|inner|matmul|tensordot|einsum|convolve|correlate|linalg"
)


def named(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and name of what is used that processors differ in."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in ("np", "math"):
            if FORBIDDEN.fullmatch(node.attr):
                yield node.lineno, node.attr
        elif isinstance(node, ast.BinOp | ast.AugAssign) and isinstance(node.op, ast.MatMult):
            yield node.lineno, "@"
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow) and not isinstance(node.left, ast.Constant):
            if not isinstance(node.left, ast.UnaryOp):
                yield node.lineno, "**"
        elif isinstance(node, ast.Attribute) and node.attr in ("argsort", "argpartition"):
            yield node.lineno, node.attr
        elif isinstance(node, ast.ImportFrom) and node.module == "scipy.spatial.transform":
            yield node.lineno, node.module


@pytest.mark.parametrize("file", PATH_OF_THE_BYTES, ids=lambda file: file.relative_to(ROOT).as_posix())
def test_nothing_on_the_way_to_the_bytes_depends_on_the_processor(file: Path) -> None:
    lines = file.read_text().splitlines()
    found = [
        (line, what) for line, what in named(ast.parse("\n".join(lines))) if 'kind="stable"' not in lines[line - 1]
    ]
    assert not found, f"use artsim.common.elementary, artsim.common.products, or argsort(..., kind='stable'): {found}"
