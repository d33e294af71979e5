"""What refinement must do: pull references onto clouds, obey the joints, and never make anything worse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

import artsim
from artperl.core.pose import AxisPrior, Theta, Trees, clamp_state, pose_parts, theta_from_parts
from artperl.core.rotations import rotate, rotation_from_vector
from artperl.core.shapes import Observed, Shapes, spread_points
from artperl.evaluation import metrics
from artperl.fitting.correspondence import Matches, Target, match
from artperl.fitting.levenberg_marquardt import RefineOptions, _maps, _moved, _rates, leaning, refine
from artperl.fitting.paper_energy import joint_energy, part_energy, refine_by_gradient
from artsim.errors import ConfigError
from artsim.model.draws import StateOptions, ViewOptions, sample_state, sample_view
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample

KNOWN_SHAPE = RefineOptions(sigma_scale=0.0, sigma_aspect=0.0, sigma_stretch=0.0, sigma_shift=0.0)


def views(category: str, count: int, first_seed: int = 0) -> tuple[list[ArticulatedObject], list[Sample]]:
    """Objects of diagonal 1, and a partial cloud of each in a random state."""
    rng = np.random.default_rng([first_seed, count])
    objects = [artsim.make(category, first_seed + i).with_diagonal(1.0) for i in range(count)]
    samples = []
    for obj in objects:
        q = sample_state(obj, StateOptions(), rng)
        samples.append(artsim.observe(obj, q, sample_view(obj, q, ViewOptions(), rng), num_points=512, rng=rng))
    return objects, samples


def observe(samples: list[Sample]) -> Observed:
    part = torch.from_numpy(np.stack([s.part for s in samples]).astype(np.int64))
    return Observed.of(torch.from_numpy(np.stack([s.points for s in samples])), part)


def true_theta(shapes: Shapes, samples: list[Sample]) -> Theta:
    """The state in which a reference meets each sample's true part poses and boxes."""
    B, P = shapes.trees.valid.shape
    rotation = np.tile(np.eye(3), (B, P, 1, 1))
    center, size = np.zeros((B, P, 3)), np.ones((B, P, 3))
    for b, s in enumerate(samples):
        K = len(s.joint_type)
        rotation[b, :K], size[b, :K] = s.T_camera_part[:, :3, :3], s.box_size
        center[b, :K] = (rotation[b, :K] @ s.box_center[..., None])[..., 0] + s.T_camera_part[:, :3, 3]
    poses = (torch.from_numpy(x).to(shapes.points.dtype) for x in (rotation, center, size))
    return theta_from_parts(shapes.trees, shapes.box_center, shapes.box_size, *poses)


def perturbed(shapes: Shapes, theta: Theta, degrees: float, length: float, seed: int = 0) -> Theta:
    """Turned about the root's centre, moved, and with every joint off, by as much as said; the shape unchanged."""
    rng = torch.Generator().manual_seed(seed)
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    axis, way = (torch.nn.functional.normalize(torch.randn(len(theta), 3, generator=rng), dim=-1) for _ in range(2))
    turn = rotation_from_vector((np.deg2rad(degrees) * axis).to(theta.state.dtype))
    pivot = posed.center[:, 0]
    sign = torch.rand(theta.state.shape, generator=rng).sub(0.5).sign()
    amount = torch.where(shapes.trees.turn != 0, float(np.deg2rad(degrees)), length)
    return Theta(
        turn @ theta.rotation,
        (turn @ (theta.translation - pivot)[..., None])[..., 0] + pivot + length * way.to(theta.state.dtype),
        torch.zeros_like(theta.log_scale),
        clamp_state(shapes.trees, theta.state + (sign * amount).to(theta.state.dtype)),
        torch.zeros_like(theta.shift),
        torch.zeros_like(theta.stretch),
    )


