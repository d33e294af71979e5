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
from artperl import metrics
from artperl.categories import objects_of
from artperl.checkpoint import load_estimator, save_estimator
from artperl.data import Clouds, to_batch, training_rows
from artperl.embedding import by_boxes
from artperl.estimator import (
    Calibration,
    Estimate,
    Estimator,
    brought_to_rest,
    clean,
    draw,
    labels_by_boxes,
    slid,
    widen,
)
from artperl.evaluation import (
    TEST_SEEDS,
    Scored,
    calibrate,
    compare,
    evaluate,
    found,
    frozen_samples,
    headline,
    mistake,
    retry_residual,
    score,
    summary,
    table,
    true_poses,
)
from artperl.networks.agent import Agent
from artperl.networks.perception import Perceived, Perception, Votes
from artperl.pose import Theta
from artperl.retrieval import ShapeBase
from artperl.search import EstimatorOptions, astray, evened, turned_round
from artperl.shapes import Shapes
from artsim.camera import look_at_transform
from artsim.errors import ArtsimError, ConfigError, DatasetError
from artsim.sample import Sample
from tests.artperl.worlds import true_votes


class Oracle(Perception):
    """Knows every point of one sample, by the nearest of its true points."""

    def __init__(self, sample: Sample, rows: int):
        super().__init__(rows, width=16)
        self.sample = sample

    def forward(self, points: torch.Tensor) -> Perceived:
        rows = training_rows(self.sample, 2048, self.num_rows)
        clouds, truth = to_batch({k: torch.from_numpy(np.asarray(v)[None]) for k, v in rows.items()})
        nearest = torch.cdist(points, clouds.points).argmin(-1)[0]
        return Perceived(
            20.0 * torch.nn.functional.one_hot(truth.part[:, nearest], self.num_rows).float(),
            truth.canonical[:, nearest],
            torch.full((1, points.shape[1]), -3.0),
            2.0 * truth.part_valid.float() - 1.0,
            truth.box_center,
            truth.box_size,
            truth.diagonal.log(),
        )


@pytest.fixture(scope="module")
def sample() -> Sample:
    (one,) = frozen_samples(["laptop"], 1, 1)
    return one


@pytest.fixture(scope="module")
def base() -> ShapeBase:
    return by_boxes(ShapeBase.of([artsim.make("laptop", seed) for seed in range(8)], 128))


@pytest.fixture(scope="module")
def estimator(base: ShapeBase, sample: Sample) -> Estimator:
    return Estimator(Oracle(sample, 2), base)


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
    assert "agent" not in once.milliseconds
    assert once.trajectory.shape == (2, 2, 4, 4)
    again = Estimator(oracle, base, Agent(16), options)(sample.points)
    assert again.milliseconds["agent"] > 0.0
    # An agent that knows nothing does no harm: where it leads competes with the other starts.
    assert again.residual <= once.residual
    rotation, _ = true_poses(sample)
    assert metrics.rotation_error(again.rotation, rotation).max() < 3.0


def test_only_chains_of_joints_are_searched_for_down_the_tree(estimator: Estimator, sample: Sample) -> None:
    assert "beam" not in estimator(sample.points).milliseconds
    (seen,) = frozen_samples(["robot_arm"], 1, 1, parts="any", max_parts=10)
    arm = ShapeBase.of(objects_of(["robot_arm"], 1, TEST_SEEDS, "any", 10), 64)
    knows = Oracle(seen, len(seen.joint_type))
    with_beam = Estimator(knows, by_boxes(arm))
    without = Estimator(knows, with_beam.base, options=EstimatorOptions(beam=0))
    assert with_beam(seen.points).milliseconds["beam"] > 0.0
    assert "beam" not in without(seen.points).milliseconds


