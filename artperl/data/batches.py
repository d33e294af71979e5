"""Training data: batches of partial clouds with what the perception network is to say about them."""

from __future__ import annotations

import signal
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, IterableDataset, get_worker_info

from artperl.core.batch import Batch
from artperl.core.part_order import reordered_sample, visible_order
from artperl.data.categories import Parts, arranged, has_parts
from artperl.data.stretching import stretch
from artsim.datasets.dataset import open_dataset
from artsim.datasets.plan import SampleOptions, draw_sample
from artsim.datasets.stream import FamilyStream
from artsim.errors import AssetError, ConfigError, DatasetError
from artsim.model.kinematics import ROTATING, Array
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.renderers import shared_renderer

_ATTEMPTS = 200
_USES = 4
"""Batches that a cloud is seen in, on average. Making one takes as long as learning from one."""
_WINDOW = 64
"""Batches, after which a cloud is not seen again."""
_STRETCHING = 1
"""Begins the seed of how a view is stretched; its number is the rest."""
_BLURRING = 2
"""Begins the seed of whether a view is as a sensor sees it."""
SENSOR: Final = "d435"
"""By which some training clouds are seen."""
_SPARE = 2
"""Times the points of a cloud that are made where some may be left out."""


@dataclass(frozen=True, eq=False)
class Clouds(Batch):
    """B partial clouds of N points, brought to a common place and size.

    Attributes
    ----------
    points : (B, N, 3) float
        ``(camera-frame points - center) / radius``, in random order.
    center : (B, 3) float
        Mean of the points, metres, camera frame.
    radius : (B,) float
        Root of the mean squared distance from it, times two, metres.
    """

    points: Tensor
    center: Tensor
    radius: Tensor

    @staticmethod
    def of(points: Tensor) -> Clouds:
        """Clouds of (B, N, 3) camera-frame points."""
        center = points.mean(1)
        local = points - center[:, None]
        radius = 2.0 * local.square().sum(-1).mean(1).sqrt().clamp(min=1e-9)
        return Clouds(local / radius[:, None, None], center, radius)


@dataclass(frozen=True, eq=False)
class Truth(Batch):
    """What is true of B clouds. Lengths of the rest frame are in diagonals of the object.

    Attributes
    ----------
    part : (B, N) int64
    canonical : (B, N, 3) float
        Where each point lies in the rest frame, at rest.
    part_valid : (B, P) bool
    box_center, box_size : (B, P, 3) float
    joint : (B, P, 9) float
        See :func:`joint_rows`.
    level : (B, P) int64
        How many joints are between the root and the part.
    diagonal : (B,) float
        Over the cloud's radius.
    """

    part: Tensor
    canonical: Tensor
    part_valid: Tensor
    box_center: Tensor
    box_size: Tensor
    joint: Tensor
    level: Tensor
    diagonal: Tensor

    def of_points(self, rows: Tensor) -> Tensor:
        """(B, N, ...) of each point's part, from (B, P, ...) of each part."""
        return torch.stack([own[part] for own, part in zip(rows, self.part, strict=True)])


