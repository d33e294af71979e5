"""Training data: batches of partial clouds with what the perception network is to say about them."""

import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, IterableDataset, get_worker_info

from artperl.core.clouds import Clouds
from artperl.data.degrading import degrade
from artperl.data.sources import DataOptions, Source
from artperl.data.stretching import stretch
from artperl.data.truth import Truth, to_batch, training_rows
from artsim.datasets.sample_options import SensorName
from artsim.model.kinematics import Array
from artsim.observing.sample import Sample

_USES = 4
"""Batches that a cloud is seen in, on average. Making one takes as long as learning from one."""
_WINDOW = 64
"""Batches, after which a cloud is not seen again."""
_STRETCHING = 1
"""Begins the seed of how a view is stretched; its number is the rest."""
_BLURRING = 2
"""Begins the seed of whether a view is as a sensor sees it."""
_DEGRADING = 3
"""Begins the seed of whether a view is cut or dirty, and how."""
SENSORS: tuple[SensorName, ...] = ("d435", "azure", "kinect_v1", "gaussian3mm")
"""By which some training clouds are seen; all views of one object are by the same one."""
_SPARE = 2
"""Times the points of a cloud that are made where some may be left out."""


MoreRows = Callable[[Source, int, Sample], dict[str, Array]]
"""Of a source, a number and the sample of that number: arrays of equal shapes that a method learns besides."""


InTurn = Callable[[Iterator[dict[str, Tensor]]], Iterator[dict[str, Tensor]]]
"""See :meth:`artperl.core.distributed.Ranks.in_turn`."""


class _Rows(IterableDataset[dict[str, Array]]):
    """Rows of fresh objects from sample number ``first`` on, shared out to the loader's workers batch by batch.

    Of several processes that learn together, ``share`` is this one's number, and how many there are.
    Some samples are stretched, of the others some come from the sources of ``noisy`` ones; of all, some are degraded.
    """

    def __init__(
        self, samples: Source, noisy: Sequence[Source], num_points: int, batch_size: int, first: int,
        options: DataOptions, more: MoreRows | None, share: tuple[int, int] = (0, 1),
    ):  # fmt: skip
        self.more, self.share = more, share
        self.samples, self.noisy, self.num_points = samples, noisy, num_points
        self.batch_size, self.first, self.options = batch_size, first, options

    def __iter__(self) -> Iterator[dict[str, Array]]:
        info = get_worker_info()
        worker, workers = (info.id, info.num_workers) if info else (0, 1)
        rank, ranks = self.share
        batch = self.first // self.batch_size + rank + ranks * worker
        while True:
            for i in range(batch * self.batch_size, (batch + 1) * self.batch_size):
                sample = self._sample(i)
                more = {} if self.more is None else self.more(self.samples, i, sample)
                yield training_rows(sample, self.num_points, self.samples.num_rows) | more
            batch += ranks * workers

    def _sample(self, i: int) -> Sample:
        rng = np.random.default_rng([_STRETCHING, i])
        degrading = np.random.default_rng([_DEGRADING, i])
        degraded = degrading.random() < self.options.degraded
        if rng.random() < self.options.stretched:
            # A cut stretched cloud has points that come twice, since stretching takes from those that are to spare.
            sample = stretch(self.samples[i], self.num_points, rng)
        else:
            noisy = np.random.default_rng([_BLURRING, i]).random() < self.options.noisy
            # Views of one object follow one another, so that each object is made once for its views by a sensor.
            sample = (self.noisy[i // self.batch_size % len(self.noisy)] if noisy else self.samples)[i]
        return degrade(sample, self.num_points, degrading) if degraded else sample


def ignore_interrupt(worker: int) -> None:
    """A worker ends with the process that it works for, which hears Ctrl-C, too."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def batches(
    data: DataOptions, num_rows: int, num_points: int = 1024, batch_size: int = 32, first_batch: int = 0,
    seed: int = 0, workers: int = 1, share: tuple[int, int] = (0, 1), in_turn: InTurn = iter,
) -> Iterator[tuple[Clouds, Truth]]:  # fmt: skip
    """Endless batches of fresh procedural objects, or of a dataset.

    A quarter of each batch is views of one object that was never seen before; the others are drawn from the last
    batches' and shuffled anew. Batch ``n`` is always the same, whatever the number of workers and wherever the run was
    begun.

    Parameters
    ----------
    data : DataOptions
    num_rows : int
        Rows for parts.
    num_points, batch_size : int
    first_batch : int
        Number of the first batch, to go on with a stopped run.
    seed : int
    workers : int
        Processes that make samples; 0 makes them in this one.
    share, in_turn
        See :func:`row_batches`.
    """
    own = row_batches(data, num_rows, num_points, batch_size, first_batch, seed, workers, None, share, in_turn)
    for rows in own:
        yield to_batch(rows)


def row_batches(
    data: DataOptions, num_rows: int, num_points: int = 1024, batch_size: int = 32, first_batch: int = 0,
    seed: int = 0, workers: int = 1, more: MoreRows | None = None, share: tuple[int, int] = (0, 1),
    in_turn: InTurn = iter, views_per_object: int | None = None,
) -> Iterator[dict[str, Tensor]]:  # fmt: skip
    """Batches as :func:`batches` makes them, as rows for :func:`artperl.data.truth.to_batch`, and more rows.

    Of several processes that learn together, each makes every n-th batch of fresh clouds; ``in_turn`` lets all see all.
    ``views_per_object``: of the fresh clouds; by default all are of one object.
    """
    spare = (data.stretched or data.degraded) and data.dataset is None
    made_points = _SPARE * num_points if spare else num_points
    fresh, begin = max(1, batch_size // _USES), max(0, first_batch - _WINDOW + 1)
    samples = data.source(num_rows, made_points, seed, views_per_object or fresh)
    sensed = [samples.seen_by(sensor) for sensor in SENSORS] if data.noisy else []
    rows = _Rows(samples, sensed, num_points, fresh, begin * fresh, data, more, share)
    loader = DataLoader(
        rows, fresh, num_workers=workers, prefetch_factor=4 if workers else None, worker_init_fn=ignore_interrupt
    )
    window: deque[dict[str, Tensor]] = deque(maxlen=_WINDOW)
    for n, made in enumerate(in_turn(iter(loader)), begin):
        window.append({name: values.clone() for name, values in made.items()})  # out of the workers' shared memory
        if n >= first_batch:
            yield _mixed(window, batch_size, np.random.default_rng([seed, n]))


def _mixed(window: Sequence[dict[str, Tensor]], batch_size: int, rng: np.random.Generator) -> dict[str, Tensor]:
    """All of the newest rows, and any of the window's, each with its points in a new order."""
    fresh, num_points = window[-1]["part"].shape
    total = len(window) * fresh
    chosen = [*range(total - fresh, total), *rng.integers(total, size=batch_size - fresh).tolist()]
    rows = {name: torch.stack([window[i // fresh][name][i % fresh] for i in chosen]) for name in window[-1]}
    order = torch.from_numpy(rng.permuted(np.tile(np.arange(num_points), (batch_size, 1)), axis=1))
    for name in ("points", "part", "own", "canonical"):
        values = rows[name]
        rows[name] = values.gather(1, order.reshape(*order.shape, *[1] * (values.ndim - 2)).expand(values.shape))
    return rows