def test_outliers_are_left_out_and_the_object_is_not() -> None:
    rng = np.random.default_rng(0)
    cloud = rng.uniform(size=(3000, 3)) * [1.0, 1.0, 0.01]
    kept = clean(np.concatenate([cloud, rng.uniform(5.0, 50.0, size=(30, 3))]))
    assert (kept < 3000).all()
    assert len(kept) > 2990


@pytest.mark.parametrize("away", [3.0, 1e3, 1e9, 1e300])
@pytest.mark.parametrize(("together", "kept"), [(1, False), (3, False), (4, True), (9, True)])
def test_points_belong_to_the_object_from_four_together_however_far_away(
    away: float, together: int, kept: bool
) -> None:
    rng = np.random.default_rng(0)
    blob = rng.random((3000, 3))
    few = np.full((together, 3), away) + (rng.random((together, 3)) * 0.01 if away < 1e9 else 0.0)
    found = clean(np.concatenate([few, blob]))
    assert np.isin(np.arange(together), found).all() == np.isin(np.arange(together), found).any() == kept
    assert len(found) >= 2990


def test_a_thin_leg_of_a_few_points_is_no_outlier() -> None:
    plate = np.random.default_rng(0).uniform(size=(2000, 3)) * [1.0, 1.0, 0.0]
    leg = np.array([0.5, 0.5, -0.06]) * [[1.0, 1.0, n] for n in range(1, 7)]
    assert len(clean(np.concatenate([plate, leg]))) == 2006


