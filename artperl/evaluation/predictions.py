"""Anybody's estimates for the samples of a dataset, read from a file and scored, and a page that compares them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from artperl.core.estimate import Estimate
from artperl.evaluation.scoring import AS_IT_IS, Scored, Symmetries, object_symmetries, score
from artsim.common.files import parse_json, read_bounded
from artsim.common.names import printable
from artsim.common.progress import track
from artsim.datasets.dataset import Dataset
from artsim.datasets.shards import sample_key
from artsim.errors import ConfigError, RenderError
from artsim.model.objects import MAX_PARTS
from artsim.observing.sample import Sample

_MAX_BYTES = 2_000_000_000
_LARGEST = 1e6
_SHAPES: dict[str, tuple[int, ...]] = {"rotation": (3, 3), "translation": (3,), "size": (3,)}
_MORE: dict[str, tuple[int, ...]] = {"T_camera_part": (4, 4), "state": (), "joint_axis": (3,), "part_confidence": ()}
"""Arrays (K, ...) that every estimate has, and those that it may have. Where one is absent, so are its metrics."""
_NEEDS = {"T_camera_part": ("iou_rest_exact", "iou_omad_legacy"), "state": ("joint_state",),
          "joint_axis": ("joint_axis_deg",)}  # fmt: skip
_FIX = "see 'artperl score' in docs/artperl_results.md, or write it by 'artperl estimate --out'"
COLUMNS = (
    ("rotation_deg", "rotation, deg", 1.0), ("translation_percent_diagonal", "translation, %", 1.0),
    ("iou_exact", "IoU, %", 100.0), ("joint_axis_deg", "joint axis, deg", 1.0),
)  # fmt: skip
"""Metric, title and factor."""


@dataclass(frozen=True)
class Predictions:
    """Estimates by the keys of their samples; and the names of arrays that some of them lack."""

    name: str
    estimates: Mapping[str, Estimate]
    lacking: frozenset[str]


def read_predictions(path: Path) -> Predictions:
    """Estimates of a file: a JSON list of records, or a record in each line, as ``artperl estimate`` writes them.

    A record has the key of its ``sample``, and ``rotation`` (K, 3, 3), ``translation`` (K, 3) and ``size`` (K, 3) of
    the boxes of K parts in the camera frame, metres; it may have ``T_camera_part``, ``state``, ``joint_axis``,
    ``confidence`` and ``part_confidence``. One with an ``error`` is a failure.

    Raises
    ------
    ConfigError
        When the file is none, naming the record.
    """
    data = read_bounded(path, _MAX_BYTES, "file of estimates", ConfigError, fix=_FIX)
    estimates: dict[str, Estimate] = {}
    lacking, where = set[str](), "its content"
    try:
        listed = parse_json(data) if data.lstrip()[:1] == b"[" else map(parse_json, data.splitlines())
        for number, record in enumerate(listed, start=1):
            where = f"record {number}"
            key = record["sample"]
            if isinstance(key, int):
                key = sample_key(key)
            if not isinstance(key, str) or key in estimates:
                raise ValueError(f"its sample is {key!r:.40}, or has an estimate already")
            if "error" not in record:
                estimates[key] = _estimate(record)
                lacking |= {name for name in _MORE if record.get(name) is None}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        what = f"lacks {error}" if isinstance(error, KeyError) else error
        raise ConfigError(f"not a file of estimates ({where}: {what})", path, _FIX) from error
    return Predictions(path.stem, estimates, frozenset(lacking))


def _estimate(record: Mapping[str, Any]) -> Estimate:
    """The estimate of a record; a KeyError or ValueError says what is wrong."""
    K = len(record["rotation"])
    if not 1 <= K <= MAX_PARTS:
        raise ValueError(f"it has {K} parts")
    given = {
        name: shape for name, shape in (_SHAPES | _MORE).items() if name in _SHAPES or record.get(name) is not None
    }
    arrays = {name: np.asarray(record[name], dtype=np.float64) for name in given}
    for name, array in arrays.items():
        if array.shape != (K, *given[name]) or not (np.abs(array) <= _LARGEST).all():
            raise ValueError(f"{name} has shape {array.shape} instead of {(K, *given[name])}, or is not finite")
    R = arrays["rotation"]
    if not np.allclose(R @ np.swapaxes(R, 1, 2), np.eye(3), atol=1e-3) or (np.linalg.det(R) < 0).any():
        raise ValueError("rotation is no rotation")
    confidence = float(record.get("confidence") or 0.0)
    if not 0.0 <= confidence <= 1.0:
        raise ValueError(f"confidence is {confidence}")
    T = arrays.get("T_camera_part", np.tile(np.eye(4), (K, 1, 1)))
    return Estimate(
        rotation=R, translation=arrays["translation"], size=np.abs(arrays["size"]), T_camera_part=T,
        state=arrays.get("state", np.zeros(K)), joint_type=("free",) * K, joint_parent=np.full(K, -1),
        joint_axis=arrays.get("joint_axis", np.tile([0.0, 0.0, 1.0], (K, 1))), joint_origin=np.zeros((K, 3)),
        part=np.zeros(0, np.int64), visibility=np.ones(K), trajectory=T[None], confidence=confidence,
        part_confidence=arrays.get("part_confidence", np.full(K, confidence)),
    )  # fmt: skip


def score_predictions(predictions: Predictions, dataset: Dataset, symmetric: Symmetries) -> list[Scored]:
    """Errors for every sample of a dataset; one without an estimate counts as a failure, with the worst values.

    Raises
    ------
    ConfigError
        When there are estimates for samples that the dataset does not have.
    """
    scored = list[Scored]()
    strange = predictions.estimates.keys() - set(map(sample_key, range(dataset.plan.num_samples)))
    if strange:
        what = f"{len(strange)} estimates are of samples that are not there, such as {min(strange)!r:.40}"
        raise ConfigError(what, predictions.name, "name the dataset that they are of with --data")
    for sample in track("scoring", dataset, total=len(dataset), unit="view"):
        found = _scored(predictions.estimates.get(sample_key(sample.index)), sample, symmetric)
        absent = [metric for name in predictions.lacking & _NEEDS.keys() for metric in _NEEDS[name]]
        for errors in (found.errors, found.symmetric_errors or {}):
            errors |= {metric: np.full(len(sample.joint_type), np.nan) for metric in absent}
        scored.append(found)
    return scored


def _scored(estimate: Estimate | None, sample: Sample, symmetric: Symmetries) -> Scored:
    def told(points: Any) -> Estimate:
        if estimate is None:
            raise RenderError("there is no estimate")
        return replace(estimate, part=np.full(len(points), -1))

    return score(told, sample, symmetric.get(sample.object_sha256, AS_IT_IS))


def symmetries_of(dataset: Dataset) -> Symmetries:
    """In what ways the objects of a dataset look the same."""
    planned = track("symmetries", dataset.all_planned, unit="object")
    return object_symmetries(dataset.objects[each.file] for each in planned)


def page(title: str, methods: Mapping[str, Sequence[Scored]], notes: Sequence[str]) -> str:
    """A comparison as Markdown: methods in the order given, none ahead of others."""
    lines = [f"# {title}", "", *(f"- {note}" for note in notes), ""]
    head = ["method", "views", "failures", "right, %", "parts found, %",
            *(f"{name}, {middle}" for _, name, _ in COLUMNS for middle in ("median", "mean"))]  # fmt: skip
    categories = sorted({s.category for scored in methods.values() for s in scored})
    for category in ["", *categories] if len(categories) > 1 else categories:
        lines += [f"## {category or 'all categories'}", "", _line(head), _line(["---"] * len(head))]
        for name, scored in methods.items():
            own = [s.up_to_symmetry for s in scored if category in ("", s.category)]
            lines.append(_line([printable(name, 60), *_cells(own)]))
        lines.append("")
    return "\n".join(lines)


def _cells(scored: Sequence[Scored]) -> Iterator[str]:
    yield from (str(len(scored)), str(sum(s.failed for s in scored)))
    yield from (f"{100 * np.mean([getattr(s, key) for s in scored]):.1f}" for key in ("right", "parts_found"))
    for metric, _, factor in COLUMNS:
        values = factor * np.concatenate([s.errors[metric] for s in scored])
        yield from ("-", "-") if np.isnan(values).any() else (f"{np.median(values):.2f}", f"{np.mean(values):.2f}")


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
