"""One call, from a cloud to poses: any cloud, whatever its size, place and dirt."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import assume, given
from hypothesis import strategies as st

import artsim
from artperl.agent.policy import Agent
from artperl.core.clouds import Clouds
from artperl.core.estimate import Calibration
from artperl.core.pose import Theta
from artperl.core.shapes import Shapes
from artperl.data.categories import objects_of
from artperl.data.truth import to_batch, training_rows
from artperl.estimator import load_estimator, save_estimator
from artperl.evaluation import metrics
from artperl.evaluation.metrics import true_poses
from artperl.evaluation.samples import TEST_SEEDS, frozen_samples
from artperl.evaluation.scoring import score
from artperl.fitting.hypotheses import Context, References, chain_states, half_turn_about_vertical, part_weights
from artperl.fitting.options import EstimatorOptions
from artperl.fitting.search import outside
from artperl.methods.full import Estimator
from artperl.perception.network import Perception, Votes
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.references import references
from artperl.retrieval.shape_base import ShapeBase
from artsim.errors import ArtsimError, ConfigError, DatasetError
from artsim.model.camera import look_at_transform
from artsim.observing.sample import Sample
from tests.artperl.worlds import Oracle, true_votes


def test_who_sees_well_estimates_well(estimator: Estimator, sample: Sample) -> None:
    estimate = estimator(sample.points)
    rotation, center = true_poses(sample)
    assert metrics.rotation_error(estimate.rotation, rotation).max() < 3.0
    assert metrics.translation_error(estimate.translation, center, sample.diagonal).max() < 0.04
    assert (estimate.part == sample.part).mean() > 0.95
    assert estimate.state.shape == (2,)
    assert estimate.joint_type == ("free", "revolute")
    assert estimate.joint_parent.tolist() == [-1, 0]
    assert metrics.axis_error(estimate.joint_axis[1], sample.joint_axis_camera[1]) < 4.0
    assert np.allclose(estimate.rotation, estimate.T_camera_part[:, :3, :3])
    assert np.allclose(estimate.trajectory[-1], estimate.T_camera_part)
    assert ((estimate.visibility >= 0) & (estimate.visibility <= 1)).all()
    assert estimate.reference.startswith("laptop:")
    assert set(estimate.milliseconds) >= {"clean", "perception", "refine"}


def test_dirt_does_not_matter(estimator: Estimator, sample: Sample) -> None:
    rng = np.random.default_rng(0)
    dirty = np.concatenate([
        sample.points, np.full((50, 3), np.nan), rng.normal(size=(40, 3)) * 20.0, np.array([[np.inf, 0.0, 1.0]])
    ])  # fmt: skip
    estimate = estimator(dirty)
    rotation, _ = true_poses(sample)
    assert metrics.rotation_error(estimate.rotation, rotation).max() < 3.0
    shown = len(sample.points)
    assert (estimate.part[shown : shown + 50] == -1).all()
    assert (estimate.part[shown + 50 :] == -1).mean() > 0.9
    assert (estimate.part[:shown] >= 0).mean() > 0.98


@pytest.mark.parametrize("count", [12, 300, 10_000])
def test_clouds_of_any_number_of_points(estimator: Estimator, sample: Sample, count: int) -> None:
    chosen = np.random.default_rng(0).choice(len(sample.points), count)
    noise = np.random.default_rng(1).normal(size=(count, 3)) * 1e-4
    estimate = estimator(sample.points[chosen] + noise)
    assert len(estimate.part) == count
    assert np.isfinite(estimate.T_camera_part).all()


@pytest.mark.parametrize(
    "cloud", [np.zeros((0, 3)), np.full((100, 3), np.nan), np.zeros((100, 3)), np.zeros((5, 3)), np.zeros((10, 2))]
)
def test_clouds_of_nothing_are_refused(estimator: Estimator, cloud: np.ndarray) -> None:
    with pytest.raises(ArtsimError, match="points"):
        estimator(cloud)


def test_the_same_cloud_gives_the_same_estimate(estimator: Estimator, sample: Sample) -> None:
    assert np.array_equal(estimator(sample.points).T_camera_part, estimator(sample.points).T_camera_part)


def test_an_estimate_takes_one_thread_and_leaves_torch_as_it_was(estimator: Estimator, sample: Sample) -> None:
    before, used = torch.get_num_threads(), []
    hook = estimator.perception.register_forward_hook(lambda *_: used.append(torch.get_num_threads()))
    try:
        torch.set_num_threads(2)
        estimator(sample.points)
        with pytest.raises(ArtsimError):
            estimator(np.zeros((0, 3)))
        assert used == [1]
        assert torch.get_num_threads() == 2
    finally:
        hook.remove()
        torch.set_num_threads(before)


def test_what_does_not_fit_is_looked_for_again(base: ShapeBase, sample: Sample) -> None:
    torch.manual_seed(0)
    options = EstimatorOptions(references=2, agent_steps=3, retry_residual=0.0)
    oracle = Oracle(sample, 2)
    once = Estimator(oracle, base, Agent(16), replace(options, retry_residual=np.inf))(sample.points)
    assert "views around" not in once.milliseconds
    assert once.trajectory.shape == (2, 2, 4, 4)
    again = Estimator(oracle, base, Agent(16), options)(sample.points)
    assert again.milliseconds["views around"] > 0.0
    # An agent that knows nothing does no harm: where it leads competes with the other starts.
    assert again.residual <= once.residual
    rotation, _ = true_poses(sample)
    assert metrics.rotation_error(again.rotation, rotation).max() < 3.0


def test_only_chains_of_joints_are_searched_for_down_the_tree(estimator: Estimator, sample: Sample) -> None:
    (seen,) = frozen_samples(["robot_arm"], 1, 1, parts="any", max_parts=10)
    arm = ShapeBase.of(objects_of(["robot_arm"], 1, TEST_SEEDS, "any", 10), 64)
    for shown, base in ((sample, estimator.base), (seen, by_boxes(arm))):
        oracle, cloud = Oracle(shown, len(shown.joint_type)), torch.from_numpy(shown.points)[None]
        clouds = Clouds.of(cloud)
        perceived = oracle(clouds.points)
        row, shapes = references(base, perceived, 1)
        context = Context(cloud, clouds, perceived, References(shapes, row), {}, None, EstimatorOptions())
        proposed = chain_states(context, None)
        assert (proposed is not None) == (shown is seen)
        assert chain_states(replace(context, options=EstimatorOptions(beam=0)), None) is None


def test_parts_count_by_the_root_of_their_points_but_no_point_for_more_than_eight() -> None:
    part = torch.tensor([[0] * 1600 + [1] * 400 + [2], [0] * 500 + [2] * 1501])
    weight = part_weights(part)
    assert [weight[0, part[0] == k].sum().item() for k in range(3)] == [1600.0, 800.0, 8.0]
    total = [weight[1, part[1] == k].sum().item() for k in (0, 2)]
    assert total[0] / total[1] == pytest.approx((500 / 1501) ** 0.5)


def test_an_estimator_comes_back_from_its_folder(base: ShapeBase, sample: Sample, tmp_path: Path) -> None:
    torch.manual_seed(0)
    options = EstimatorOptions(references=2, agent_steps=2)
    made = Estimator(Perception(2, 16), base, Agent(16), options, Calibration(1.0, -2.0, -3.0, 4.0))
    save_estimator(made, tmp_path / "made", {"note": "untrained"})
    back = load_estimator(tmp_path / "made")
    assert (back.options, back.calibration) == (options, made.calibration)
    for name, tensor in made.perception.state_dict().items():  # half precision
        torch.testing.assert_close(back.perception.state_dict()[name], tensor, rtol=5e-4, atol=1e-7)
    save_estimator(back, tmp_path / "again", {})
    again = load_estimator(tmp_path / "again")
    np.testing.assert_array_equal(again(sample.points).T_camera_part, back(sample.points).T_camera_part)


@pytest.mark.parametrize("spoiled", ["estimator.json", "weights.safetensors", "base.npz"])
def test_damaged_folders_are_refused(base: ShapeBase, tmp_path: Path, spoiled: str) -> None:
    folder = tmp_path / "made"
    save_estimator(Estimator(Perception(2, 16), base), folder, {})
    (folder / spoiled).write_bytes(b"damaged")
    with pytest.raises(DatasetError, match="Fix"):
        load_estimator(folder)


def test_a_missing_estimator_says_which_there_are() -> None:
    with pytest.raises(DatasetError, match="come"):
        load_estimator("no-such-category")


def test_options_change_as_an_estimator_is_loaded(base: ShapeBase, tmp_path: Path) -> None:
    save_estimator(Estimator(Perception(2, 16), base), tmp_path, {})
    assert load_estimator(tmp_path, seen_from=(-75.0, 75.0), squared=False).options == EstimatorOptions(
        seen_from=(-75.0, 75.0), squared=False
    )
    with pytest.raises(ConfigError, match="sene_from"):
        load_estimator(tmp_path, sene_from=(-75.0, 75.0))
    with pytest.raises(ConfigError, match="LOW HIGH"):
        load_estimator(tmp_path, seen_from=(75.0, -75.0))


@given(
    azimuth=st.floats(-180.0, 180.0), elevation=st.floats(-60.0, 60.0), middle=st.floats(-180.0, 180.0),
    half=st.floats(0.0, 120.0),
)  # fmt: skip
def test_what_is_seen_from_elsewhere_is_told(azimuth: float, elevation: float, middle: float, half: float) -> None:
    """By the arc on a sphere about the object, from the camera to the nearest meridian of the range; or from below."""
    side, up = np.deg2rad([azimuth, elevation])
    eye = np.array([-np.cos(side) * np.cos(up), -np.sin(side) * np.cos(up), np.sin(up)])
    T = np.linalg.inv(look_at_transform(eye, np.zeros(3)))
    trees = Shapes.from_objects([artsim.make("laptop", 1)], 8, dtype=torch.float64).trees
    theta = replace(
        Theta.at_rest(trees), rotation=torch.from_numpy(T[None, :3, :3]), translation=torch.from_numpy(T[None, :3, 3])
    )
    arc = max(abs((azimuth - middle + 180.0) % 360.0 - 180.0) - half, 0.0) * np.cos(up)
    assume(abs(arc - 15.0) > 1e-6 and abs(elevation + 25.0) > 1e-6)
    below = elevation < -25.0
    assert bool(outside(theta, (middle - half, middle + half))) == (arc > 15.0 or below)
    assert not outside(theta, None)
    round_there = outside(half_turn_about_vertical(theta), (azimuth - 10.0, azimuth + 10.0))
    assert bool(round_there) == (170.0 * np.cos(up) > 15.0 or below)


def test_clouds_know_where_they_were(sample: Sample) -> None:
    points = torch.from_numpy(sample.points)[None]
    clouds = Clouds.of(points)
    back = clouds.points * clouds.radius[:, None, None] + clouds.center[:, None]
    torch.testing.assert_close(back, points)


class Voter(Oracle):
    """Knows of each point what its part is like, and no numbers."""

    votes = True

    def forward(self, points: torch.Tensor) -> Votes:  # type: ignore[override]
        rows = training_rows(self.sample, 2048, self.num_rows)
        clouds, truth = to_batch({k: torch.from_numpy(np.asarray(v)[None]) for k, v in rows.items()})
        nearest = torch.cdist(points, clouds.points).argmin(-1)[0]
        return Votes(**{name: v if v.ndim == 1 else v[:, nearest] for name, v in vars(true_votes(truth)).items()})


@pytest.mark.slow
def test_a_cabinet_of_a_mix_that_no_reference_has_is_put_together_from_votes() -> None:
    """Parts, axes and states of fresh furniture, from a base of other furniture."""
    base = by_boxes(ShapeBase.of(objects_of(["storage_furniture"], 12, 2_000_000, "any", 10), 64))
    seen = [s for s in frozen_samples(["storage_furniture"], 8, 1, parts="any", max_parts=10)
            if np.bincount(s.part, minlength=len(s.joint_type)).min() > 160]  # fmt: skip
    assert len(seen) >= 4
    right = []
    for sample in seen:
        estimate = Estimator(Voter(sample, 10), base)(sample.points)
        assert estimate.joint_parent.tolist() == sample.joint_parent.tolist()
        sliding = [kind == "prismatic" for kind in sample.joint_type]
        assert [kind == "prismatic" for kind in estimate.joint_type] == sliding
        right += (score(Estimator(Voter(sample, 10), base), sample).rotation < 10.0).tolist()
    assert np.mean(right) > 0.9


def test_drawers_slide_as_their_states_say_and_not_into_their_case() -> None:
    drawers = load_estimator("drawer")
    (sample,) = frozen_samples(["drawer"], 1, 1)
    assert drawers.boxes is not None
    boxes = copy.deepcopy(drawers.boxes)
    with torch.no_grad():
        boxes.among[-1].bias[-1] = -100.0  # all are farther in than they can be
    for estimator, shut in ((drawers, False), (replace(drawers, boxes=boxes), True)):
        estimate = estimator(sample.points)
        T = estimate.T_camera_part
        apart = np.einsum("kji,kj->ki", np.broadcast_to(T[0, :3, :3], (4, 3, 3)), T[:, :3, 3] - T[0, :3, 3])
        assert np.allclose(np.linalg.norm(apart, axis=1), np.abs(estimate.state), atol=1e-3)
        assert (estimate.state > -1e-9).all()
        assert shut == np.allclose(estimate.state, 0.0)
