"""Recorded motions are motions: one object, moment after moment, with everything in its place."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from artsim.datasets.sample_checks import sample_problems
from artsim.errors import ArtsimError
from artsim.model.camera import Camera
from artsim.model.draws import ViewOptions
from artsim.physics.episode import EpisodeOptions
from artsim.physics.episode_file import Motion, follow_points, open_motions, record
from tests.conftest import ASSETS

OPTIONS = EpisodeOptions(
    categories=("laptop", "storage_furniture"),
    camera="orbit",
    images=("depth", "part_mask"),
    num_points=256,
    views=ViewOptions(width=64, height=48),
)


@pytest.fixture(scope="module")
def motions(tmp_path_factory: pytest.TempPathFactory) -> list[Motion]:
    return open_motions(record(tmp_path_factory.mktemp("motions"), OPTIONS, motions=2, frames=12, progress=False))


def test_frames_show_one_object_as_time_goes_by(motions: list[Motion]) -> None:
    for motion in motions:
        assert len(motion) == 12
        np.testing.assert_allclose(np.diff(motion.time), 0.05)
        for i, sample in enumerate(motion):
            assert list(sample_problems(sample, motion.obj)) == []
            assert sample.index == i
            assert sample.object_sha256 == motion.obj.sha256
            np.testing.assert_array_equal(sample.joint_state, motion.joint_state[i])


def test_joints_go_as_fast_as_recorded(motions: list[Motion]) -> None:
    for motion in motions:
        went = np.diff(motion.joint_state, axis=0)
        told = 0.5 * (motion.joint_velocity[1:] + motion.joint_velocity[:-1]) * 0.05
        assert np.abs(went).max() > 0.01
        np.testing.assert_allclose(went[1:], told[1:], atol=0.1 * np.abs(told).max())


def test_carried_points_are_never_before_what_is_seen(motions: list[Motion]) -> None:
    for motion in motions:
        first, last = motion[0], motion[-1]
        points = follow_points(first.points, first.part, first, last)
        image = Camera(last.K, last.width, last.height, np.eye(4)).project(points)
        column, row = np.floor(image[:, :2]).astype(int).T
        inside = (column >= 0) & (row >= 0) & (column < last.width) & (row < last.height)
        assert last.depth is not None
        seen = last.depth[row[inside], column[inside]]
        pixel = 3 * points[inside, 2] / last.K[0, 0]  # depth within a pixel, on a steep surface
        assert np.mean(points[inside, 2] > seen - pixel) > 0.97
        np.testing.assert_allclose(follow_points(points, first.part, last, first), first.points, atol=1e-6)


def test_a_motion_depends_on_its_number_and_the_seed_alone(motions: list[Motion], tmp_path: Path) -> None:
    more = open_motions(record(tmp_path, OPTIONS, motions=3, frames=12, progress=False))
    for motion, again in zip(motions, more, strict=False):
        np.testing.assert_array_equal(motion.joint_state, again.joint_state)
        np.testing.assert_array_equal(motion[5].points, again[5].points)
    assert more[2].obj.sha256 != more[0].obj.sha256


@pytest.mark.slow
def test_the_program_records_files(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ["record", "--out", out, "--objects", ASSETS / "laptop", "--motions", "1", "--frames", "3"]
    subprocess.run(
        [sys.executable, "-c", "import artsim.commands.verbs; artsim.commands.verbs.main()", *map(str, words)],
        check=True,
        capture_output=True,
    )
    (motion,) = open_motions(out)
    assert len(motion) == 3
    assert motion.obj.category == motion[0].category


def test_what_makes_no_sense_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ArtsimError, match="artsim record"):
        open_motions(tmp_path)
    for numbers in ({"motions": 0}, {"frames": 0}, {"seed": -1}):
        with pytest.raises(ArtsimError, match="is not a"):
            record(tmp_path, OPTIONS, progress=False, **numbers)
    (tmp_path / "mine.txt").write_text("keep")
    with pytest.raises(ArtsimError, match="empty or new folder"):
        record(tmp_path, OPTIONS, progress=False)
    (tmp_path / "motions.json").write_text("{}")
    with pytest.raises(ArtsimError, match="damaged"):
        open_motions(tmp_path)
