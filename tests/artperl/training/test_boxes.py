"""Where boxes end: what a cloud says of it, and a network that learns from that."""

from __future__ import annotations

import os
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from artperl.boxes.evidence import PERCEIVED, SHARES, Evidence, roughness
from artperl.boxes.network import Boxes, box_losses
from artperl.core.batch import concatenate
from artperl.evaluation.box_overlap import iou_rest_exact
from artperl.evaluation.samples import frozen_samples
from artperl.methods.estimator_files import load_estimator
from artperl.training import box_records
from artperl.training.boxes import best_without_own_references
from artperl.training.options import TrainOptions
from artperl.training.run import Training

pytestmark = pytest.mark.slow

SIGNS = np.array([-1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
"""Of the faces' outward normals."""
STAGE = TrainOptions(
    base_objects=3, reference_points=48, perception_steps=0, dense_steps=0, box_views=4,
    box_steps=3, test_objects=2, foreign_categories=1, validation_views=1, test_views=1, start_from="laptop",
)  # fmt: skip
"""Nothing but the stage for boxes."""


def wall_and_box(seed: int = 0, noise: float = 0.0) -> tuple[Evidence, torch.Tensor]:
    """A box of 20 x 40 x 30 cm, 2 m before the camera, that is seen from its front (-x) alone: 1,000 points of it."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(-0.5, 0.5, (1000, 2)) * [0.4, 0.3]
    points = np.column_stack([places[:, 0], -places[:, 1], 1.9 + noise * rng.normal(size=1000)])
    # Rest x is away from the camera, y to the left of the image, z up; the camera looks along its z.
    T = np.array([[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 2.0], [0, 0, 0, 1]], dtype=float)
    center, size = torch.zeros(1, 3), torch.tensor([[0.2, 0.4, 0.3]])
    cloud, pose = torch.from_numpy(points).float(), torch.from_numpy(T)[None].float()
    part = torch.zeros(len(cloud), dtype=torch.int64)
    slides = torch.tensor([[0.0, 0.0, -1.0]])  # towards the camera
    return Evidence.of(cloud, part, pose, slides, center, size, center + 0.3, 1.1 * size, roughness(cloud))


def places(evidence: Evidence, candidate: int) -> NDArray[np.float64]:
    """(K, 6) coordinates of the faces by one kind of candidate."""
    face = torch.cat([0.5 * evidence.size - evidence.center, 0.5 * evidence.size + evidence.center], dim=-1)
    found: NDArray[np.float64] = (face + evidence.candidates[..., candidate])[0].double().numpy() * SIGNS
    return found


def test_roughness_is_the_noise_about_planes_through_eight_points() -> None:
    """Three of eight degrees of freedom go into the plane; the median of chi squared with five is 4.35."""
    assert float(wall_and_box()[0].roughness) < 1e-5
    evidence, unit = wall_and_box(noise=0.003)
    assert float(evidence.roughness * unit) == pytest.approx(0.003 * np.sqrt(4.35 / 8), rel=0.1)


def test_points_say_how_far_out_each_face_lies_in_the_frame_of_its_part() -> None:
    evidence, unit = wall_and_box()
    assert float(unit) == pytest.approx(np.linalg.norm([0.2, 0.4, 0.3]))
    for n, share in enumerate(SHARES):
        low, high = places(evidence, 1 + n).reshape(2, 3) * float(unit)
        assert np.allclose(low[1:], (share - 0.5) * np.array([0.4, 0.3]), atol=0.02)
        assert np.allclose(high[1:], (0.5 - share) * np.array([0.4, 0.3]), atol=0.02)
        assert low[0] == pytest.approx(-0.1)
        assert high[0] == pytest.approx(-0.1)  # the back is not seen
    # Perception's frame may have another origin: the root's boxes lie on each other.
    expected = np.array([[-0.11, -0.22, -0.165, 0.11, 0.22, 0.165]]) / float(unit)
    assert np.allclose(places(evidence, PERCEIVED), expected)
    # As large as perceived, from what is seen of the front.
    assert places(evidence, PERCEIVED + 1)[0, 3] * float(unit) == pytest.approx(0.12)
    assert places(evidence, PERCEIVED + 2)[0, 3] * float(unit) == pytest.approx(0.1)
    assert torch.allclose(evidence.facing[0, 0], torch.tensor([1.0, 0, 0, -1.0, 0, 0]), atol=1e-6)
    assert float(evidence.share) == 1.0


def test_what_siblings_and_the_root_show_are_candidates() -> None:
    """A root and three drawers, all with their frames at the camera; the last one is not seen."""
    rng = np.random.default_rng(0)
    reach = np.array([0.5, 0.3, 0.4])
    part = np.repeat([0, 1, 2], 400)
    points = rng.uniform(-1.0, 1.0, (1200, 3)) * reach[part, None]
    points[::400] = reach[:, None]  # each part's outermost corner
    center, size = torch.zeros(4, 3), torch.full((4, 3), 2.0)
    poses = torch.eye(4).expand(4, -1, -1)
    cloud, turns = torch.from_numpy(points).float(), torch.zeros(4, 3)
    evidence, unit = Evidence.of(
        cloud, torch.from_numpy(part), poses, turns, center, size, center, size, torch.tensor(0.0)
    )
    everywhere, siblings, root = (places(evidence, n)[:, 3:] * float(unit) for n in (PERCEIVED - 1, -2, -1))
    assert np.allclose(everywhere, 0.5, atol=1e-6)
    assert np.allclose(root, 0.5, atol=1e-6)
    assert np.allclose(siblings, np.array([0.4, 0.4, 0.3, 0.4])[:, None], atol=1e-6)
    own = places(evidence, 1)[:, 3:] * float(unit)
    assert np.allclose(own, np.array([0.5, 0.3, 0.4, 1.0])[:, None], atol=1e-6)  # unseen: its reference's faces
    assert evidence.share[0].tolist() == pytest.approx([1 / 3, 1 / 3, 1 / 3, 0.0])


def test_axes_are_those_of_joints_at_rest() -> None:
    """Whatever the view: drawers slide towards the front, -x."""
    (sample,) = frozen_samples(["drawer"], 1, 1)
    arrays = sample.points, sample.T_camera_part, sample.joint_axis_camera, sample.box_center, sample.box_size
    points, poses, axis, center, size = (torch.from_numpy(np.asarray(values, np.float64)) for values in arrays)
    part = torch.from_numpy(sample.part.astype(np.int64))
    evidence, _ = Evidence.of(points, part, poses, axis, center, size, center, size, torch.tensor(0.0))
    assert np.allclose(evidence.axis[0, 1:], [-1.0, 0.0, 0.0], atol=1e-6)


def test_a_face_lies_where_all_candidates_say() -> None:
    evidence, _ = wall_and_box()
    agreed = replace(evidence, candidates=torch.full_like(evidence.candidates, 0.03))
    with torch.no_grad():
        boxes = Boxes(3)
        boxes.among[-1].weight[-3], boxes.among[-1].bias[-3] = 0.0, 0.0  # no more moves
        center, size, _ = boxes(agreed.pad(3))
    assert torch.allclose(center[:, :1], evidence.center, atol=1e-6)
    assert torch.allclose(size[:, :1], evidence.size + 0.06)


def test_how_far_a_part_has_slid_is_told_by_its_leading_face() -> None:
    """Seen at 0.03 before its box; perceived at 0.05 behind it at rest: it has slid by 0.08 more. Else by nothing."""
    evidence, _ = wall_and_box()
    candidates = torch.full_like(evidence.candidates, 0.03)
    candidates[..., PERCEIVED] = 7.0
    candidates[:, :, 0, PERCEIVED] = -0.05  # of the face towards the camera
    with torch.no_grad():
        boxes = Boxes(1)
        boxes.trust[PERCEIVED] = -100.0  # of no use to say where the face is now
        boxes.among[-1].weight[-3:], boxes.among[-1].bias[-3:] = 0.0, torch.tensor([0.0, 1.0, 0.0])
        farther = boxes(replace(evidence, candidates=candidates))[2]
        still = boxes(replace(evidence, candidates=candidates, axis=0.0 * evidence.axis))[2]
    assert farther.item() == pytest.approx(0.08, abs=1e-5)
    assert still.item() == 0.0


def test_rows_without_a_part_do_not_matter() -> None:
    torch.manual_seed(0)
    boxes, (evidence, _) = Boxes(3), wall_and_box()
    padded = evidence.pad(3)
    dirty = replace(padded, center=padded.center.clone(), candidates=padded.candidates.clone())
    dirty.center[:, 1:], dirty.candidates[:, 1:] = 7.0, 1.0
    for clean_values, dirty_values in zip(boxes(padded), boxes(dirty), strict=True):
        assert torch.equal(clean_values[:, 0], dirty_values[:, 0])


def test_the_loss_is_what_boxes_do_not_share_and_how_far_faces_are_off() -> None:
    rng = np.random.default_rng(0)
    center, true_center = torch.from_numpy(rng.normal(0, 0.05, (2, 50, 1, 3)))
    size, true_size = torch.from_numpy(rng.uniform(0.1, 0.5, (2, 50, 1, 3)))
    valid = torch.ones(50, 1, dtype=torch.bool)
    losses = box_losses(center, size, true_center, true_size, valid)
    shared = iou_rest_exact(center, size, true_center, true_size)
    faces = [
        (c + sign * 0.5 * s - tc - sign * 0.5 * ts).abs() / (0.5 * ts + 0.004)
        for sign in (-1, 1)
        for c, s, tc, ts in [(center, size, true_center, true_size)]
    ]
    off = torch.cat(faces, dim=-1).clamp(max=3.0).mean(-1)
    assert np.allclose(losses, 1.0 - shared + 0.2 * off.numpy())
    assert box_losses(center, size, center, size, valid).abs().max() < 1e-12
    assert box_losses(center, size, true_center, true_size, ~valid).max() == 0.0


def test_boxes_that_are_all_off_alike_are_learnt() -> None:
    """The true box is 10 % deeper than the reference's, and its back is never seen; at rest it lies 1 cm farther in."""
    evidence = [wall_and_box(seed)[0] for seed in range(8)]
    unit = float(np.linalg.norm([0.2, 0.4, 0.3]))
    true_size, true_center = torch.tensor([[[0.22, 0.4, 0.3]]]) / unit, torch.tensor([[[0.01, 0.0, 0.0]]]) / unit
    rest = true_center + torch.tensor([0.01, 0.0, 0.0]) / unit
    records = concatenate([box_records.Records(e, true_center, true_size, rest) for e in evidence])
    boxes = box_records.learn(records, 1, 80, 150, 0, False, lambda *_: None)
    center, size, farther = (values.detach().numpy() for values in boxes(wall_and_box(99)[0]))
    assert iou_rest_exact(center, size, true_center, true_size).min() > 0.97
    assert float(farther[0, 0] * unit) == pytest.approx(0.01, abs=0.002)
    again = box_records.learn(records, 1, 80, 150, 0, False, lambda *_: None)
    assert all(torch.equal(a, b) for a, b in zip(boxes.parameters(), again.parameters(), strict=True))


def test_recording_goes_on_where_it_stopped_whoever_estimates(tmp_path: Path) -> None:
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    Training(STAGE, whole, workers=2, progress=False).run()
    seen = []

    def interrupt(group: str, figures: dict[str, float], step: int) -> None:
        if group == "boxes":
            seen.append(step)
            if step == 2:
                os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        Training(STAGE, stopped, workers=0, progress=False, report=interrupt).run()
    Training(STAGE, stopped, workers=0, progress=False).run()
    assert seen == [0, 1, 2]
    assert (whole / "boxes.safetensors").read_bytes() == (stopped / "boxes.safetensors").read_bytes()
    weights = [folder / "best" / "weights.safetensors" for folder in (whole, stopped)]
    assert weights[0].read_bytes() == weights[1].read_bytes()


def test_a_run_that_learns_nothing_calibrates_what_it_begins_with(tmp_path: Path) -> None:
    Training(replace(STAGE, box_views=0), tmp_path, workers=0, progress=False).run()
    shipped, again = load_estimator("laptop"), load_estimator(tmp_path / "best")
    assert again.calibration != shipped.calibration
    tensors = zip(shipped.perception.parameters(), again.perception.parameters(), strict=True)
    assert all(torch.equal(a, b) for a, b in tensors)


def test_no_object_is_the_reference_of_itself_while_boxes_are_learnt(tmp_path: Path) -> None:
    """Given objects are in the base; in use, those that are seen will not be."""
    options = replace(STAGE, box_views=2, objects=("urdf_assets/laptop",))
    training = Training(options, tmp_path, workers=0, progress=False)
    (own,) = training.context.objects.given.train
    training.run()
    best = load_estimator(tmp_path / "best")
    learner = best_without_own_references(best, training.context)
    assert own.object_id in best.base.object_ids
    assert own.object_id not in learner.base.object_ids
    assert len(learner.base) == STAGE.base_objects


def test_a_shipped_estimator_moves_faces_and_labels_but_no_part() -> None:
    estimator = load_estimator("laptop")
    assert estimator.boxes is not None
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.5, 0.5, (800, 3)) * [0.4, 0.02, 0.3] + [0.0, 0.0, 1.0]
    with_boxes, without = estimator(points), replace(estimator, boxes=None)(points)
    assert np.array_equal(with_boxes.T_camera_part, without.T_camera_part)
    assert np.array_equal(with_boxes.part < 0, without.part < 0)
    assert not np.allclose(with_boxes.size, without.size)
    assert "boxes" in with_boxes.milliseconds
