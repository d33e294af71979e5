"""What looks wrong with a cloud is said, once, with a fix; a good cloud is said nothing about."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from artperl.methods.full import Estimator
from artperl.perception.cloud_checks import cloud_warnings
from artperl.perception.preprocess import Cloud
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
    assert text.splitlines()[2].split()[:2] == ["base", "free"]
    assert text.splitlines()[3].split()[:2] == ["lid", "revolute"]
