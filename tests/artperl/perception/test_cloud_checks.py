"""What looks wrong with a cloud is said, once, with a fix; a good cloud is said nothing about."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from artperl.core.usual_sizes import USUAL, size_warning
from artperl.methods.estimator_files import load_estimator
from artperl.methods.full import Estimator
from artperl.perception.cloud_checks import cloud_warnings
from artperl.perception.preprocess import Cloud
from artsim.families import FAMILIES, make
from artsim.observing.sample import Sample

CASES = Path(__file__).parents[2] / "cases"
CLOUD = np.load(CASES / "E00" / "c.npy").astype(np.float64)


def _said(points: np.ndarray) -> tuple[str, ...]:
    return cloud_warnings(Cloud.of(points, 1024))


def _with(value: float, share: float) -> np.ndarray:
    points = CLOUD.copy()
    points[: round(share * len(points))] = value
    return points


@pytest.mark.parametrize(
    ("points", "fix"),
    [
        (CLOUD * 1000, "--unit mm"), (CLOUD * 100, "--unit cm"), (CLOUD * 0.001, "--unit"), (CLOUD * 1e-5, "--unit"),
        (CLOUD * 1e6, "--unit"), (CLOUD * [1.0, -1.0, -1.0], "--camera opengl"),
        (CLOUD - [0.0, 0.0, 0.65], "behind the camera"), (_with(0.0, 0.2), "0 0 0"), (_with(np.nan, 0.3), "not finite"),
        (_with(np.inf, 0.3), "not finite"), (CLOUD[:60], "only 60 points"),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("error")
def test_each_fault_is_one_line_with_its_fix(points: np.ndarray, fix: str) -> None:
    (text,) = _said(points)
    assert fix in text
    assert "Fix: " in text
    assert "\n" not in text


@pytest.mark.parametrize(
    "points", [CLOUD, CLOUD * 8.0, CLOUD * 0.1, CLOUD[:1000], _with(0.0, 0.02), _with(np.nan, 0.02)]
)
def test_a_good_cloud_is_said_nothing_about(points: np.ndarray) -> None:
    assert _said(points) == ()


def test_a_stray_point_is_not_the_extent() -> None:
    assert _said(np.concatenate([CLOUD, [[0.0, 0.0, 50.0]]])) == ()


def test_an_estimator_in_python_says_it_too_and_leaves_the_origin_out(estimator: Estimator, sample: Sample) -> None:
    points = np.asarray(sample.points, dtype=np.float64)
    plain = estimator(points)
    assert plain.warnings == ()
    assert plain.part_names == ("base", "lid")
    assert plain.state_unit == ("", "rad")
    assert plain.joint_limits.shape == (2, 2)
    assert plain.joint_limits[1, 0] - 0.2 <= plain.state[1] <= plain.joint_limits[1, 1] + 0.2
    assert "Warnings" not in repr(plain)
    with_zeros = estimator(np.concatenate([points, np.zeros((len(points) // 2, 3))]))
    assert (with_zeros.part[len(points) :] == -1).all()
    assert len(with_zeros.warnings) == 1
    assert "0 0 0" in str(with_zeros)
    assert "1 warnings" in repr(with_zeros)
    text = str(with_zeros)
    assert len(text.splitlines()) == 5
    assert text.splitlines()[3].split()[:2] == ["base", "free"]
    assert text.splitlines()[4].split()[:2] == ["lid", "revolute"]


@pytest.mark.parametrize("method", ["full", "artperl"])
def test_a_laptop_of_four_metres_is_said_to_be_none(method: str) -> None:
    estimator, points = load_estimator("laptop", method=method), np.load(CASES / "E00" / "c.npy")
    assert estimator(points).warnings == ()
    for factor, guess in ((10.0, "points * 0.1"), (0.1, "points * 10")):
        (text,) = estimator(points * factor).warnings
        assert "that of a usual laptop is 0.22 to 0.66 m" in text
        assert guess in text


def test_usual_sizes_are_those_of_the_families() -> None:
    """Of every category there are sizes, and new objects have them."""
    assert USUAL.keys() == FAMILIES.keys() - {"random_tree"}  # which is anything
    for category in ("laptop", "eyeglasses", "scissors", "stapler", "drawer"):
        for seed in (1000, 1001):
            largest = float(np.linalg.norm(make(category, seed).box_size, axis=1).max())
            assert size_warning(largest, [category]) is None
            assert size_warning(100.0 * largest, [category]) is not None
    assert size_warning(100.0, ["laptop", "gadget"]) is None  # of a category of the user's own nothing is known
    assert size_warning(1.0, ["laptop", "drawer"]) is None