def test_points_are_of_a_part_whose_box_they_are_in() -> None:
    """Two boxes side by side, the second one turned: odds decide within both and within neither, boxes elsewhere."""
    T = np.tile(np.eye(4), (2, 1, 1))
    T[1, :3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    center, size = np.array([[0.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.array([[1.0, 1.0, 1.0], [0.2, 1.2, 1.0]])
    points = np.array([[0.2, 0.0, 0.0], [0.2, 0.05, 0.0], [0.45, 0.0, 0.0], [1.4, 0.0, 0.0], [0.0, 0.0, 0.0]])
    odds = np.log([[0.1, 0.8, 0.1], [0.8, 0.1, 0.1], [0.3, 0.6, 0.1], [0.9, 0.05, 0.05], [np.nan] * 3])
    assert labels_by_boxes(points, T, center, size, odds, 0.01).tolist() == [0, 0, 1, 1, -1]


def test_parts_count_by_the_root_of_their_points_but_no_point_for_more_than_eight() -> None:
    part = torch.tensor([[0] * 1600 + [1] * 400 + [2], [0] * 500 + [2] * 1501])
    weight = evened(part)
    assert [weight[0, part[0] == k].sum().item() for k in range(3)] == [1600.0, 800.0, 8.0]
    total = [weight[1, part[1] == k].sum().item() for k in (0, 2)]
    assert total[0] / total[1] == pytest.approx((500 / 1501) ** 0.5)


def test_draws_take_every_point_before_any_twice() -> None:
    rng = np.random.default_rng(0)
    assert sorted(draw(10, 10, rng)) == list(range(10))
    assert np.bincount(draw(10, 25, rng)).tolist().count(3) == 5
    assert len(set(draw(100, 30, rng))) == 30


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
    with pytest.raises(DatasetError, match="mend"):
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
    assert bool(astray(theta, (middle - half, middle + half))) == (arc > 15.0 or below)
    assert not astray(theta, None)
    round_there = astray(turned_round(theta), (azimuth - 10.0, azimuth + 10.0))
    assert bool(round_there) == (170.0 * np.cos(up) > 15.0 or below)


def test_a_perfect_estimate_has_no_error(estimator: Estimator, sample: Sample) -> None:
    rotation, center = true_poses(sample)
    perfect = replace(
        estimator(sample.points), rotation=rotation, translation=center, size=sample.box_size,
        T_camera_part=sample.T_camera_part, state=sample.joint_state, joint_axis=sample.joint_axis_camera,
        part=sample.part.astype(np.int64),
    )  # fmt: skip
    scored = compare(perfect, sample, 1.0)
    for name, value in {
        "rotation": 0.0,
        "translation": 0.0,
        "iou_exact": 1.0,
        "iou_rest_exact": 1.0,
        "state": 0.0,
    }.items():
        np.testing.assert_allclose(getattr(scored, name), value, atol=1e-6)
    assert scored.right
    assert scored.found == 1.0
    assert scored.segmentation == 1.0


def test_parts_are_found_whatever_their_numbers_are(estimator: Estimator, sample: Sample) -> None:
    rotation, center = true_poses(sample)
    seen = replace(estimator(sample.points), rotation=rotation, translation=center)
    assert found(replace(seen, rotation=rotation[::-1], translation=center[::-1]), sample) == 1.0
    away = center + [[0, 0, 0], [0, 0, 0.06 * sample.diagonal]]
    assert found(replace(seen, translation=away), sample) == 0.5
    twice = replace(seen, rotation=rotation[[0, 1, 1, 1]], translation=center[[0, 1, 1, 1]])
    assert found(twice, sample) == 0.5  # two parts too many
    assert found(replace(seen, rotation=rotation[:1], translation=center[:1]), sample) == 0.5


def test_failures_count_with_the_worst_values(sample: Sample) -> None:
    class Blind(Estimator):
        def __call__(self, points: object) -> None:  # type: ignore[override]
            raise ArtsimError("nothing is seen")

    blind = Blind.__new__(Blind)
    (scored,) = evaluate(blind, [sample])
    assert scored.failed
    assert (scored.rotation == 180.0).all()
    figures = summary([scored])
    assert figures["laptop"]["failures"] == 1
    assert "1 failures" in table(figures)
    assert headline([scored]) == 10.0


def test_views_count_alike_in_the_score_however_many_parts_they_have(estimator: Estimator, sample: Sample) -> None:
    (scored,) = evaluate(estimator, [sample])
    two, four = (replace(scored, rotation=np.full(n, n / 2), translation=np.full(n, n / 200)) for n in (2, 4))
    assert headline([two] * 3 + [four]) == pytest.approx((1.0 + 1.25) / 2)  # median and mean of 1, 1, 1, 2


def test_the_table_holds_medians_and_means(estimator: Estimator, sample: Sample) -> None:
    one = evaluate(estimator, [sample])[0]
    scored = [replace(one, rotation=np.array([r, 2.0 * r])) for r in (1.0, 2.0, 6.0)]
    parts = summary(scored)["laptop"]["parts"]
    assert parts[0]["rotation_deg"] == {"median": 2.0, "mean": 3.0}
    assert parts[1]["rotation_deg"] == {"median": 4.0, "mean": 6.0}
    translation = parts[0]["translation_percent_diagonal"]["median"]
    assert parts[0]["translation_partnet"]["median"] == pytest.approx(0.02 * translation)
    assert f"{'laptop 1':14s}     4.00   6.00" in table(summary(scored))


def test_a_quarter_is_looked_for_again(estimator: Estimator, sample: Sample) -> None:
    one = evaluate(estimator, [sample])[0]
    scored = [replace(one, residual=r) for r in np.linspace(0.0, 0.1, 101)] + [replace(one, residual=np.inf)]
    assert retry_residual(scored) == pytest.approx(0.075)
    assert retry_residual([]) == 0.0


def test_confidence_is_calibrated(estimator: Estimator, sample: Sample) -> None:
    """Where half of the estimates with a residual are right, confidence says so; and it never rises with it."""
    one: Scored = evaluate(estimator, [sample])[0]
    rng = np.random.default_rng(0)
    residual = rng.uniform(0.0, 0.1, 2000)
    chance = 1.0 / (1.0 + np.exp(80.0 * (residual - 0.05)))
    right = rng.random(2000) < chance
    scored = [
        replace(one, residual=r, disagreement=0.02, visibility=0.5, rotation=np.full(2, 1.0 if ok else 90.0))
        for r, ok in zip(residual, right, strict=True)
    ]
    fitted = calibrate(scored)
    found = np.array([fitted(r, 0.02, 0.5) for r in residual])
    assert np.abs(found - chance).mean() < 0.05
    assert fitted(0.3, 0.3, 0.5) < 0.01
    assert calibrate([]) == Calibration()


@pytest.mark.parametrize("better", [True, False])
def test_confidence_takes_notice_of_what_does_not_show(estimator: Estimator, sample: Sample, better: bool) -> None:
    """Where estimates of what hardly shows are wrong more often, it says by how much; it never trusts them more."""
    one: Scored = evaluate(estimator, [sample])[0]
    rng = np.random.default_rng(0)
    shows = rng.uniform(0.0, 1.0, 2000)
    chance = 1.0 / (1.0 + np.exp((-1.0 if better else 1.0) * 12.0 * (shows - 0.3)))
    right = rng.random(2000) < chance
    fitted = calibrate([
        replace(one, residual=0.004, disagreement=0.02, visibility=v, rotation=np.full(2, 1.0 if ok else 90.0))
        for v, ok in zip(shows, right, strict=True)
    ])  # fmt: skip
    found = np.array([fitted(0.004, 0.02, v) for v in np.linspace(0.0, 1.0, 11)])
    assert (np.diff(found) >= 0.0).all()
    if better:
        assert np.abs(np.array([fitted(0.004, 0.02, v) for v in shows]) - chance).mean() < 0.05
    else:
        assert np.ptp(found) < 1e-3


def test_a_summary_says_what_confidence_is_worth(estimator: Estimator, sample: Sample) -> None:
    right, wrong = (
        replace(
            evaluate(estimator, [sample])[0], rotation=np.full(2, degrees), translation=np.zeros(2), confidence=sure
        )
        for degrees, sure in ((1.0, 0.9), (90.0, 0.2))
    )
    told = summary([right, right, wrong])["laptop"]
    assert (told["confidence_of_right"], told["confidence_of_wrong"], told["confidence_auroc"]) == (0.9, 0.2, 1.0)
    assert "AUROC 1.00" in table({"laptop": told})
    told = summary([right])["laptop"]
    assert (told["confidence_of_wrong"], told["confidence_auroc"]) == (None, None)
    assert "AUROC" not in table({"laptop": told})


def test_estimates_with_other_parts_are_wrong_whatever_they_fit(estimator: Estimator, sample: Sample) -> None:
    (other,) = evaluate(estimator, frozen_samples(["eyeglasses"], 1, 1))
    assert other.failed
    assert np.isfinite([other.residual, other.disagreement]).all()
    told = {name: getattr(other, name) for name in ("residual", "disagreement", "visibility")}
    right = [replace(evaluate(estimator, [sample])[0], **told)]
    among = calibrate(20 * right + 20 * [other])
    assert among(**told) == pytest.approx(0.5, abs=0.02)
    assert calibrate(20 * right)(**told) > 0.9


def test_whatever_is_said_of_another_category_is_wrong(estimator: Estimator) -> None:
    (scored,) = mistake(estimator, frozen_samples(["bucket"], 1, 1))
    assert not scored.right
    assert np.isfinite([scored.residual, scored.disagreement]).all()


def test_frozen_samples_are_always_the_same() -> None:
    one, other = (frozen_samples(["laptop"], 2, 2) for _ in range(2))
    assert all(np.array_equal(a.points, b.points) for a, b in zip(one, other, strict=True))
    assert len({s.object_id for s in one}) == 2
    assert len(one) == 4


def test_clouds_know_where_they_were(sample: Sample) -> None:
    points = torch.from_numpy(sample.points)[None]
    clouds = Clouds.of(points)
    back = clouds.points * clouds.radius[:, None, None] + clouds.center[:, None]
    torch.testing.assert_close(back, points)


def test_points_widen_boxes_and_never_narrow_them() -> None:
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    inside = rng.uniform([-0.5, -0.5, 0.0], [0.5, 1.5, 0.2], (20_000, 3))  # on one side, and farther along y
    points = np.concatenate([inside @ turn.T + [1.0, 2.0, 3.0], rng.normal(size=(20, 3))])
    part = np.repeat([0, 1], [20_000, 20])
    rotation, center = np.stack([turn, np.eye(3)]), np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]])
    size = np.ones((2, 3))
    moved, grown = widen(rotation, center, size, points, part)
    np.testing.assert_allclose(grown[0], [1.0, 1.992, 1.0], atol=0.003)  # of 2, 0.4 % are left out at the far end
    np.testing.assert_allclose((moved[0] - center[0]) @ turn, [0.0, 0.496, 0.0], atol=0.003)
    np.testing.assert_array_equal(moved[1], center[1])  # twenty points say nothing
    np.testing.assert_array_equal(grown[1], size[1])
    feet = np.array([[0.1, 0.1, -0.9]]) + 1e-3 * rng.normal(size=(120, 3))  # 0.6 % of the points
    _, taller = widen(
        rotation, center, size, np.concatenate([points, feet @ turn.T + [1.0, 2.0, 3.0]]), np.append(part, [0] * 120)
    )
    np.testing.assert_allclose(taller[0], [1.0, 1.992, 1.4], atol=0.01)


class Voter(Oracle):
    """Knows of each point what its part is like, and no numbers."""

    votes = True

    def forward(self, points: torch.Tensor) -> Votes:  # type: ignore[override]
        rows = training_rows(self.sample, 2048, self.num_rows)
        clouds, truth = to_batch({k: torch.from_numpy(np.asarray(v)[None]) for k, v in rows.items()})
        nearest = torch.cdist(points, clouds.points).argmin(-1)[0]
        return Votes(**{name: v if v.ndim == 1 else v[:, nearest] for name, v in vars(true_votes(truth)).items()})


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


@pytest.mark.parametrize("seed", range(4))
def test_what_has_slid_farther_is_where_it_was_and_was_elsewhere_at_rest(seed: int) -> None:
    """Random trees: at rest, what a drawer carries lies as much farther back."""
    (sample,) = frozen_samples(["random_tree"], 1, 1, first_seed=seed)
    K, rng = len(sample.box_size), np.random.default_rng(seed)
    estimate = Estimate(
        rotation=sample.T_camera_part[:, :3, :3], translation=true_poses(sample)[1], size=sample.box_size,
        T_camera_part=sample.T_camera_part, state=sample.joint_state, joint_type=sample.joint_type,
        joint_parent=sample.joint_parent, joint_axis=sample.joint_axis_camera,
        joint_origin=sample.joint_origin_camera, part=sample.part.astype(np.int64), reference="", residual=0.0,
        disagreement=0.0, visibility=np.ones(K), confidence=1.0, trajectory=sample.T_camera_part[None], milliseconds={},
    )  # fmt: skip
    farther = np.where(np.array(sample.joint_type) == "prismatic", rng.normal(0.0, 0.1, K), 0.0)
    moved = slid(estimate, farther)
    assert np.array_equal(moved.translation, estimate.translation)
    assert np.allclose(moved.state, sample.joint_state + farther)
    assert np.array_equal(moved.trajectory[-1], moved.T_camera_part)
    back = [brought_to_rest(each.translation, each.T_camera_part) for each in (estimate, moved)]
    for k in range(K):
        carriers, above = [k], int(sample.joint_parent[k])
        while above >= 0:
            carriers, above = [*carriers, above], int(sample.joint_parent[above])
        expected = -sum(farther[j] * sample.joint_axis[j] for j in carriers)
        assert np.allclose(back[1][k] - back[0][k], expected, atol=1e-9)


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
