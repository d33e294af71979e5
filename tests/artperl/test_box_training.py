"""Where boxes end: what a cloud says of it, and a network that learns from that."""

from __future__ import annotations

import os
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from artperl import box_training
from artperl.batch import concatenate
from artperl.boxes import iou_aligned
from artperl.checkpoint import load_estimator
from artperl.evidence import LEVELS, NUM_POINTS, QUANTILES, Evidence
from artperl.networks.boxes import Boxes, box_losses
from artperl.settings import TrainOptions
from artperl.training import Training

OUTWARD = [n for n, level in enumerate(LEVELS) if level > 0.01]
INWARD = [n for n, level in enumerate(LEVELS) if level < -0.01]
HERE = LEVELS.index(0.0)


def wall_and_box(seed: int = 0, times: int = 1) -> tuple[Evidence, torch.Tensor]:
    """A box of 20 x 40 x 30 cm, 2 m before the camera, that is seen from its front (-x) alone: 1,000 points of it."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(-0.5, 0.5, (1000, 2)) * [0.4, 0.3]
    points = np.column_stack([places[:, 0], -places[:, 1], np.full(1000, 1.9)])
    # Rest x is away from the camera, y to the left of the image, z up; the camera looks along its z.
    T = np.array([[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 2.0], [0, 0, 0, 1]], dtype=float)
    center, size = torch.zeros(1, 3), torch.tensor([[0.2, 0.4, 0.3]])
    cloud, pose = torch.from_numpy(np.tile(points, (times, 1))).float(), torch.from_numpy(T)[None].float()
    return Evidence.of(cloud, torch.zeros(len(cloud), dtype=torch.int64), pose, center, size, center + 0.3, size)


def test_the_camera_sees_through_what_is_not_there() -> None:
    evidence, unit = wall_and_box()
    assert float(unit) == pytest.approx(np.linalg.norm([0.2, 0.4, 0.3]))
    before, beside, on = evidence.probes[0, 0].unbind(-1)
    front, left, back = 0, 4, 3
    assert before[front, OUTWARD].min() == 1.0
    assert on[front, HERE] == 1.0
    assert before[front, INWARD].max() == on[front, INWARD].max() == 0.0  # hidden: nobody knows
    assert beside[left, -1] == 1.0
    assert before[left].max() == 0.0
    assert evidence.probes[0, 0, back].max() == 0.0  # all of it is hidden


def test_points_that_come_several_times_tell_no_more() -> None:
    assert torch.equal(wall_and_box()[0].probes, wall_and_box(times=3)[0].probes)


def test_points_are_told_in_the_frame_of_their_part_in_diagonals() -> None:
    evidence, unit = wall_and_box()
    assert evidence.points.shape == (1, NUM_POINTS, 3)
    assert torch.allclose(evidence.points[..., 0] * unit, torch.tensor(-0.1), atol=1e-6)
    expected = torch.tensor([[q - 0.5] for q in QUANTILES]) * torch.tensor([0.4, 0.3])
    assert torch.allclose(evidence.quantiles[0, 0, :, 1:] * unit, expected, atol=0.02)
    assert torch.allclose(evidence.eye[0, 0], torch.tensor([-1.0, 0.0, 0.0]), atol=1e-6)
    assert (evidence.ray[..., 0] > 0.9).all()
    assert float(evidence.count) == 1.0
    # Perception's frame may have another origin: the root's boxes lie on each other.
    assert torch.allclose(evidence.perceived_center, evidence.center)


def test_a_network_that_has_learnt_nothing_leaves_boxes_as_they_are() -> None:
    evidence, _ = wall_and_box()
    center, size = Boxes(3)(evidence.padded(3))
    assert torch.allclose(center[:, :1], evidence.center)
    assert torch.allclose(size[:, :1], evidence.size)


def test_rows_without_a_part_do_not_matter() -> None:
    torch.manual_seed(0)
    boxes, (evidence, _) = Boxes(3), wall_and_box()
    with torch.no_grad():
        for values in boxes.faces.parameters():
            values.normal_()
    padded = evidence.padded(3)
    dirty = replace(padded, center=padded.center.clone(), probes=padded.probes.clone())
    dirty.center[:, 1:], dirty.probes[:, 1:] = 7.0, 1.0
    for clean_values, dirty_values in zip(boxes(padded), boxes(dirty), strict=True):
        assert torch.equal(clean_values[:, 0], dirty_values[:, 0])
        assert not torch.allclose(clean_values[:, 0], torch.zeros(3))


def test_the_loss_is_what_boxes_do_not_share_and_how_far_faces_are_off() -> None:
    rng = np.random.default_rng(0)
    center, true_center = torch.from_numpy(rng.normal(0, 0.05, (2, 50, 1, 3)))
    size, true_size = torch.from_numpy(rng.uniform(0.1, 0.5, (2, 50, 1, 3)))
    valid = torch.ones(50, 1, dtype=torch.bool)
    losses = box_losses(center, size, true_center, true_size, valid)
    shared = iou_aligned(center, size, true_center, true_size)
    faces = [
        (c + sign * 0.5 * s - tc - sign * 0.5 * ts).abs() / (0.5 * ts + 0.002)
        for sign in (-1, 1)
        for c, s, tc, ts in [(center, size, true_center, true_size)]
    ]
    off = torch.cat(faces, dim=-1).clamp(max=3.0).mean(-1)
    assert np.allclose(losses, 1.0 - shared + 0.2 * off.numpy())
    assert box_losses(center, size, center, size, valid).abs().max() < 1e-12
    assert box_losses(center, size, true_center, true_size, ~valid).max() == 0.0


def test_boxes_that_are_all_off_alike_are_learnt() -> None:
    """The true box is 10 % deeper than the reference's, and its back is never seen."""
    evidence = [wall_and_box(seed)[0] for seed in range(8)]
    unit = float(np.linalg.norm([0.2, 0.4, 0.3]))
    true_size, true_center = torch.tensor([[[0.22, 0.4, 0.3]]]) / unit, torch.tensor([[[0.01, 0.0, 0.0]]]) / unit
    records = concatenate([box_training.Records(e, true_center, true_size) for e in evidence])
    boxes = box_training.learn(records, 1, 150, 0, progress=False)
    center, size = (values.detach().numpy() for values in boxes(wall_and_box(99)[0]))
    assert iou_aligned(center, size, true_center, true_size).min() > 0.97
    again = box_training.learn(records, 1, 150, 0, progress=False)
    assert all(torch.equal(a, b) for a, b in zip(boxes.parameters(), again.parameters(), strict=True))


