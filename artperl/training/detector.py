"""Training a detector on scenes, resumably: batches and rates are functions of their number.

The losses: cross-entropy of categories, and for cells of objects the distance of their votes from the middle and the
difference of logarithms of the size.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor
from torch.nn import functional
from torch.utils.data import DataLoader

from artperl.core.mixed_precision import autocast
from artperl.detection.detector import Detector, save_detector
from artperl.detection.images import WIDTH
from artperl.detection.network import OFFSET, DetectorNetwork, DetectorSize
from artperl.training.recipes import commit
from artperl.training.report import write_scalars
from artperl.training.run_folder import RunFolder
from artperl.training.scene_cells import Cells, SceneCells
from artperl.training.state import RunState
from artperl.training.steps import Stop, one_cycle, set_rate
from artperl.training.supervised import SAVE_STEPS, descend
from artsim.common.progress import track
from artsim.errors import ConfigError
from artsim.scenes import SceneDataset

_DECAY = 1e-2
_NETWORK = "detector"
_MIDDLE = 5.0
"""Of the distance in the loss: it is a fifth of the entropy, and objects are told apart by it alone."""


@dataclass(frozen=True)
class DetectorOptions:
    """What a detector learns from, and how long.

    Raises
    ------
    ConfigError
        When an option makes no sense.
    """

    scenes: tuple[str, ...]
    """Folders that artsim scene wrote."""
    categories: tuple[str, ...]
    steps: int = 4000
    batch_size: int = 8
    """Windows of a batch."""
    width: int = 32
    """Channels of the network's finest level."""
    blocks: int = 2
    """Residual blocks of each of its four levels."""
    columns: int = WIDTH
    """Of the images that it looks at."""
    rate: float = 2e-3
    """Highest learning rate."""
    seed: int = 0
    device: str = "cpu"

    def __post_init__(self) -> None:
        for name in ("steps", "batch_size", "width", "blocks"):
            if getattr(self, name) < 1:
                raise ConfigError(f"{getattr(self, name)} is not possible", name, "use 1 or more")
        if not 0.0 < self.rate < 1.0:
            raise ConfigError(f"{self.rate} is no learning rate", "rate", "use 1e-4 to 1e-2")
        if not self.scenes or not self.categories:
            raise ConfigError("there is nothing to learn from", "scenes, categories", "name folders of scenes")


def scene_options(folders: Sequence[Path], **changes: Any) -> DetectorOptions:
    """Options for all categories of some scenes.

    Raises
    ------
    DatasetError
        When a folder holds no scenes.
    """
    categories = sorted({name for folder in folders for name in SceneDataset(folder).categories})
    return DetectorOptions(tuple(map(str, folders)), tuple(categories), **changes)


def train_detector(options: DetectorOptions, out: Path, workers: int = 1, progress: bool = True) -> Detector:
    """Train a detector, or go on with a run that was stopped, with the same result.

    Parameters
    ----------
    options : DetectorOptions
    out : Path
        Folder of the run: ``best`` holds the detector, ``state.*`` what is needed to go on, ``events`` the curves.
    workers : int
        Processes that make batches; the result does not depend on it.
    progress : bool

    Raises
    ------
    KeyboardInterrupt
        After Ctrl-C, once where the run stands is written down.
    DatasetError
        When the folder holds a run with other options, or another process trains there.
    ConfigError
        When the folder cannot be written to.
    """
    torch.manual_seed(options.seed)
    device = torch.device(options.device)
    network = DetectorNetwork(DetectorSize(options.categories, options.width, options.blocks)).to(device)
    network.to(memory_format=torch.channels_last)  # type: ignore[call-overload]  # 1.7 times as fast on a CPU
    optimizer = torch.optim.AdamW(network.parameters(), weight_decay=_DECAY)
    folder, state = RunFolder(out), RunState({_NETWORK: network}, {_NETWORK: optimizer})
    with folder.held(), folder.curves() as board, Stop() as stop:
        state.load(folder, options)
        first = state.done[_NETWORK]
        folders = [Path(name) for name in options.scenes]
        data = SceneCells(folders, options.categories, options.batch_size, options.seed, options.columns)
        loader = DataLoader(data, batch_size=None, sampler=range(first, options.steps), num_workers=workers)
        bar = track(_NETWORK, total=options.steps, initial=first, smoothing=0.02, shown=progress)
        network.train()
        for step, cells in enumerate(loader, first):
            figures = _learn(network, optimizer, cells, one_cycle(step, options.steps) * options.rate, device)
            write_scalars(board, _NETWORK, figures, step)
            bar.set_postfix_str(f"cells {100 * figures['right']:.0f} %, middles off {100 * figures['off']:.1f} %")
            bar.update()
            state.done[_NETWORK] = step + 1
            if (step + 1) % SAVE_STEPS == 0 or stop.asked:
                state.save(folder, options)
            if stop.asked:
                raise KeyboardInterrupt
        bar.close()
        state.save(folder, options)
        detector = Detector(network.cpu())
        about = {"commit": commit(), "options": json.loads(json.dumps(asdict(options)))}
        save_detector(detector, folder.best, about)
    return detector


def _learn(
    network: DetectorNetwork, optimizer: torch.optim.Optimizer, cells: Cells, rate: float, device: torch.device
) -> dict[str, float]:
    cells = Cells(*(value.to(device) for value in vars(cells).values()))
    set_rate(optimizer, rate)
    with autocast(device):
        logits, told = network(cells.channels.contiguous(memory_format=torch.channels_last))
    losses, figures = detector_losses(logits, told, cells)
    loss = torch.stack(list(losses.values())).sum()
    descend(optimizer, network, loss)
    return {name: value.item() for name, value in losses.items()} | figures


def detector_losses(logits: Tensor, told: Tensor, cells: Cells) -> tuple[dict[str, Tensor], dict[str, float]]:
    """Losses of the network's answer, and figures for people.

    Parameters
    ----------
    logits, told : Tensor
        See :meth:`artperl.detection.network.DetectorNetwork.forward`.
    cells : Cells

    Returns
    -------
    tuple
        Losses ``category``, ``middle``, ``size``; figures ``right``, the share of objects' cells whose category is
        right, and ``off``, the mean distance of their votes from the middle over the diagonal.
    """
    weight, there = cells.weight, cells.category > 0
    entropy = functional.cross_entropy(logits, cells.category, reduction="none")
    own = weight * there
    count = own.sum().clamp(min=1.0)
    diagonal = cells.size.exp()
    distance = OFFSET * (told[:, :3] - cells.offset).norm(dim=1) / diagonal
    losses = {
        "category": (weight * entropy).sum() / weight.sum(),
        "middle": _MIDDLE * (own * distance).sum() / count,
        "size": (own * (told[:, 3] - cells.size).abs()).sum() / count,
    }
    with torch.no_grad():
        seen = there.sum().clamp(min=1)
        right = float(((logits.argmax(1) == cells.category) & there).sum() / seen)
        off = float((distance * there).sum() / seen)
    return losses, {"right": right, "off": off}
