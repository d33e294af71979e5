"""Objects and datasets are the same bytes whatever the processor can do; so are the functions they are made with."""

from __future__ import annotations

import ast
import json
import math
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

import artsim
from artsim.common import elementary, products
from artsim.families import CATEGORIES
from artsim.loading.primitives import capsule, cylinder, sphere
from artsim.loading.xml_values import rotation_of
from artsim.model.kinematics import Array
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


def test_every_family_makes_the_same_objects_on_every_processor(made: dict[str, dict[str, str]]) -> None:
    names = [f"{category}:{seed}{what}" for category in CATEGORIES for seed in (0, 1) for what in ("", " whole")]
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
    if "AVX512F" not in Path("/proc/cpuinfo").read_text().upper().split():
        pytest.skip("this processor has no AVX-512: there is one less to tell apart")
    numpy_own = (
        "import numpy as np; x = np.random.default_rng(0).uniform(0.1, 7, 9999);"
        "print(np.exp(x).tobytes().hex()[-99999:] + (x.reshape(-1, 3) @ x[:9].reshape(3, 3)).tobytes().hex())"
    )
    assert len({on(processor, "-c", numpy_own) for processor in PROCESSORS}) == 3


# --- elementary functions --------------------------------------------------------------------------------------------

RNG = np.random.default_rng(0)
ANGLES = np.concatenate(
    [RNG.uniform(-7, 7, 1500), RNG.uniform(-1e5, 1e5, 300), np.arange(-24, 25) * np.pi / 12, [1e-9]]
)
POSITIVE = np.concatenate(
    [10 ** RNG.uniform(-300, 300, 300), RNG.uniform(0.5, 2, 900), 1 + RNG.uniform(-1e-7, 1e-7, 99)]
)
SHARES = np.concatenate([RNG.uniform(-1, 1, 900), 1 - 10 ** RNG.uniform(-16, -1, 300), [-1.0, 0.0, 1.0]])
FUNCTIONS = {
    "sin": (ANGLES, 0.8),
    "cos": (ANGLES, 0.8),
    "tan": (ANGLES, 2.0),
    "arctan": (ANGLES, 1.5),
    "arcsin": (SHARES, 2.0),
    "arccos": (SHARES, 2.0),
    "log": (POSITIVE, 1.0),
    "exp": (RNG.uniform(-700, 700, 900), 1.0),
}


def units_off(found: float, true: mpmath.mpf) -> float:
    return float(abs(found - true) / math.ulp(float(true)))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_elementary_functions_are_right_to_the_last_places(name: str) -> None:
    points, tolerance = FUNCTIONS[name]
    with mpmath.workprec(120):
        true = [getattr(mpmath, name.replace("arc", "a"))(mpmath.mpf(x)) for x in points.tolist()]
        found = getattr(elementary, name)(points).tolist()
        worst = max(units_off(f, t) for f, t in zip(found, true, strict=True))
    assert worst <= tolerance


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_number_an_array_and_a_part_of_it_give_the_same_bits(name: str) -> None:
    function: Callable[[Any], Any] = getattr(elementary, name)
    points = np.concatenate([FUNCTIONS[name][0], [0.0, -0.0, 1.0, np.inf, -np.inf, np.nan, 1e300]])
    if name in ("arcsin", "arccos"):
        points = points[np.abs(points) <= 1]
    many = function(np.tile(points, 20))
    few = np.concatenate([function(points[i : i + 7]) for i in range(0, len(points), 7)])
    ones = np.array([function(float(x)) for x in points])
    for other in (few, many[: len(points)], many[-len(points) :]):
        assert np.array_equal(other, ones, equal_nan=True)


def test_angles_of_every_direction_are_those_of_numpy() -> None:
    ends = [0.0, -0.0, 1.0, -1.0, 1e-300, 1e300, np.inf, -np.inf]
    y, x = (side.ravel() for side in np.meshgrid([*ends, *RNG.normal(size=9)], [*ends, *RNG.normal(size=9)]))
    found, true = elementary.arctan2(y, x), np.arctan2(y, x)
    np.testing.assert_allclose(found, true, rtol=1e-15, atol=0)
    np.testing.assert_array_equal(np.signbit(found), np.signbit(true))
    np.testing.assert_array_equal(found, [elementary.arctan2(float(a), float(b)) for a, b in zip(y, x, strict=True)])


