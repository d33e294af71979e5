"""What each stage of an estimate brings: one stage off at a time, all categories, on objects for validation.

    python -m benchmarks.ablation --out ablation.json [--categories laptop] [--views 32]

Rows are procedural and real (train half) objects, from the front and from all round, clean and as a D435 sees them.
Prints, for each stage and row, how much the mean rotation, the mean exact IoU and the share of right views change when
the stage is off, with the standard error of the paired differences.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import torch
import tyro

from artperl.core import estimate as core
from artperl.data.categories import ARTIMAGE, objects_of
from artperl.estimator import load_estimator
from artperl.evaluation.ablation import shuffled
from artperl.evaluation.artimage import real_objects
from artperl.evaluation.scoring import VALIDATION_SEEDS, Scored, samples_of, score
from artperl.fitting import levenberg_marquardt, search
from artperl.methods import full
from artperl.methods.full import Estimator
from artperl.retrieval.shape_base import ShapeBase
from artsim.common.progress import track
from artsim.datasets.plan import SampleOptions
from artsim.model.draws import ViewOptions
from artsim.observing.sample import Sample

_refine, _find, _slid = levenberg_marquardt.refine, search.find, core.slid


@dataclass(frozen=True)
class Variant:
    """An estimator with something off: options, patches of modules, or another estimator."""

    options: dict[str, Any] = field(default_factory=dict)
    patches: tuple[tuple[Any, str, Any], ...] = ()
    change: Callable[[Estimator], Estimator] = lambda estimator: estimator
    late: bool = False
    """Only what comes after the search differs."""


def _no_outline(shapes: Any, observed: Any, start: Any, options: Any = None, *args: Any, **kwargs: Any) -> Any:
    return _refine(shapes, observed, start, replace(options, outline_weight=0.0), *args, **kwargs)


def _still(estimate: Any, farther: Any) -> Any:
    return _slid(estimate, np.zeros_like(farther))


VARIANTS: dict[str, Variant] = {
    "whole": Variant(),
    "no label smoothing": Variant({"coherent": False}),
    "one reference": Variant({"references": 1}),
    "references by boxes alone": Variant(
        patches=((search, "_leaning", lambda base, query, rows: (rows, base.shapes[rows])),)
    ),
    "axes as the reference's": Variant(patches=((ShapeBase, "axis_prior", lambda self, row: None),)),
    "random references": Variant(change=lambda e: replace(e, base=shuffled(e.base))),
    "no start by another part": Variant(patches=((search, "by_another_part", lambda *args: None),)),
    "points weigh alike": Variant(
        patches=((search, "evened", lambda part: torch.ones(part.shape, device=part.device)),)
    ),
    "labels of perception alone": Variant(
        patches=((search, "relabel", lambda shapes, observed, theta, logits: observed.part),)
    ),
    "shape free at once": Variant(patches=((levenberg_marquardt, "_RIGID_ITERATIONS", 0),)),
    "no outline term": Variant(patches=((search, "refine", _no_outline),)),
    "no second try": Variant({"retry_residual": float("inf")}),
    "no agent": Variant(change=lambda e: replace(e, agent=None)),
    "residual alone decides": Variant(patches=((search, "_DISAGREEMENT", 0.0),)),
    "outliers kept": Variant(
        patches=((full, "clean", lambda points: np.flatnonzero(np.isfinite(points).all(1) & points.any(1))),)
    ),
    "hidden parts stay": Variant({"uncovered": False}, late=True),
    "normals not aligned": Variant({"squared": False}, late=True),
    "boxes of the reference": Variant(change=lambda e: replace(e, boxes=None), late=True),
    "boxes looked for once": Variant(patches=((full, "_LOOKS", 1),), late=True),
    "slides stay": Variant(patches=((full, "slid", _still),), late=True),
    "boxes not widened": Variant(
        patches=((full, "widen", lambda rotation, center, size, points, part: (center, size)),), late=True
    ),
}


@contextlib.contextmanager
def applied(variant: Variant, memory: dict[int, Any]) -> Iterator[None]:
    """Patches of a variant; late ones go on from the same found fit."""

    def find(cloud: Any, *args: Any, **kwargs: Any) -> Any:
        key = hash(cloud.numpy().tobytes())
        if key not in memory:
            memory.clear()
            memory[key] = _find(cloud, *args, **kwargs)
        return memory[key]

    with contextlib.ExitStack() as stack:
        for where, name, value in variant.patches:
            stack.enter_context(mock.patch.object(where, name, value))
        if variant.late or variant == VARIANTS["whole"]:
            stack.enter_context(mock.patch.object(full, "find", find))
        yield


def rows(category: str, views: int, partnet: Path | None) -> Iterator[tuple[str, list[Sample]]]:
    """Samples by the name of their row."""
    sources = {"procedural": objects_of([category], views, VALIDATION_SEEDS)}
    if real := real_objects(category, "train", partnet):
        sources["real"] = real
    for source, objects in sources.items():
        for preset in ("artimage", "sphere"):
            for noise in ("none", "d435"):
                options = SampleOptions(num_points=8192, views=ViewOptions(preset=preset), noise=noise)
                each = -(-views // len(objects))
                yield f"{category} {source} {preset} {noise}", samples_of(objects, each, options, VALIDATION_SEEDS)


def figures(scored: Scored) -> list[float]:
    """Rotation, degrees; translation, %; exact IoU, %; right."""
    return [
        float(np.minimum(scored.rotation, 180.0).mean()), 100.0 * float(scored.translation.mean()),
        100.0 * float(scored.iou_exact.mean()), 100.0 * scored.right,
    ]  # fmt: skip


def main(
    out: Path, categories: tuple[str, ...] = tuple(ARTIMAGE), views: int = 32, variants: tuple[str, ...] = ()
) -> None:
    """Measure, write every view's figures to ``out``, and print the table."""
    torch.set_num_threads(1)
    folder = os.environ.get("ARTSIM_PARTNET_DIR")
    chosen = {name: VARIANTS[name] for name in ("whole", *(variants or tuple(VARIANTS)))}
    order = sorted(chosen, key=lambda name: not chosen[name].late and name != "whole")
    result: dict[str, dict[str, list[list[float]]]] = json.loads(out.read_text()) if out.exists() else {}
    for category in categories:
        whole = load_estimator(category)
        table = {
            name: replace(changed := v.change(whole), options=replace(changed.options, **v.options))
            for name, v in chosen.items()
        }
        for row, samples in rows(category, views, Path(folder) if folder else None):
            if row in result:
                continue
            own: dict[str, list[list[float]]] = {name: [] for name in order}
            for sample in track(row, samples, unit="view"):
                memory: dict[int, Any] = {}
                for name in order:
                    with applied(chosen[name], memory):
                        own[name].append(figures(score(table[name], sample)))
            result[row] = own
            out.write_text(json.dumps(result))
            print(report({row: own}), flush=True)


def report(result: dict[str, dict[str, list[list[float]]]]) -> str:
    """One line for each row and variant: what changes when it is off, and the standard error of that."""
    lines = []
    for row, variants in result.items():
        whole = np.array(variants["whole"])
        lines.append(f"{row} ({len(whole)} views): whole {np.round(whole.mean(0), 2)}")
        for name, values in variants.items():
            off = np.array(values) - whole
            error = off.std(axis=0, ddof=1) / np.sqrt(len(off))
            text = "  ".join(f"{m:+7.2f}+-{e:.2f}" for m, e in zip(off.mean(0), error, strict=True))
            lines.append(f"  {name:28s} {text}")
    return "\n".join(lines)


if __name__ == "__main__":
    tyro.cli(main)
