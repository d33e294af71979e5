"""Learning to say where boxes end: estimates of fresh views, and the network that learns from how their boxes are off.

The network sees what it will see in use: references as they were found and fitted, faults included.
"""

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.utils.data import DataLoader, Dataset

from artperl.boxes.evidence import Evidence
from artperl.boxes.network import Boxes, box_losses
from artperl.core.batch import Batch, concatenate
from artperl.core.distributed import ALONE, Ranks
from artperl.core.estimate import points_at_rest
from artperl.core.tensor_files import read_tensors, write_tensors
from artperl.data.batches import ignore_interrupt
from artperl.evaluation.metrics import true_poses
from artperl.methods.full import Estimator
from artperl.training.context import Report
from artperl.training.steps import Stop, one_cycle, set_rate
from artsim.common.progress import track
from artsim.errors import DatasetError
from artsim.observing.sample import Sample

_SAVE_VIEWS = 200
"""Views after which records are written down."""
_BATCH = 32
_RATE, _DECAY = 2e-3, 0.1


@dataclass(frozen=True, eq=False)
class Records(Batch):
    """B estimates: what was seen, and the true boxes, in the estimated rest frame, in diagonals."""

    evidence: Evidence
    center: Tensor
    size: Tensor
    """(B, P, 3) float. Where the boxes are seen, brought to rest by the estimated poses."""
    rest: Tensor
    """(B, P, 3) float. Their centres at rest."""


class _Examined(Dataset[list[Records]]):
    """Records by number of the sample."""

    def __init__(self, estimator: Estimator, samples: Callable[[int], Sample], residual: float):
        self.estimator, self.samples, self.residual = estimator, samples, residual

    def __getitem__(self, number: int) -> list[Records]:
        return _examined(self.estimator, self.samples(number), self.residual)


def record(
    estimator: Estimator, samples: Callable[[int], Sample], views: int, file: Path, report: Report, stop: Stop,
    workers: int, progress: bool, residual: float, ranks: Ranks = ALONE,
) -> Records | None:  # fmt: skip
    """Records of the first so many samples, in single precision; those that the file holds are taken from it.

    None when no estimate has so small a residual. Several processes that learn together look at views in turn, and the
    first keeps the records: the others get none. Each of the workers, processes of one thread, estimates other samples;
    without any, this process does.

    Raises
    ------
    KeyboardInterrupt
        When a stop is asked for, and what there is has been written down.
    """
    first, records = load_records(file) if ranks.first and file.exists() else (0, [])
    first = ranks.same(first)
    bar = track("boxes", total=views, initial=first, unit="view", smoothing=0.02, shown=progress)
    loader = DataLoader(
        _Examined(estimator, samples, residual), batch_size=None, sampler=range(first + ranks.rank, views, ranks.count),
        num_workers=workers, worker_init_fn=ignore_interrupt,
    )  # fmt: skip
    for n, made in zip(range(first, views), ranks.in_turn(map(_own, loader)), strict=False):
        report("boxes", {"fits": float(len(made))}, n)
        bar.update()
        stop.asked = ranks.add([stop.asked])[0] > 0
        if ranks.first:
            records += made
            if (n + 1) % _SAVE_VIEWS == 0 or n + 1 == views or stop.asked:
                _save(records, n + 1, file)
        if stop.asked:
            raise KeyboardInterrupt
    bar.close()
    every: Records | None = concatenate(records).to(torch.float32) if records else None
    return every


def _own(made: list[Records]) -> list[Records]:
    """Out of the workers' shared memory."""
    return [each.map(torch.clone) for each in made]


def learn(
    records: Records, num_rows: int, width: int, steps: int, seed: int, progress: bool, report: Report
) -> Boxes:  # fmt: skip
    """A network that has learnt from records: always the same one for the same arguments."""
    torch.manual_seed(seed)
    boxes = Boxes(num_rows, width).to(records.center.device)
    optimizer = torch.optim.AdamW(boxes.parameters(), weight_decay=_DECAY)
    bar = track("moving faces", range(steps), smoothing=0.02, shown=progress)
    for step in bar:
        set_rate(optimizer, _RATE * one_cycle(step, steps))
        batch = records[torch.randint(len(records), (_BATCH,))]
        center, size, farther = boxes(batch.evidence)
        axis, valid = batch.evidence.axis, batch.evidence.valid
        slides = axis.any(-1)
        losses = box_losses(center, size, batch.center, batch.size, valid)
        losses += box_losses(center - farther[..., None] * axis, size, batch.rest, batch.size, slides)
        loss = losses.sum() / (valid.sum() + slides.sum())
        optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(boxes.parameters(), 1.0)
        optimizer.step()
        report("box_faces", {"loss": loss.item()}, step)
        bar.set_postfix_str(f"loss {loss.item():.3f}")
    return boxes


def _examined(estimator: Estimator, sample: Sample, residual: float) -> list[Records]:
    """The record of one sample, in half precision as it is kept; none if the estimate does not fit."""
    estimate, evidence, unit = estimator.evidence(sample.points)
    K = len(sample.box_size)
    if estimate.residual > residual or len(estimate.size) != K:
        return []
    T, T_true = estimate.T_camera_part, sample.T_camera_part[0]
    center = points_at_rest(true_poses(sample)[1], T)
    still = sample.box_center @ T_true[:3, :3].T + T_true[:3, 3]  # every part where it is at rest, in the camera frame
    rest = points_at_rest(still, np.broadcast_to(T[0], T.shape))
    padded = np.zeros((3, 1, evidence.valid.shape[1], 3))
    padded[:, 0, :K] = center / unit, sample.box_size / unit, rest / unit
    return [Records(evidence, *torch.from_numpy(padded)).to(torch.float16)]


def _save(records: list[Records], views: int, file: Path) -> None:
    tensors = {"views": torch.tensor(views)}
    if records:
        every: Records = concatenate(records)
        tensors |= {name: values for name, values in vars(every).items() if name != "evidence"}
        tensors |= {f"evidence.{name}": values for name, values in vars(every.evidence).items()}
    write_tensors(tensors, file)


def load_records(file: Path) -> tuple[int, list[Records]]:
    """How many views were looked at, and what they gave.

    Raises
    ------
    DatasetError
        When the file is damaged.
    """
    fix = f"to look at these views again: rm {shlex.quote(str(file))}"
    tensors, _ = read_tensors(file, "what boxes learn from", fix)
    try:
        views = int(tensors.pop("views"))
        if not tensors:
            return views, []
        names = [name for name in tensors if name.startswith("evidence.")]
        evidence = {name.removeprefix("evidence."): tensors.pop(name) for name in names}
        return views, [Records(Evidence(**evidence), **tensors)]
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        raise DatasetError(f"what boxes learn from is damaged ({error})", file, fix) from error
