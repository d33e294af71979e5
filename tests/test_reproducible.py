"""Objects and datasets are the same bytes whatever the processor can do."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import artsim
from artsim.families import CATEGORIES
from tests.reproduce import NUM_SAMPLES

ROOT = Path(artsim.__file__).resolve().parent
# What makes a processor another one, for BLAS, for NumPy and for the C library.
PROCESSORS = {
    "with AVX-512": {"OPENBLAS_CORETYPE": "SkylakeX"},
    "with AVX2": {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"},
    "with SSE4": {
        "OPENBLAS_CORETYPE": "Nehalem",
        "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX,-AVX2,-FMA,-FMA4,-AVX512F,-AVX512VL",
    },
}


def on(processor: str, *command: str) -> str:
    environment = {**os.environ, **PROCESSORS[processor]}
    run = subprocess.run(
        [sys.executable, "-W", "ignore", *command], env=environment, capture_output=True, text=True, cwd=ROOT.parent
    )
    assert run.returncode == 0, run.stderr
    return run.stdout


@pytest.fixture(scope="module")
def made() -> dict[str, dict[str, str]]:
    return {processor: json.loads(on(processor, "-m", "tests.reproduce")) for processor in PROCESSORS}


@pytest.mark.slow
def test_every_family_makes_the_same_objects_on_every_processor(made: dict[str, dict[str, str]]) -> None:
    names = [f"{category}:{seed}{what}" for seed, category in enumerate(CATEGORIES) for what in ("", " whole")]
    for name in names:
        assert len({digests[name] for digests in made.values()}) == 1, name


def test_a_dataset_is_the_same_bytes_on_every_processor(made: dict[str, dict[str, str]]) -> None:
    files = [{name: d for name, d in digests.items() if ":" not in name} for digests in made.values()]
    assert sum(name.endswith(".tar") for name in files[0]) >= NUM_SAMPLES // 40
    assert sum(name.startswith("objects/") for name in files[0]) >= 20
    for name in files[0]:
        assert len({digests.get(name) for digests in files}) == 1, name
    assert files[0].keys() == files[1].keys() == files[2].keys()


def test_the_processors_do_differ() -> None:
    """Where NumPy's own functions give the same bits on all of them, the tests above show nothing."""
    best = "AVX512F" in Path("/proc/cpuinfo").read_text().upper().split()
    here = [name for name in PROCESSORS if best or name != "with AVX-512"]
    numpy_own = (
        "import numpy as np; x = np.random.default_rng(0).uniform(0.1, 7, 9999);"
        "print(np.exp(x).tobytes().hex()[-99999:] + (x.reshape(-1, 3) @ x[:9].reshape(3, 3)).tobytes().hex())"
    )
    assert len({on(processor, "-c", numpy_own) for processor in here}) == len(here)


MODULES = {
    "common": ("elementary", "products"),
    "families": sorted(path.stem for path in (ROOT / "families").glob("*.py")),
    "loading": ("bodies", "joint_xml", "meshes", "primitives", "rest_state", "xml_values"),
    "making": ("assembly", "solids"),
    "model": ("camera", "draws", "kinematics", "objects"),
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
