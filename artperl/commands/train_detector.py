"""The verb ``artperl train-detector``."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from artsim.common.extras import require_extra
from artsim.common.program import cores, resumable
from artsim.errors import ConfigError

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class TrainDetector:
    """Train a detector of articulated objects in images with depth, on scenes.

    Without SCENES, the command makes those of the package's detector, into OUT/scenes. Stop it
    at any moment with Ctrl-C: rerun the command to resume, with the same result. Curves: tensorboard
    --logdir OUT.

    To see it learn: artperl train-detector --out out/detector --share 0.02 --steps 20

    On your scenes: artperl train-detector out/scenes --out out/detector

    To use it: artperl estimate image.png depth.png --intrinsics camera.json --detector out/detector
    """

    scenes: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Folders that artsim scene wrote. All of their categories are learnt."""
    out: Path = Path("out/detector")
    """Folder of the run."""
    share: float = 1.0
    """Share of the scenes that are made, for a trial."""
    steps: int = 4000
    """Batches that the network learns from."""
    batch_size: int = 8
    """Windows of a batch, a quarter of an image each."""
    width: int = 32
    """Channels of the network's finest level."""
    blocks: int = 2
    """Residual blocks of each of its four levels."""
    rate: float = 2e-3
    """Highest learning rate."""
    seed: int = 0
    device: Literal["cpu", "cuda"] = "cpu"
    """Where the network learns."""
    workers: int = 1
    """Processes that make batches; the result does not depend on it."""
    threads: int | None = None
    """Processor threads of the network; by default torch's choice."""

    def run(self) -> None:
        if not 0.0 < self.share <= 1.0:
            raise ConfigError(f"{self.share} is no share", "share", "use a number above 0, up to 1")
        with require_extra("train-detector", extra="detect"):
            import torch

            from artperl.training.detector import scene_options, train_detector
        from artperl.training.detector_scenes import make_detector_scenes

        if self.threads is not None:
            torch.set_num_threads(self.threads)
        with resumable("checkpoints are kept", self.out):
            folders = self.scenes or make_detector_scenes(self.out / "scenes", self.share, cores())
            names = ("steps", "batch_size", "width", "blocks", "rate", "seed", "device")
            options = scene_options(folders, **{name: getattr(self, name) for name in names})
            detector = train_detector(options, self.out, self.workers)
        log.info(f"{detector}: {self.out / 'best'}")
