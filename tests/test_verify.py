"""What verification notices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import artsim
from artsim import StateOptions, ViewOptions, observe, sample_state, sample_view
from artsim.sample import Sample
from artsim.verify import sample_problems
from tests.conftest import ASSETS


@pytest.fixture(scope="module")
def cabinet() -> artsim.ArticulatedObject:
    return artsim.load(ASSETS / "cabinet")


@pytest.fixture(scope="module")
def sample(cabinet: artsim.ArticulatedObject) -> Sample:
    rng = np.random.default_rng(1)
    q = sample_state(cabinet, StateOptions(), rng)
    return observe(cabinet, q, sample_view(cabinet, q, ViewOptions(), rng), images=("depth", "part_mask"), rng=rng)


def turned(s: Sample) -> Sample:
    T = s.T_camera_part.copy()
    T[1, :3, :3] = T[1, :3, :3] @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    return replace(s, T_camera_part=T)


def sheared(s: Sample) -> Sample:
    T = s.T_camera_part.copy()
    T[:, 0, 0] += 0.01
    return replace(s, T_camera_part=T)


def state(s: Sample, value: float) -> Sample:
    q = s.joint_state.copy()
    q[1] = value
    return replace(s, joint_state=q)


WRONG: dict[str, tuple[Callable[[Sample], Sample], str]] = {
    "a part turned": (turned, "part poses do not follow from the joint states"),
    "a sheared pose": (sheared, "a rotation is not a rotation"),
    "another joint state": (lambda s: state(s, 0.123), "part poses do not follow from the joint states"),
    "a state out of limits": (lambda s: state(s, 9.0), "are outside their limits"),
    "points moved": (lambda s: replace(s, points=s.points + np.float32(0.02)), "outside its box|centre of a pixel"),
    "a point not finite": (lambda s: replace(s, points=s.points * np.float32(np.nan)), "a point is not finite"),
    "labels swapped": (lambda s: replace(s, part=(s.part + 1) % 4), "outside its box"),
    "a label of no part": (lambda s: replace(s, part=s.part + 9), "belongs to part"),
    "npcs of another scale": (lambda s: replace(s, npcs=s.npcs * np.float32(1.1)), "npcs of part"),
    "another box": (lambda s: replace(s, box_size=s.box_size * 1.1), "boxes are not those of the object"),
    "a fraction above one": (lambda s: replace(s, visible_fraction=s.visible_fraction + 1), "not within 0..1"),
    "an unseen part with points": (lambda s: replace(s, visible_fraction=s.visible_fraction * 0), "fraction of 0"),
    "another object": (lambda s: replace(s, object_sha256="0" * 64), "shows another object"),
    "a missing label": (lambda s: replace(s, part=s.part[1:]), "differ in length"),
    "another depth image": (lambda s: replace(s, depth=np.asarray(s.depth) + 1), "do not agree with the depth image"),
    "another mask": (lambda s: replace(s, part_mask=np.asarray(s.part_mask) + 1), "do not agree with the part mask"),
    "posed axes": (lambda s: replace(s, joint_axis_camera=-s.joint_axis_camera), "posed joint axes do not follow"),
    "another camera": (lambda s: replace(s, width=300), "outside the image"),
}


def test_a_sound_sample_has_no_problems(sample: Sample, cabinet: artsim.ArticulatedObject) -> None:
    assert list(sample_problems(sample, cabinet)) == []


@pytest.mark.filterwarnings("ignore:invalid value")
@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_sample_is_noticed(case: str, sample: Sample, cabinet: artsim.ArticulatedObject) -> None:
    spoil, message = WRONG[case]
    problems: list[Any] = list(sample_problems(spoil(sample), cabinet))
    assert any(part in problem for problem in problems for part in message.split("|")), problems
