"""Samples as dictionaries of equally shaped arrays, which default collation of training loops stacks."""

import sys
from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from artsim.common.sharding import Shared
from artsim.errors import ConfigError
from artsim.model.joints import JOINT_TYPES
from artsim.observing.sample import Sample

_PER_PART = (
    "T_camera_part", "box_center", "box_size", "visible_fraction", "joint_parent", "joint_axis", "joint_origin",
    "joint_axis_camera", "joint_origin_camera", "joint_state", "joint_rest", "joint_limits",
)  # fmt: skip


def pad_sample(sample: Sample, max_parts: int, float32: bool = True) -> dict[str, Any]:
    """A sample as arrays whose shapes do not depend on its number of parts. Loops may write into them.

    ``part_valid (P,) bool`` marks the rows that are parts, rows beyond are zero; ``joint_type (P,) int64`` is 0 free
    (the root), 1 revolute, 2 continuous, 3 prismatic, 4 screw, the order of ``artsim.model.joints.JOINT_TYPES``;
    ``part (N,)`` is int64, as losses and indices of torch take it; infinite limits stay infinite. ``category`` and
    ``object_id`` are texts, ``part_names`` P texts, empty beyond the parts.

    Parameters
    ----------
    sample : Sample
    max_parts : int
        Rows of per-part arrays.
    float32 : bool
        Poses, boxes, joints and cameras in single precision, as networks take them; in double precision otherwise.

    Raises
    ------
    ConfigError
        When the sample has more parts than rows.
    """
    num_parts = len(sample.joint_type)
    if num_parts > max_parts:
        raise ConfigError(f"{num_parts} parts do not fit {max_parts} rows", "max_parts", f"use at least {num_parts}")

    def pad(array: NDArray[Any]) -> NDArray[Any]:
        rows: NDArray[Any] = np.zeros((max_parts, *array.shape[1:]), dtype=array.dtype)
        rows[:num_parts] = array
        return rows

    arrays = {name: pad(getattr(sample, name)) for name in _PER_PART}
    arrays["joint_type"] = pad(np.array([JOINT_TYPES.index(t) for t in sample.joint_type], dtype=np.int64))
    arrays["part_valid"] = np.arange(max_parts) < num_parts
    arrays |= {name: getattr(sample, name) for name in ("points", "npcs", "K", "T_world_camera")}
    arrays |= {name: np.asarray(getattr(sample, name)) for name in ("scale", "diagonal", "index", "width", "height")}
    arrays |= {
        name: image for name in ("depth", "part_mask", "rgb", "detail") if (image := getattr(sample, name)) is not None
    }
    arrays["part"] = sample.part.astype(np.int64)
    names = (*sample.part_names, *[""] * (max_parts - num_parts))
    texts = {"category": sample.category, "object_id": sample.object_id, "part_names": names}
    return {**{name: _writable(array, float32) for name, array in arrays.items()}, **texts}


def _writable(array: NDArray[Any], float32: bool) -> NDArray[Any]:
    if float32 and array.dtype == np.float64:
        return array.astype(np.float32)
    return array if array.flags.writeable else array.copy()


def refuse_collation() -> None:
    """Have torch's default collation, where it is imported, say what to do with samples as they are."""
    collate: Any = sys.modules.get("torch.utils.data._utils.collate")
    if collate is not None:
        collate.default_collate_fn_map[Sample] = _unpadded


def _unpadded(batch: Any, *, collate_fn_map: Any = None) -> None:
    raise ConfigError(
        "samples have different numbers of parts, and do not stack", "DataLoader",
        "give it dataset.padded(), or collate_fn=list",
    )  # fmt: skip


class Samples(Protocol):
    """Samples by number."""

    def __getitem__(self, i: int) -> Sample: ...

    def __iter__(self) -> Iterator[Sample]: ...

    def __len__(self) -> int: ...


class PaddedDataset:
    """Samples by number, as :func:`pad_sample` makes them."""

    def __init__(self, samples: Samples, max_parts: int, float32: bool = True):
        self.samples, self.max_parts, self.float32 = samples, max_parts, float32

    def __len__(self) -> int:
        return len(self.samples)

    def __getitem__(self, i: int) -> dict[str, Any]:
        return pad_sample(self.samples[i], self.max_parts, self.float32)


class PaddedStream(Shared, PaddedDataset):
    """Samples of a stream, as :func:`pad_sample` makes them; for loaders of torch an ``IterableDataset``."""

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return (pad_sample(sample, self.max_parts, self.float32) for sample in self.samples)
