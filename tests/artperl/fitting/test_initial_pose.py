"""Starts: where points lie in the rest frame tells where the parts are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

import artsim
from artperl.core.clouds import Clouds
from artperl.core.pose import Theta, joint_states, pose_parts
from artperl.core.rotations import rotation_from_vector
from artperl.core.shapes import Shapes
from artperl.data.sources import Samples
from artperl.data.truth import Truth, to_batch, training_rows
from artperl.evaluation import metrics
from artperl.fitting.initial_pose import (
    adapt_shapes,
    part_poses,
    procrustes,
    resize_shapes,
    start,
    starts_by_another_part,
)
from artperl.perception.network import Perceived
from artperl.retrieval.shape_base import ShapeBase
from artperl.training.fitting_problems import part_truth
from artsim.datasets.plan import SampleOptions
from artsim.observing.sample import Sample


def test_procrustes_recovers_a_motion_without_noise() -> None:
    generator = torch.Generator().manual_seed(0)
    source = torch.randn(5, 40, 3, generator=generator, dtype=torch.float64)
    rotation = rotation_from_vector(torch.randn(5, 3, generator=generator, dtype=torch.float64))
    translation = torch.randn(5, 3, generator=generator, dtype=torch.float64)
    target = source @ rotation.transpose(1, 2) + translation[:, None]
    weight = torch.rand(5, 2, 40, generator=generator, dtype=torch.float64)
    found, offset = procrustes(source, target, weight)
    torch.testing.assert_close(found, rotation[:, None].expand(-1, 2, -1, -1), atol=1e-9, rtol=0)
    torch.testing.assert_close(offset, translation[:, None].expand(-1, 2, -1), atol=1e-9, rtol=0)


def test_procrustes_never_mirrors() -> None:
    source = torch.randn(1, 20, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    rotation, _ = procrustes(source, source * torch.tensor([-1.0, 1.0, 1.0]), torch.ones(1, 1, 20).double())
    assert torch.linalg.det(rotation[0, 0]).item() == pytest.approx(1.0)


def test_points_without_weight_do_not_count() -> None:
    source = torch.randn(1, 30, 3, generator=torch.Generator().manual_seed(2), dtype=torch.float64)
    target = source.clone()
    target[:, 20:] += 5.0
    weight = torch.ones(1, 1, 30, dtype=torch.float64)
    weight[..., 20:] = 0.0
    rotation, translation = procrustes(source, target, weight)
    torch.testing.assert_close(rotation[0, 0], torch.eye(3, dtype=torch.float64))
    assert translation.abs().max() < 1e-9


def knowing(truth: Truth) -> Perceived:
    """A network that knows everything."""
    P = truth.part_valid.shape[1]
    logits = 50.0 * torch.nn.functional.one_hot(truth.part, P).float()
    return Perceived(
        logits, truth.canonical, torch.full(truth.part.shape, -3.0), truth.own.float(),
        2.0 * truth.part_valid.float() - 1.0,
        truth.box_center, truth.box_size, truth.diagonal.log(),
    )  # fmt: skip


def scene(category: str, count: int = 6) -> tuple[list[Sample], Clouds, Truth]:
    samples = Samples([category], SampleOptions(num_points=512), 7, 1, 8)
    some = [samples[i] for i in range(count)]
    rows = [training_rows(s, 512, 8) for s in some]
    clouds, truth = to_batch({k: torch.from_numpy(np.stack([r[k] for r in rows])) for k in rows[0]})
    return some, clouds, truth


@pytest.mark.parametrize("category", ["laptop", "drawer", "eyeglasses"])
def test_parts_that_are_seen_are_placed_where_they_are(category: str) -> None:
    samples, clouds, truth = scene(category)
    rotation, center, size = part_poses(clouds, knowing(truth))
    for b, sample in enumerate(samples):
        _, true_rotation, true_center, true_size, *_ = part_truth(sample, 8)
        seen = torch.bincount(truth.part[b], minlength=8) >= 40
        assert metrics.rotation_error(rotation[b, seen], true_rotation[seen]).max() < 3.0
        off = metrics.translation_error(center[b, seen], true_center[seen], sample.diagonal)
        assert off.max() < 0.02
        torch.testing.assert_close(size[b], true_size, atol=1e-4, rtol=1e-3)


def test_every_object_starts_from_its_own_shape_almost_where_it_is() -> None:
    samples, clouds, truth = scene("laptop")
    objects = [artsim.make("laptop", 1_000_000 + i) for i in range(2)]  # any two: they take the perceived shape
    base = ShapeBase.of(objects, 64)
    references = concat_rows(base.shapes, len(samples))
    shapes, theta = start(clouds, knowing(truth), references, 2)
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    for b, sample in enumerate(samples):
        _, rotation, center, size, *_ = part_truth(sample, 2)
        for row in (2 * b, 2 * b + 1):
            assert metrics.rotation_error(posed.rotation[row, 0], rotation[0]) < 3.0
            assert metrics.translation_error(posed.center[row, 0], center[0], sample.diagonal) < 0.02
            torch.testing.assert_close(shapes.box_size[row], size, atol=1e-4, rtol=1e-3)
            assert theta.log_scale.abs().max() == 0.0


def concat_rows(shapes: Shapes, times: int) -> Shapes:
    return shapes[torch.arange(len(shapes)).repeat(times)]


def test_adapted_references_are_where_their_scale_had_put_them() -> None:
    objects = [artsim.make(category, 3) for category in ("laptop", "drawer", "eyeglasses", "robot_arm")]
    shapes = Shapes.from_objects(objects, 32, dtype=torch.float64)
    trees = shapes.trees
    generator = torch.Generator().manual_seed(0)
    B, P = trees.valid.shape
    low = torch.where(torch.isfinite(trees.lower), trees.lower, -1.0)
    high = torch.where(torch.isfinite(trees.upper), trees.upper, 1.0)
    theta = replace(
        Theta.at_rest(trees),
        log_scale=0.2 * torch.randn(B, 3, generator=generator, dtype=torch.float64),
        stretch=0.2 * torch.randn(B, P, 3, generator=generator, dtype=torch.float64),
        state=low + torch.rand(B, P, generator=generator, dtype=torch.float64) * (high - low),
    )
    small = adapt_shapes(shapes, theta)
    plain = torch.zeros_like(theta.stretch)
    state = joint_states(trees, theta)
    there = replace(theta, log_scale=plain[:, 0], stretch=plain, state=state)
    wanted, found = pose_parts(trees, theta, shapes.box_center), pose_parts(small.trees, there, small.box_center)
    valid = trees.valid
    torch.testing.assert_close(found.center[valid], wanted.center[valid])
    torch.testing.assert_close(
        found.points(small.points, small.box_center)[valid], wanted.points(shapes.points, shapes.box_center)[valid]
    )
    torch.testing.assert_close(
        found.normals(small.normals)[valid], wanted.normals(shapes.normals)[valid], atol=1e-6, rtol=1e-6
    )


def test_a_reference_gets_the_size_asked_for() -> None:
    shapes = Shapes.from_objects([artsim.make("drawer", 1), artsim.make("laptop", 1)], 32, dtype=torch.float64)
    doubled = resize_shapes(shapes, 2.0 * shapes.diagonal)
    torch.testing.assert_close(doubled.box_size, 2.0 * shapes.box_size)
    torch.testing.assert_close(doubled.diagonal, 2.0 * shapes.diagonal)
    slides = (shapes.trees.slide != 0) & (shapes.trees.turn == 0)
    torch.testing.assert_close(doubled.trees.upper[slides], 2.0 * shapes.trees.upper[slides])
    torch.testing.assert_close(doubled.trees.upper[~slides], shapes.trees.upper[~slides])


@pytest.mark.slow
@pytest.mark.parametrize(("category", "degrees", "diagonals"), [("drawer", 1.0, 0.05), ("eyeglasses", 30.0, 0.2)])
def test_hardly_visible_parts_start_where_their_joints_let_them(
    category: str, degrees: float, diagonals: float
) -> None:
    """With a handful of points left of each moving part, a pose of its own would be anywhere."""
    samples, clouds, truth = scene(category, 4)
    rows = len(samples[0].joint_type)
    few = [
        torch.cat([(truth.part[b] == k).nonzero()[: 400 if k == 0 else 5, 0] for k in range(rows)])
        for b in range(len(samples))
    ]
    base = ShapeBase.of([artsim.make(category, seed) for seed in range(30)], 32)
    for b, kept in enumerate(few):
        alone = Clouds(clouds.points[b : b + 1, kept], clouds.center[b : b + 1], clouds.scale[b : b + 1])
        own = truth[b : b + 1]
        known = replace(own, part=own.part[:, kept], canonical=own.canonical[:, kept])
        row = next(n for n, tree in enumerate(base.trees) if tree.types == samples[b].joint_type)
        shapes, theta = start(alone, knowing(known), base.shapes[[row]], 1)
        posed = pose_parts(shapes.trees, theta, shapes.box_center)
        _, rotation, center, *_ = part_truth(samples[b], rows)
        seen = torch.bincount(known.part[0], minlength=rows) >= 3
        assert metrics.rotation_error(posed.rotation[0, :rows], rotation)[seen].max() < degrees
        assert metrics.translation_error(posed.center[0, :rows], center, samples[b].diagonal)[seen].max() < diagonals


def test_a_root_that_hardly_shows_starts_where_another_part_lets_it_be() -> None:
    """A base behind its lid: every start has the lid where it is, and one of them has the base almost where it is."""
    samples, clouds, truth = scene("laptop", 4)
    base = ShapeBase.of([artsim.make("laptop", seed) for seed in range(30)], 32)
    for b, sample in enumerate(samples):
        lid, root = ((truth.part[b] == k).nonzero()[:, 0] for k in (1, 0))
        assert len(lid) > 50
        for visible, hidden in ((3, True), (len(lid), False)):
            kept = torch.cat([lid, root[:visible]])
            alone = Clouds(clouds.points[b : b + 1, kept], clouds.center[b : b + 1], clouds.scale[b : b + 1])
            own = truth[b : b + 1]
            known = knowing(replace(own, part=own.part[:, kept], canonical=own.canonical[:, kept]))
            shapes, theta = start(alone, known, base.shapes[[0]], 1)
            starts = starts_by_another_part(alone, known, shapes, theta, 16)
            assert (starts is not None) == (hidden or len(root) < len(lid) // 4)
            if starts is not None:
                many = shapes.repeat(16)
                posed = pose_parts(many.trees, starts, many.box_center)
                _, rotation, center, *_ = part_truth(sample, 2)
                off = metrics.rotation_error(posed.rotation, rotation)
                away = metrics.translation_error(posed.center, center, sample.diagonal)
                assert off[:, 1].max() < 3.0
                assert away[:, 1].max() < 0.03
                assert off[:, 0].min() < 8.0
                assert away[off[:, 0].argmin(), 0] < 0.08
