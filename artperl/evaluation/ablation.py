"""What each stage contributes: the same estimator with one thing changed, on the same test samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from numpy.typing import ArrayLike

from artperl.agent.policy import Agent
from artperl.core.batch import concatenate
from artperl.core.clock import Clock
from artperl.core.clouds import Clouds
from artperl.core.estimate import Estimate
from artperl.core.pose import Theta, pose_parts
from artperl.core.rotations import rotate
from artperl.core.shapes import Observed
from artperl.evaluation.scoring import evaluate, summary
from artperl.fitting.initial_pose import part_poses, start
from artperl.fitting.levenberg_marquardt import refine
from artperl.methods.full import Estimator
from artperl.perception.preprocess import clean, draw
from artperl.retrieval.box_embedding import box_embedding
from artperl.retrieval.shape_base import ShapeBase
from artsim.observing.sample import Sample


def variants(
    estimator: Estimator, cloned: Agent | None = None, reinforced: Agent | None = None
) -> dict[str, Estimator]:
    """Estimators by what is changed in them.

    Parameters
    ----------
    estimator : Estimator
        The whole.
    cloned, reinforced : Agent, optional
        Agents that learnt by behaviour cloning alone, and by PPO alone.
    """

    def changed(whole: Estimator = estimator, **options: Any) -> Estimator:
        return replace(whole, options=replace(whole.options, **options))

    without_agent = replace(estimator, agent=None)
    unrefined = replace(estimator.options.refine, iterations=0)
    table = {
        "whole": estimator,
        "random reference": replace(estimator, base=shuffled(estimator.base)),
        "part by part, no kinematics": PartByPart(**vars(estimator)),
        "labels of each point by itself": changed(coherent=False),
        "boxes of the references": replace(estimator, boxes=None),
        "not uncovered": changed(uncovered=False),
        "not squared": changed(squared=False),
        "no refinement, not squared": changed(refine=unrefined, squared=False),
        "refinement only: no agent": without_agent,
        "no second try": changed(retry_residual=float("inf")),
        "single start": changed(retry_residual=float("inf"), references=1),
        "no rest-frame coordinates": changed(perceived_start=False),
        "the same, agent only, not squared": changed(perceived_start=False, refine=unrefined, squared=False),
        "the same, refinement only": changed(without_agent, perceived_start=False),
    }
    for name, agent in (("cloning only", cloned), ("PPO only", reinforced)):
        if agent is not None:
            other = replace(estimator, agent=agent)
            table |= {name: other, f"no rest-frame coord., {name}": changed(other, perceived_start=False)}
    return table


def run_ablation(
    table: dict[str, Estimator], samples: Sequence[Sample], say: Callable[[str], None] = print, progress: bool = False
) -> dict[str, Any]:
    """Evaluate every variant on the same samples.

    Returns
    -------
    dict
        ``{variant: figures}``, figures as :func:`artperl.evaluation.scoring.summary` gives them.
    """
    result = {}
    say(f"{'':42s}{'rotation deg':>16s}{'translation %':>16s}{'IoU as OMAD %':>14s}{'right':>8s}{'ms':>7s}")
    for name, estimator in table.items():
        result[name] = summary(evaluate(estimator, samples, progress))
        for category, figures in result[name].items():
            parts = figures["parts"]
            mean = {
                metric: np.mean([[part[metric]["median"], part[metric]["mean"]] for part in parts], axis=0)
                for metric in ("rotation_deg", "translation_percent_diagonal", "iou_omad_legacy")
            }
            rotation, translation, iou = mean.values()
            say(
                f"{f'{name}, {category}':42s}{rotation[0]:9.2f}{rotation[1]:7.2f}{translation[0]:9.2f}"
                f"{translation[1]:7.2f}{100 * iou[1]:14.1f}{100 * figures['right']:7.0f} %"
                f"{figures['ms_per_instance']:7.0f}"
            )
    say("medians and means over instances, averaged over parts")
    return result


def shuffled(base: ShapeBase) -> ShapeBase:
    """A base that finds any object with the right kinematic tree, instead of the nearest one."""
    assert base.embeddings is not None
    kinds = [(tree.types, tuple(tree.parents)) for tree in base.trees]
    rng, rows = np.random.default_rng(0), np.arange(len(base))
    for kind in dict.fromkeys(kinds):
        own = np.array([row for row, other in enumerate(kinds) if other == kind])
        rows[own] = rng.permutation(own)
    return base.with_embeddings(base.embeddings[torch.from_numpy(rows)])


class PartByPart(Estimator):
    """Every part is registered on its own: part-centric pose modelling, as in A-NCSH."""

    @torch.inference_mode()
    def __call__(self, points: ArrayLike) -> Estimate:
        """As :class:`artperl.methods.full.Estimator`; joint states and axes are those of the whole estimator."""
        whole = super().__call__(points)
        known = np.asarray(points, dtype=np.float64)
        known = known[clean(known)]
        chosen = draw(len(known), self.options.num_points, np.random.default_rng(0))
        cloud = torch.from_numpy(known[chosen].astype(np.float32))[None]
        clouds = Clouds.of(cloud)
        perceived = self.perceive(clouds, Clock())
        query = box_embedding(perceived.valid, perceived.box_center, perceived.box_size)
        shapes, _ = start(clouds, perceived, self.base.shapes[self.base.nearest(query)[0][0]], 1)
        P = int(shapes.trees.valid.sum())
        alone = concatenate([shapes.part(k) for k in range(P)])
        own = torch.nn.functional.one_hot(perceived.part[0], perceived.part_logits.shape[2])[:, :P].T
        observed = Observed.of(cloud.expand(P, -1, -1), torch.zeros_like(own), own.float())
        rotation, center, _ = (pose[0, :P] for pose in part_poses(clouds, perceived))
        placed = replace(
            Theta.at_rest(alone.trees), rotation=rotation, translation=center - rotate(rotation, alone.box_center[:, 0])
        )
        options = replace(self.options.refine, outline_weight=0.0)  # the outline is that of all parts together
        posed = pose_parts(alone.trees, refine(alone, observed, placed, options).theta, alone.box_center)
        transforms = np.tile(np.eye(4), (P, 1, 1))
        transforms[:, :3, :3], transforms[:, :3, 3] = posed.rotation[:, 0].numpy(), posed.translation[:, 0].numpy()
        return replace(
            whole, rotation=transforms[:, :3, :3], translation=posed.center[:, 0].double().numpy(),
            size=(alone.box_size * posed.scale)[:, 0].double().numpy(), T_camera_part=transforms,
        )  # fmt: skip