class Samples:
    """Samples of fresh procedural objects by number.

    Another object of the same category takes the place of one that has other parts than are asked for, more than
    ``num_rows`` of them, or that cannot be made: a long run outlives the rare fault of a family, which artsim's audit
    reports.

    Parameters
    ----------
    categories : sequence of str
    options : SampleOptions
    seed : int
    views_per_object : int
    num_rows : int
    parts : Parts
    given : sequence of ArticulatedObject
        Every other object is one of these, if there are any.
    """

    def __init__(
        self,
        categories: Sequence[str],
        options: SampleOptions,
        seed: int,
        views_per_object: int,
        num_rows: int,
        parts: Parts = "artimage",
        given: Sequence[ArticulatedObject] = (),
    ):
        self.stream = FamilyStream(categories, options, seed, views_per_object)
        self.num_rows, self.parts, self.given = num_rows, parts, given
        self._keep()

    def __getitem__(self, i: int) -> Sample:
        n, view = divmod(i, self.stream.views_per_object)
        index = i if self._is_given(n) else self._right(n) * self.stream.views_per_object + view
        renderer = shared_renderer(self.stream.options.renderer)
        return draw_sample(self.object(i), self.stream.options, self.stream.seed, index, renderer)

    def object(self, i: int) -> ArticulatedObject:
        """The object that sample ``i`` shows."""
        return self._object(i // self.stream.views_per_object)

    def _is_given(self, n: int) -> bool:
        return bool(self.given) and n % 2 == 1

    def _find_object(self, n: int) -> ArticulatedObject:
        if self._is_given(n):
            return self.given[int(np.random.default_rng([self.stream.seed, n]).integers(len(self.given)))]
        return arranged(self.stream.object(self._right(n)), self.parts)

    def _find_right(self, n: int) -> int:
        """Number of the object that stands for object ``n``."""
        category = self.stream.categories[n % len(self.stream.categories)]
        elsewhere = len(self.stream.categories) << 32  # of the same category, and no run gets there
        for attempt in range(_ATTEMPTS):
            try:
                tree = self.stream.object(n + attempt * elsewhere).tree
            except AssetError:
                continue
            if len(tree) <= self.num_rows and has_parts(category, tree.types, tree.axes, self.parts):
                return n + attempt * elsewhere
        raise ConfigError(
            f"{_ATTEMPTS} objects in a row have more than {self.num_rows} parts, or other ones, or cannot be made",
            ", ".join(self.stream.categories),
            "allow more parts, or mend the family",
        )

    def _keep(self) -> None:
        """Begin to remember what was looked up."""
        self._right = lru_cache(maxsize=64)(self._find_right)
        self._object = lru_cache(maxsize=8)(self._find_object)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name not in ("_right", "_object")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._keep()


class Recorded:
    """Samples of a dataset by number: the train split of what ``generate.py`` wrote, in another order on each pass.

    Parameters
    ----------
    folder : str or Path
    categories : sequence of str
        Of the objects to learn from.
    seed : int
        Of the order.
    num_rows : int
        The most parts that an object may have.
    num_points : int
        The least points that a cloud must have.
    parts : Parts

    Raises
    ------
    DatasetError
        When no sample of the dataset is of these categories and has these parts, or clouds have too few points.
    """

    def __init__(
        self, folder: str | Path, categories: Sequence[str], seed: int, num_rows: int, num_points: int,
        parts: Parts = "artimage",
    ):  # fmt: skip
        self.dataset, self.seed, self.num_rows = open_dataset(folder, "train"), seed, num_rows
        self.categories, self.parts = tuple(categories), parts
        self._usable: list[int] = []
        wanted: dict[str, bool] = {}
        for place in range(len(self.dataset)):
            key = self.dataset.object_key(place)
            if key not in wanted:
                wanted[key] = self._is_right(self.dataset[place])
            if wanted[key]:
                self._usable.append(place)
        if not self._usable:
            raise DatasetError(
                f"its train split has no {' or '.join(categories)} with the right parts", folder,
                "generate one with these categories, or use --parts any",
            )  # fmt: skip
        if len(self.dataset[self._usable[0]].points) < num_points:
            raise DatasetError(
                f"its clouds have fewer than {num_points} points", folder,
                "generate larger ones; without dense steps fewer are enough",
            )  # fmt: skip
        self._turn, self._order = -1, np.empty(0, dtype=np.int64)

    def __getitem__(self, i: int) -> Sample:
        turn, place = divmod(i, len(self._usable))
        if turn != self._turn:
            self._turn, self._order = turn, np.random.default_rng([self.seed, turn]).permutation(self._usable)
        sample = self.dataset[int(self._order[place])]
        if self.parts != "any":
            return sample
        return reordered_sample(sample, visible_order(sample.joint_parent, sample.box_center, sample.box_size))

    def object(self, i: int) -> ArticulatedObject:
        """The object that sample ``i`` shows."""
        return arranged(self.dataset.object_of(self[i]), self.parts)

    def _is_right(self, sample: Sample) -> bool:
        few_enough = len(sample.joint_type) <= self.num_rows
        return sample.category in self.categories and few_enough and has_parts(
            sample.category, sample.joint_type, sample.joint_axis, self.parts
        )  # fmt: skip


class Given:
    """Samples of a few objects by number: fresh states and views of the same ones for ever.

    Parameters
    ----------
    objects : sequence of ArticulatedObject
    options : SampleOptions
    seed : int
    views_per_object : int
        Samples in a row of the same object.
    num_rows : int
        The most parts that an object has.
    """

    def __init__(
        self, objects: Sequence[ArticulatedObject], options: SampleOptions, seed: int, views_per_object: int,
        num_rows: int,
    ):  # fmt: skip
        self.objects, self.options, self.seed = objects, options, seed
        self.views_per_object, self.num_rows = views_per_object, num_rows

    def __getitem__(self, i: int) -> Sample:
        return draw_sample(self.object(i), self.options, self.seed, i, shared_renderer(self.options.renderer))

    def object(self, i: int) -> ArticulatedObject:
        """The object that sample ``i`` shows."""
        number = i // self.views_per_object
        return self.objects[int(np.random.default_rng([self.seed, number]).integers(len(self.objects)))]


Source = Samples | Recorded | Given


def samples_from(
    dataset: str | Path | None, categories: Sequence[str], options: SampleOptions, seed: int, views_per_object: int,
    num_rows: int, parts: Parts, given: Sequence[ArticulatedObject],
) -> Source:  # fmt: skip
    """What there is to learn from: a dataset; or fresh objects of some categories; or, without those, given ones."""
    if dataset is not None:
        return Recorded(dataset, categories, seed, num_rows, options.num_points, parts)
    if not categories:
        return Given(given, options, seed, views_per_object, num_rows)
    return Samples(categories, options, seed, views_per_object, num_rows, parts, given)


def joint_rows(kinds: Sequence[str], axis: Array, origin: Array, center: Array, diagonal: float) -> Array:
    """(K, 9) what tells the joints of K parts apart: zeros for the root and where a part is fixed.

    The direction of a slide (3), that of a turning axis (3), and where the nearest point of this axis is from the
    centre of the part's box, in diagonals (3).

    Parameters
    ----------
    kinds : sequence of str, length K
        Types of joints.
    axis, origin, center : (K, 3) float
        In the rest frame; axes of length 1.
    diagonal : float
        Of the object.
    """
    sliding, turning = (np.isin(kinds, types)[:, None] for types in ("prismatic", list(ROTATING)))
    away = origin - center
    pivot = (away - (away * axis).sum(-1, keepdims=True) * axis) / diagonal
    rows: Array = np.concatenate([axis * sliding, axis * turning, pivot * turning], axis=1)
    return rows


def training_rows(sample: Sample, num_points: int, num_rows: int) -> dict[str, Array]:
    """One sample as arrays for :class:`Clouds` and :class:`Truth`, with ``num_rows`` rows for parts."""
    K = len(sample.joint_type)
    points, part = sample.points[:num_points], sample.part[:num_points].astype(np.int64)
    joint = joint_rows(
        sample.joint_type, sample.joint_axis, sample.joint_origin, sample.box_center, sample.diagonal
    )  # fmt: skip
    level = np.zeros(num_rows, dtype=np.int64)
    for k in range(1, K):
        level[k] = level[sample.joint_parent[k]] + 1

    def pad(rows: Array) -> Array:
        padded = np.zeros((num_rows, *rows.shape[1:]), dtype=np.float32)
        padded[:K] = rows
        return padded

    return {
        "points": points.astype(np.float32),
        "part": part,
        "canonical": (sample.rest_points[:num_points] / sample.diagonal).astype(np.float32),
        "part_valid": np.arange(num_rows) < K,
        "box_center": pad(sample.box_center / sample.diagonal),
        "box_size": pad(sample.box_size / sample.diagonal),
        "joint": pad(joint),
        "level": level,
        "diagonal": np.float32(sample.diagonal),
    }


def to_batch(rows: dict[str, Tensor]) -> tuple[Clouds, Truth]:
    """Collated rows of :func:`training_rows` as records."""
    clouds = Clouds.of(rows["points"])
    names = ("part", "canonical", "part_valid", "box_center", "box_size", "joint", "level")
    return clouds, Truth(**{name: rows[name] for name in names}, diagonal=rows["diagonal"] / clouds.radius)


class _Rows(IterableDataset[dict[str, Array]]):
    """Rows of fresh objects from sample number ``first`` on, shared out to the loader's workers batch by batch.

    Some samples are stretched, and of the others some come from a source of ``noisy`` ones.
    """

    def __init__(
        self, samples: Source, noisy: Source, num_points: int, batch_size: int, first: int, stretched: float,
        noise: float,
    ):  # fmt: skip
        self.samples, self.noisy, self.num_points = samples, noisy, num_points
        self.batch_size, self.first, self.stretched, self.noise = batch_size, first, stretched, noise

    def __iter__(self) -> Iterator[dict[str, Array]]:
        info = get_worker_info()
        worker, workers = (info.id, info.num_workers) if info else (0, 1)
        batch = self.first // self.batch_size + worker
        while True:
            for i in range(batch * self.batch_size, (batch + 1) * self.batch_size):
                yield training_rows(self._sample(i), self.num_points, self.samples.num_rows)
            batch += workers

    def _sample(self, i: int) -> Sample:
        rng = np.random.default_rng([_STRETCHING, i])
        if rng.random() < self.stretched:
            return stretch(self.samples[i], self.num_points, rng)
        noisy = np.random.default_rng([_BLURRING, i]).random() < self.noise
        return (self.noisy if noisy else self.samples)[i]


def carry_on(worker: int) -> None:
    """A worker ends with the process that it works for, which hears Ctrl-C, too."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def batches(
    categories: Sequence[str],
    num_rows: int,
    num_points: int = 1024,
    batch_size: int = 32,
    first_batch: int = 0,
    seed: int = 0,
    workers: int = 1,
    sample: SampleOptions | None = None,
    parts: Parts = "artimage",
    given: Sequence[ArticulatedObject] = (),
    dataset: str | Path | None = None,
    stretched: float = 0.0,
    noisy: float = 0.0,
) -> Iterator[tuple[Clouds, Truth]]:
    """Endless batches of fresh procedural objects, or of a dataset.

    A quarter of each batch is views of one object that was never seen before; the others are drawn from the last
    batches' and shuffled anew. Batch ``n`` is always the same, whatever the number of workers and wherever the run was
    begun.

    Parameters
    ----------
    categories : sequence of str
        Empty to learn from the given objects alone.
    num_rows : int
        Rows for parts.
    num_points, batch_size : int
    first_batch : int
        Number of the first batch, to go on with a stopped run.
    seed : int
    workers : int
        Processes that make samples; 0 makes them in this one.
    sample : SampleOptions, optional
        View preset, noise and the like; ``num_points`` overrides its own.
    parts : Parts
    given : sequence of ArticulatedObject
        See :func:`samples_from`.
    dataset : str or Path, optional
        See :class:`Recorded`.
    stretched : float
        Share of the views whose objects are stretched; see :func:`artperl.data.stretching.stretch`.
    noisy : float
        Share of the others that are as a :data:`SENSOR` sees them.
    """
    cast = _SPARE * num_points if stretched and dataset is None else num_points  # a dataset has what it has
    options = SampleOptions(**{**vars(sample or SampleOptions()), "num_points": cast})
    fresh, begin = max(1, batch_size // _USES), max(0, first_batch - _WINDOW + 1)
    samples = sensed = samples_from(dataset, categories, options, seed, fresh, num_rows, parts, given)
    if noisy:
        as_seen = replace(options, noise=SENSOR)
        sensed = samples_from(dataset, categories, as_seen, seed, fresh, num_rows, parts, given)
    rows = _Rows(samples, sensed, num_points, fresh, begin * fresh, stretched, noisy)
    loader = DataLoader(
        rows, fresh, num_workers=workers, prefetch_factor=4 if workers else None, worker_init_fn=carry_on
    )
    window: deque[dict[str, Tensor]] = deque(maxlen=_WINDOW)
    for n, made in enumerate(loader, begin):
        window.append({name: values.clone() for name, values in made.items()})  # out of the workers' shared memory
        if n >= first_batch:
            yield to_batch(_mixed(window, batch_size, np.random.default_rng([seed, n])))


def _mixed(window: Sequence[dict[str, Tensor]], batch_size: int, rng: np.random.Generator) -> dict[str, Tensor]:
    """All of the newest rows, and any of the window's, each with its points in a new order."""
    fresh, num_points = window[-1]["part"].shape
    total = len(window) * fresh
    chosen = [*range(total - fresh, total), *rng.integers(total, size=batch_size - fresh).tolist()]
    rows = {name: torch.stack([window[i // fresh][name][i % fresh] for i in chosen]) for name in window[-1]}
    order = torch.from_numpy(rng.permuted(np.tile(np.arange(num_points), (batch_size, 1)), axis=1))
    for name in ("points", "part", "canonical"):
        values = rows[name]
        rows[name] = values.gather(1, order.reshape(*order.shape, *[1] * (values.ndim - 2)).expand(values.shape))
    return rows