def test_recording_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    options = TrainOptions(
        base_objects=3, reference_points=48, perception_steps=0, agent_rollouts=0, box_views=4, box_steps=3,
        test_objects=2, foreign_categories=1, validation_views=1, test_views=1, start_from="laptop",
    )  # fmt: skip
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    Training(options, whole, workers=0, progress=False).run()
    examined, calls = box_training._examined, []

    def interrupted(*arguments: Any) -> Any:
        calls.append(1)
        if len(calls) == 3:
            os.kill(os.getpid(), signal.SIGINT)
        return examined(*arguments)

    monkeypatch.setattr(box_training, "_examined", interrupted)
    with pytest.raises(KeyboardInterrupt):
        Training(options, stopped, workers=0, progress=False).run()
    Training(options, stopped, workers=0, progress=False).run()
    assert len(calls) == 4
    assert (whole / "boxes.safetensors").read_bytes() == (stopped / "boxes.safetensors").read_bytes()
    weights = [folder / "best" / "weights.safetensors" for folder in (whole, stopped)]
    assert weights[0].read_bytes() == weights[1].read_bytes()


def test_a_shipped_estimator_moves_faces_and_nothing_else() -> None:
    estimator = load_estimator("laptop")
    assert estimator.boxes is not None
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.5, 0.5, (800, 3)) * [0.4, 0.02, 0.3] + [0.0, 0.0, 1.0]
    with_boxes, without = estimator(points), replace(estimator, boxes=None)(points)
    assert np.array_equal(with_boxes.T_camera_part, without.T_camera_part)
    assert np.array_equal(with_boxes.part, without.part)
    assert not np.allclose(with_boxes.size, without.size)
    assert "boxes" in with_boxes.milliseconds
