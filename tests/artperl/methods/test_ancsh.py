"""A-NCSH with networks that know the truth is right, whatever the joints; it comes back from disk as it was."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

import artsim
from artperl.data.categories import objects_of
from artperl.data.truth import to_batch, training_rows
from artperl.evaluation.scoring import Scored, score
from artperl.inputs.detections import Detection
from artperl.methods.ancsh import ANCSH, ancsh_networks
from artperl.methods.estimator_files import load_estimator
from artperl.methods.estimator_writing import save_estimator
from artperl.methods.protocol import NetworkSizes
from artperl.perception.ancsh_networks import CoordinateNetwork, Coordinates, JointNetwork, JointPoints
from artperl.retrieval.shape_base import ShapeBase
from artperl.scene.estimator import SceneEstimator
from artperl.training.ancsh_stages import coordinate_loss, joint_loss, joint_targets, miou_loss
from artperl.training.options import ANCSH_PRESETS
from artperl.training.run import Training
from artsim.errors import ConfigError
from artsim.formats.coco import mask_record
from artsim.model.frame import BACKGROUND
from artsim.observing.sample import Sample
from tests.artperl.worlds import view


def truth_of(sample: Sample, K: int):  # type: ignore[no-untyped-def]
    rows = training_rows(sample, len(sample.points), K)
    return to_batch({name: torch.from_numpy(np.asarray(value)[None]) for name, value in rows.items()})


class TrueCoordinates(CoordinateNetwork):
    """Knows the place of every point of one sample, but for a part that it does not see."""

    def __init__(self, sample: Sample, K: int, unseen: int = -1):
        super().__init__(K, 16)
        self.clouds, self.truth = truth_of(sample, K)
        self.unseen = unseen

    def forward(self, points: torch.Tensor) -> Coordinates:
        near, truth = torch.cdist(points, self.clouds.points).argmin(-1)[0], self.truth
        part = torch.where(truth.part[:, near] == self.unseen, 0, truth.part[:, near])
        box = torch.linalg.vector_norm(truth.box_size, dim=-1)
        npcs = (truth.canonical[:, near, None] - truth.box_center[:, None]) / box[:, None, :, None] + 0.5
        scale = box[0, part][..., None]
        shift = truth.box_center[0, part] + 0.5 - 0.5 * scale
        logits = torch.nn.functional.one_hot(part, self.num_rows).float()
        return Coordinates(20.0 * logits, npcs, scale, shift)


class TrueJoints(JointNetwork):
    """Votes as points should."""

    def __init__(self, sample: Sample, K: int):
        super().__init__(K, 16)
        self.clouds, self.truth = truth_of(sample, K)

    def forward(self, points: torch.Tensor) -> JointPoints:
        near = torch.cdist(points, self.clouds.points).argmin(-1)[0]
        joint, axis, offset, heat = (values[:, near] for values in joint_targets(self.truth))
        logits = torch.nn.functional.one_hot(joint, self.num_rows).float()
        return JointPoints(20.0 * logits, axis, offset, torch.logit(heat, 1e-6))


def told(category: str, seed: int, unseen: int = -1) -> tuple[Scored, Sample, ANCSH]:
    obj = objects_of([category], 1, seed)[0]
    sample, K = view(obj, seed), len(obj)
    method = ANCSH(TrueCoordinates(sample, K, unseen), TrueJoints(sample, K), ShapeBase.of([obj], 32))
    return score(method, sample), sample, method


@pytest.mark.parametrize("category", ["laptop", "eyeglasses", "drawer"])
def test_with_true_places_and_votes_the_poses_are_true(category: str) -> None:
    scored, sample, method = told(category, 40)
    seen = method(sample.points).visibility > 0  # of three shut drawers, one may not show
    assert seen.sum() >= 2
    assert scored.rotation.max() < 0.5
    assert scored.translation[seen].max() < 0.01
    moving = np.arange(len(method.prior)) > 0
    assert scored.errors["joint_axis_deg"].max() < 0.5
    estimate = method(sample.points)
    np.testing.assert_allclose(estimate.state[moving & seen], sample.joint_state[moving & seen], atol=0.02)
    true = sample.joint_origin_camera - estimate.joint_origin
    for k in np.flatnonzero([kind == "revolute" for kind in estimate.joint_type]):
        off = np.linalg.norm(np.cross(true[k], sample.joint_axis_camera[k]))
        assert off < 0.02 * sample.diagonal


def test_a_part_that_nobody_sees_hangs_where_its_joint_has_it() -> None:
    scored, sample, method = told("drawer", 41, unseen=2)
    estimate = method(sample.points)
    assert not scored.failed
    assert np.isfinite(estimate.T_camera_part).all()
    assert estimate.visibility[2] == 0.0
    assert scored.rotation[2] < 1.0  # a slide turns nothing


def test_points_vote_for_the_joint_beside_them_and_for_no_other() -> None:
    obj = objects_of(["eyeglasses"], 1, 3)[0]
    sample = view(obj, 3)
    _, truth = truth_of(sample, len(obj))
    joint, axis, offset, heat = joint_targets(truth)
    near = (heat > 0)[0]
    assert set(joint[0][near].tolist()) <= {1, 2}
    assert ((truth.part[0] == 0) | (truth.part[0] == joint[0]))[near].all()
    place = truth.canonical[0] + 0.2 * (1.0 - heat[0, :, None]) * offset[0]
    pivot = truth.box_center[0] + truth.joint[0, :, 6:]
    away = place - pivot[joint[0]]
    across = away - (away * axis[0]).sum(-1, keepdim=True) * axis[0]
    assert torch.linalg.vector_norm(across, dim=-1)[near].max() < 1e-4


def test_true_answers_have_no_loss() -> None:
    obj = artsim.make("laptop", 4)
    sample = view(obj, 4)
    clouds, truth = truth_of(sample, 2)
    loss, figures = coordinate_loss(TrueCoordinates(sample, 2), clouds, truth, truth)
    assert loss.item() < 1e-3
    assert figures["accuracy"] == 1.0
    loss, _ = joint_loss(TrueJoints(sample, 2), clouds, truth, truth)
    assert loss.item() < 1e-2
    assert miou_loss(20.0 * torch.tensor([[[1.0, 0.0], [0.0, 1.0]]]), torch.tensor([[1, 0]])).item() > 0.99


def test_networks_from_disk_say_what_they_said_and_images_take_the_method_by_its_folder(tmp_path: Path) -> None:
    """RANSAC on untrained networks may choose other triples: what the networks say is compared, not the poses."""
    torch.manual_seed(0)
    base, sample = ShapeBase.of([artsim.make("laptop", n) for n in range(3)], 32), view(artsim.make("laptop", 5), 2)
    networks = ancsh_networks(NetworkSizes(2, 16))
    for network in networks.values():
        network.half().float()  # as precise as files are
    method = ANCSH(**networks, base=base)
    save_estimator(method, tmp_path, {})
    loaded = load_estimator(tmp_path, method="ancsh")
    points = torch.from_numpy(sample.points[None].astype(np.float32))
    with torch.inference_mode():
        before, after = method.coordinates(points), loaded.coordinates(points)
        for name in ("part_logits", "npcs", "scale", "shift"):
            torch.testing.assert_close(getattr(after, name), getattr(before, name), rtol=1e-3, atol=1e-4)
    obj, camera = artsim.make("laptop", 5).with_diagonal(0.4), artsim.Camera.look_at((-0.9, 0.35, 0.6), (0, 0, 0))
    frame = artsim.render(obj, obj.tree.rest, camera)
    told = mask_record(frame.part_ids != BACKGROUND)
    found = Detection(0, "laptop", 1.0, told["segmentation"], tuple(told["bbox"]), (camera.width, camera.height))
    scene = SceneEstimator({"laptop": tmp_path}, seen_from=(-75.0, 75.0))
    (posed,) = scene(None, frame.depth, camera.K, [found]).objects
    assert posed.estimate is not None
    assert len(posed.estimate.rotation) == 2


def test_objects_with_different_trees_are_refused_before_anything_is_learnt(tmp_path: Path) -> None:
    options = replace(ANCSH_PRESETS["quick"], categories=("laptop", "drawer"), base_objects=2)
    with pytest.raises(ConfigError, match="different kinematic trees"):
        Training(options, tmp_path)