def errors(shapes: Shapes, theta: Theta, truth: Theta) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (deg) and translation (diagonals) of every part that exists."""
    found, true = (pose_parts(shapes.trees, t, shapes.box_center) for t in (theta, truth))
    valid = shapes.trees.valid
    rotation = metrics.rotation_error(found.rotation[valid].numpy(), true.rotation[valid].numpy())
    return rotation, metrics.translation_error(found.center[valid].numpy(), true.center[valid].numpy(), 1.0)


@pytest.fixture(scope="module")
def laptops() -> tuple[Shapes, Observed, Theta]:
    objects, samples = views("laptop", 12)
    shapes = Shapes.from_objects(objects)
    return shapes, observe(samples), true_theta(shapes, samples)


@pytest.fixture(scope="module")
def drawers() -> tuple[Shapes, Observed, Theta]:
    objects, samples = views("drawer", 6)
    shapes = Shapes.from_objects(objects)
    return shapes, observe(samples), true_theta(shapes, samples)


def test_true_poses_have_next_to_no_energy(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    matches = match(shapes, Target.of(observed, shapes.diagonal), truth, 0.3)
    assert matches.square.sqrt().median() < 1e-3
    assert float((matches.weight * matches.square).sum(1).max()) < 2e-4


def test_a_laptop_that_is_off_by_20_degrees_and_a_tenth_comes_back(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    result = refine(shapes, observed, perturbed(shapes, truth, 20.0, 0.1), KNOWN_SHAPE)
    rotation, translation = errors(shapes, result.theta, truth)
    assert np.median(rotation) < 0.5
    assert rotation.max() < 5.0
    assert np.median(translation) < 0.02


def test_drawers_come_back(drawers: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = drawers
    result = refine(shapes, observed, perturbed(shapes, truth, 10.0, 0.05), KNOWN_SHAPE)
    rotation, translation = errors(shapes, result.theta, truth)
    assert np.median(rotation) < 1.0
    assert np.median(translation) < 0.02


@pytest.mark.slow
def test_another_laptop_takes_on_the_shape_of_the_one_seen() -> None:
    _, samples = views("laptop", 12, first_seed=50)
    others = Shapes.from_objects([artsim.make("laptop", 200 + i).with_diagonal(1.0) for i in range(12)])
    observed, truth = observe(samples), true_theta(others, samples)
    start = perturbed(others, truth, 15.0, 0.08)
    fixed, adapted = refine(others, observed, start, KNOWN_SHAPE), refine(others, observed, start)
    rotation, translation = errors(others, adapted.theta, truth)
    assert np.median(rotation) < 1.0
    assert np.median(translation) < 0.04
    assert np.median(translation) < np.median(errors(others, fixed.theta, truth)[1])


@pytest.mark.slow
def test_expected_sizes_are_met_where_the_view_leaves_them_open() -> None:
    objects, samples = views("laptop", 12, first_seed=50)
    others = Shapes.from_objects([artsim.make("laptop", 200 + i).with_diagonal(1.0) for i in range(12)])
    observed, truth = observe(samples), true_theta(others, samples)
    start = perturbed(others, truth, 15.0, 0.08)
    sizes = torch.from_numpy(np.stack([obj.box_size for obj in objects])).float()
    unsure = sizes.clone()
    unsure[:, 1] = torch.nan

    def wrong(expected: torch.Tensor | None) -> torch.Tensor:
        theta = refine(others, observed, start, RefineOptions(sigma_size=0.02), expected).theta
        scale = pose_parts(others.trees, theta, others.box_center).scale
        return (scale * others.box_size / sizes).log().abs().mean((0, 2))

    assert (wrong(sizes) < 0.5 * wrong(None)).all()
    assert wrong(unsure)[0] < 0.5 * wrong(None)[0]


@pytest.mark.slow
def test_energy_never_rises_from_any_start(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    for seed, degrees, length in ((0, 0.0, 0.0), (1, 5.0, 0.02), (2, 60.0, 0.3), (3, 170.0, 0.5)):
        start = perturbed(shapes, truth, degrees, length, seed)
        for result in (refine(shapes, observed, start), refine_by_gradient(shapes, observed, start, iterations=20)):
            assert (result.energy <= result.start_energy).all()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_states_never_leave_their_limits(drawers: tuple[Shapes, Observed, Theta], seed: int) -> None:
    shapes, observed, truth = drawers
    narrow = replace(shapes.trees, upper=0.3 * shapes.trees.upper)  # so that most true states lie outside
    shapes = replace(shapes, trees=narrow)
    start = perturbed(shapes, truth, 20.0, 0.2, seed)
    for result in (refine(shapes, observed, start), refine_by_gradient(shapes, observed, start, iterations=20)):
        assert (result.theta.state >= narrow.lower).all()
        assert (result.theta.state <= narrow.upper).all()


def test_outliers_lose_their_say(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    points = observed.points.clone()
    wild = torch.rand(points.shape[1], generator=torch.Generator().manual_seed(1)) < 0.1
    points[:, wild] += 0.5 * torch.randn(len(points), int(wild.sum()), 3, generator=torch.Generator().manual_seed(2))
    result = refine(shapes, replace(observed, points=points), perturbed(shapes, truth, 10.0, 0.05), KNOWN_SHAPE)
    assert np.median(errors(shapes, result.theta, truth)[0]) < 1.0


def test_points_without_weight_change_nothing(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    start = perturbed(shapes, truth, 10.0, 0.05)
    weight = torch.ones_like(observed.weight)
    weight[:, ::4] = 0.0
    moved = observed.points.clone()
    moved[:, ::4] += 7.0
    ignored = [refine(shapes, Observed(p, observed.part, weight), start) for p in (observed.points, moved)]
    torch.testing.assert_close(ignored[0].theta.rotation, ignored[1].theta.rotation, atol=1e-4, rtol=0.0)


def test_a_batch_gives_what_its_objects_give_alone(drawers: tuple[Shapes, Observed, Theta]) -> None:
    objects, _ = views("drawer", 6)
    shapes, observed, truth = drawers
    start = perturbed(shapes, truth, 10.0, 0.05)
    together = refine(shapes, observed, start, RefineOptions(iterations=6))
    for b, obj in enumerate(objects[:3]):
        K = len(obj)
        alone = Shapes.from_objects([obj])
        own = Theta(start.rotation[b : b + 1], start.translation[b : b + 1], start.log_scale[b : b + 1],
                    start.state[b : b + 1, :K], start.shift[b : b + 1, :K], start.stretch[b : b + 1, :K])  # fmt: skip
        single = refine(alone, observed[b : b + 1], own, RefineOptions(iterations=6))
        torch.testing.assert_close(single.theta.rotation[0], together.theta.rotation[b], atol=2e-3, rtol=0.0)
        torch.testing.assert_close(single.theta.state[0], together.theta.state[b, :K], atol=2e-3, rtol=0.0)


@pytest.mark.slow
def test_hinges_lean_as_the_points_say_and_as_far_as_they_may() -> None:
    """References whose hinges lean by six degrees the other way; both hinges of a pair lean together."""
    objects, samples = views("eyeglasses", 32, first_seed=30)
    shapes, observed = Shapes.from_objects(objects, dtype=torch.float32), observe(samples)
    folded = torch.tensor([min(abs(s.joint_state[1:])) > 0.5 for s in samples])
    lean = torch.zeros_like(shapes.points[:, :, 0])
    lean[:, 1:, 0] = np.deg2rad(6.0)
    others, truth = leaning(shapes, lean), true_theta(shapes, samples)
    start = perturbed(others, truth, 3.0, 0.01)
    P = shapes.trees.num_rows
    one = torch.zeros(3 * P)
    one[3::3] = 0.1
    prior = AxisPrior(torch.outer(one, one).expand(len(shapes), -1, -1), shapes.trees.depth > 0)
    fixed = refine(others, observed, start, KNOWN_SHAPE)
    free = refine(others, observed, start, KNOWN_SHAPE, axis_prior=prior)
    assert torch.equal(fixed.axis, others.trees.axis)
    assert (free.energy <= free.start_energy).all()
    off = [metrics.axis_error(axis[folded, 1:].numpy(), shapes.trees.axis[folded, 1:].numpy()) for axis in
           (others.trees.axis, free.axis)]  # fmt: skip
    assert folded.sum() >= 8
    assert np.median(off[0]) == pytest.approx(6.0, abs=0.01)
    assert np.median(off[1]) < 2.5
    shared = torch.linalg.cross(others.trees.axis, free.axis)[:, 1:, 0]
    torch.testing.assert_close(shared[:, 0], shared[:, 1], atol=0.02, rtol=0.1)  # up to what any axis may lean


def test_steps_follow_the_derivatives_of_the_distances() -> None:
    objects = [artsim.make("drawer", 2), artsim.make("laptop", 1), artsim.make("drawer", 3)]
    shapes = Shapes.from_objects(objects, 32, dtype=torch.float64)
    wide = torch.full_like(shapes.trees.rest, 9.0)  # derivatives end at limits
    shapes = replace(shapes, trees=replace(shapes.trees, lower=-wide, upper=wide))
    B, P = shapes.trees.valid.shape
    rng = torch.Generator().manual_seed(0)

    def normal(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=rng, dtype=torch.float64)

    theta = Theta(rotation_from_vector(normal(B, 3)), torch.tensor([0.0, 0.0, 3.0]).double() + 0.1 * normal(B, 3),
                  0.2 * normal(B, 3), shapes.trees.rest + 0.3,
                  0.05 * normal(B, P, 3), 0.1 * normal(B, P, 3))  # fmt: skip
    part = torch.randint(0, P, (B, 40), generator=rng) % shapes.trees.valid.sum(1, keepdim=True)
    points = theta.translation[:, None] + 0.5 * normal(B, 40, 3)
    target = Target.of(Observed.of(points, part), shapes.diagonal)
    matches = match(shapes, target, theta, 0.0)
    directions = torch.stack([matches.normal, matches.across], dim=2)
    in_part = torch.einsum("bnji,bndj->bndi", _of_part(matches, matches.posed.rotation), directions)

    def distance(step: torch.Tensor) -> torch.Tensor:
        """Offsets from discs that move with their parts."""
        moved, lean = _moved(shapes.trees, theta, torch.zeros_like(theta.shift), step, target.middle)
        leant = replace(shapes.trees, axis=rotate(rotation_from_vector(lean), shapes.trees.axis))
        posed = pose_parts(leant, moved, shapes.box_center)
        rotation = _of_part(matches, posed.rotation)
        adapted = _of_part(matches, posed.center_rest) + _of_part(matches, posed.scale) * (
            matches.local - _of_part(matches, shapes.box_center)
        )
        disc = (rotation @ adapted[..., None])[..., 0] + _of_part(matches, posed.translation)
        return torch.einsum("bnij,bndj,bni->bnd", rotation, in_part, matches.point - disc)

    D = 9 + 10 * P
    expected = torch.autograd.functional.jacobian(distance, torch.zeros(B, D, dtype=torch.float64))
    expected = torch.stack([expected[b, :, :, b] for b in range(B)])
    maps = _maps(shapes, target.middle, theta, matches.posed, rigid=False, leans=True)
    found = _rates(shapes, target.middle, matches, directions, rigid=False) @ _of_part(matches, maps)
    shift = 9 + 4 * P
    expected[..., shift : shift + 3] = 0.0  # the root's anchor is nobody's
    slides = (shapes.trees.turn == 0).repeat_interleave(3, dim=1)
    expected[..., 9 + 7 * P :] *= ~slides[:, None, None]  # rails do not lean
    torch.testing.assert_close(found, expected, atol=1e-9, rtol=1e-9)


def _of_part(matches: Matches, values: torch.Tensor) -> torch.Tensor:
    return torch.stack([values[b, matches.part[b]] for b in range(len(values))])


def test_joint_energy_holds_for_theta_and_counts_for_free_parts() -> None:
    trees = Trees.stack([artsim.make(category, 0).tree for category in ("laptop", "drawer")])
    theta = replace(Theta.at_rest(trees), state=clamp_state(trees, trees.rest + 0.7))
    rotation = pose_parts(trees, theta, torch.zeros_like(theta.shift)).rotation
    torch.testing.assert_close(joint_energy(trees, rotation), torch.zeros(2).double())
    tilted = rotation.clone()
    tilted[:, 1] = rotation_from_vector(torch.tensor([0.0, 0.0, 0.2], dtype=torch.float64)) @ tilted[:, 1]
    # A laptop's hinge, level, is carried by 2 sin(0.1) away from itself; so is a drawer's rail.
    torch.testing.assert_close(joint_energy(trees, tilted), torch.full((2,), 2 * np.sin(0.1)).double())


def test_part_energy_is_the_chamfer_distance_of_each_part() -> None:
    shapes = Shapes.from_objects([artsim.make("laptop", 3)], 64, dtype=torch.float64)
    theta = replace(Theta.at_rest(shapes.trees), translation=torch.tensor([[0.1, 0.0, 2.0]], dtype=torch.float64))
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    points = shapes.points.flatten(1, 2) + torch.tensor([0.0, 0.0, 2.0], dtype=torch.float64)
    part = torch.arange(2).repeat_interleave(64)[None]
    expected = 0.0
    for k in range(2):
        a, b = posed.points(shapes.points, shapes.box_center)[0, k].numpy(), points[0, part[0] == k].numpy()
        square = ((a[:, None] - b) ** 2).sum(-1)
        expected += square.min(0).mean() + square.min(1).mean()
    found = part_energy(shapes, Observed.of(points, part), posed)
    assert float(found) == pytest.approx(expected / float(shapes.diagonal) ** 2, rel=1e-6)


@pytest.mark.slow
def test_the_papers_energy_leads_back_too(laptops: tuple[Shapes, Observed, Theta]) -> None:
    shapes, observed, truth = laptops
    start = perturbed(shapes, truth, 10.0, 0.05)
    result = refine_by_gradient(shapes, observed, start, two_sided=False)
    before, after = errors(shapes, start, truth), errors(shapes, result.theta, truth)
    assert np.median(after[0]) < 0.5 * np.median(before[0])
    assert np.median(after[1]) < 0.8 * np.median(before[1])  # parts slide along themselves


def test_points_of_a_shape_are_spread_evenly() -> None:
    obj = artsim.make("laptop", 0)
    points, normals, spacing = spread_points(obj.parts[0].vertices, obj.parts[0].faces, 200, np.random.default_rng(0))
    apart = np.linalg.norm(points[:, None] - points, axis=-1) + 9.0 * np.eye(200)
    assert apart.min() > 0.4 * spacing
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    first = apart[:50, :50].min()  # a shorter list is spread as evenly
    assert first > 0.4 * 2 * spacing


@pytest.mark.slow
def test_options_that_make_no_sense_are_refused() -> None:
    with pytest.raises(ConfigError):
        RefineOptions(iterations=-1)
    with pytest.raises(ConfigError):
        RefineOptions(robust_end=0.5)