def test_a_cosine_is_1_at_rest_and_never_above() -> None:
    assert elementary.cos(0.0) == elementary.sin(0.5 * np.pi) == -elementary.cos(np.pi) == 1.0
    nearly_one = elementary.cos(10.0 ** RNG.uniform(-20, -1, 100_000))
    assert nearly_one.max() == 1.0


@given(st.just(0.0) | st.floats(1e-3, 1e3), st.floats(0.1, 5))
def test_powers_are_those_of_python(base: float, exponent: float) -> None:
    assert elementary.power(base, exponent) == pytest.approx(base**exponent, rel=2e-14)
    assert elementary.power(np.array([base]), exponent).tolist() == [elementary.power(base, exponent)]


# --- products --------------------------------------------------------------------------------------------------------

SMALL = st.floats(-1e3, 1e3)


@given(st.lists(st.tuples(SMALL, SMALL), min_size=1, max_size=4))
def test_an_inner_product_is_a_sum_of_rounded_products_in_order(pairs: list[tuple[float, float]]) -> None:
    a, b = np.array(pairs).T
    expected = 0.0
    for x, y in pairs:
        product = float(Fraction(x) * Fraction(y))  # a product of two doubles, rounded once
        expected = float(Fraction(expected) + Fraction(product))
    assert products.dot(a, b) == expected
    assert products.dot(a[None], b[None]).tolist() == [expected]
    assert products.dot(list(a), list(b)) == expected


def test_products_are_those_of_blas_up_to_rounding() -> None:
    matrices, others = RNG.normal(size=(2, 7, 4, 4))
    vectors = RNG.normal(size=(7, 4))
    np.testing.assert_allclose(products.matmul(matrices, others), matrices @ others, atol=1e-14)
    np.testing.assert_allclose(products.apply(matrices, vectors), (matrices @ vectors[..., None])[..., 0], atol=1e-14)
    np.testing.assert_allclose(products.norm(vectors), np.linalg.norm(vectors, axis=1), atol=1e-14)
    np.testing.assert_allclose(products.norm(products.unit(vectors)), 1.0, atol=1e-15)
    assert products.norm(vectors[0]) == products.norm(vectors)[0]


def volume(vertices: Array, faces: NDArray[np.int32]) -> float:
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def test_shapes_given_in_numbers_are_what_they_say() -> None:
    ball = sphere(0.3)
    np.testing.assert_allclose(products.norm(ball[0]), 0.3, atol=1e-15)
    assert volume(*ball) == pytest.approx(4 / 3 * np.pi * 0.3**3, rel=5e-3)
    polygon = 32 * np.sin(2 * np.pi / 64) * 0.2**2
    assert volume(*cylinder(0.2, 0.7)) == pytest.approx(polygon * 0.7, rel=1e-12)
    ends = volume(*capsule(0.2, 0.7)) - polygon * 0.7
    assert ends == pytest.approx(4 / 3 * np.pi * 0.2**3, rel=1e-2)
    assert np.abs(capsule(0.2, 0.7)[0]).max(axis=0) == pytest.approx([0.2, 0.2, 0.55])
    quarters = rotation_of(np.array([0.5 * np.pi, 0.0, 0.5 * np.pi]))
    np.testing.assert_allclose(quarters, [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-15)


# --- nothing else is used --------------------------------------------------------------------------------------------

MODULES = {
    "common": ("elementary", "products"),
    "families": sorted(path.stem for path in (ROOT / "families").glob("*.py")),
    "loading": ("bodies", "joint_xml", "meshes", "primitives", "rest_state", "xml_values"),
    "making": ("assembly", "solids"),
    "model": ("camera", "draws", "kinematics", "objects"),
    "observing": ("capture", "noise", "sample", "sensor"),
    "renderers": ("raycast", "scene", "view_batch"),
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
