"""Similarities are found exactly from true pairs, and in spite of wrong ones."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from artperl.evaluation.metrics import rotation_error
from artperl.fitting.umeyama import Similarity, ransac_umeyama, umeyama


def drawn(rng: np.random.Generator) -> Similarity:
    return Similarity(
        np.array(rng.uniform(0.2, 3.0)), Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3)
    )  # fmt: skip


@pytest.mark.parametrize("flat", [False, True])
def test_true_pairs_give_back_their_similarity_even_on_a_plane(flat: bool) -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        true, source = drawn(rng), rng.random((5, 3))
        source[:, 2] = 0.3 if flat else source[:, 2]
        found = umeyama(source, true(source))
        np.testing.assert_allclose(found.scale, true.scale, rtol=1e-9)
        np.testing.assert_allclose(found.rotation, true.rotation, atol=1e-8)
        np.testing.assert_allclose(found.translation, true.translation, atol=1e-8)


def test_of_noisy_pairs_no_other_similarity_has_less_error() -> None:
    """An optimiser that knows nothing of the closed form ends at the same place."""
    rng = np.random.default_rng(5)
    true, source = drawn(rng), rng.random((40, 3))
    target = true(source) + rng.normal(0.0, 0.05, (40, 3))

    def residual(x: np.ndarray) -> np.ndarray:
        rotation = Rotation.from_rotvec(x[1:4]).as_matrix()
        return (x[0] * source @ rotation.T + x[4:] - target).ravel()

    start = np.concatenate([[true.scale], Rotation.from_matrix(true.rotation).as_rotvec(), true.translation])
    best = least_squares(residual, start, xtol=1e-12, ftol=1e-12)
    found = umeyama(source, target)
    np.testing.assert_allclose(found.scale, best.x[0], atol=1e-5)
    assert rotation_error(found.rotation, Rotation.from_rotvec(best.x[1:4]).as_matrix()) < 1e-2


def test_a_mirrored_cloud_is_turned_and_not_mirrored() -> None:
    rng = np.random.default_rng(1)
    source = rng.random((30, 3))
    assert np.linalg.det(umeyama(source, source * [-1.0, 1.0, 1.0]).rotation) == pytest.approx(1.0)


def test_many_similarities_at_once_are_those_one_by_one() -> None:
    rng = np.random.default_rng(2)
    source, target = rng.random((4, 6, 3)), rng.random((4, 6, 3))
    every = umeyama(source, target)
    for n in range(4):
        one = umeyama(source[n], target[n])
        np.testing.assert_allclose(every.rotation[n], one.rotation, atol=1e-9)
        np.testing.assert_allclose(every.translation[n], one.translation, atol=1e-9)


def test_wrong_pairs_are_found_and_do_not_count() -> None:
    rng = np.random.default_rng(7)
    true, source = drawn(rng), rng.random((200, 3))
    target = true(source)
    wrong = rng.random(200) < 0.4
    target[wrong] += rng.normal(0.0, 2.0 * true.scale, (int(wrong.sum()), 3))
    found, agree = ransac_umeyama(source, target, rng, 300)
    assert rotation_error(found.rotation, true.rotation) < 2.0
    assert agree[~wrong].all()
    assert agree[wrong].mean() < 0.1
    assert rotation_error(umeyama(source, target).rotation, true.rotation) > 5.0  # without it, they do
