"""What every stage of a training run works with."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Protocol, cast

import torch

from artperl.core.distributed import Ranks
from artperl.methods.estimator_files import load_estimator
from artperl.methods.full import Estimator
from artperl.methods.protocol import Stored
from artperl.training.objects import TrainingObjects
from artperl.training.options import TrainOptions
from artperl.training.report import rounded
from artperl.training.run_folder import RunFolder
from artperl.training.state import RunState
from artperl.training.steps import Stop
from artsim.errors import DatasetError


class Report(Protocol):
    """Hears the figures of every step."""

    def __call__(self, group: str, figures: dict[str, float], step: int) -> None: ...


@dataclass
class Context:
    """What every stage of a run works with."""

    options: TrainOptions
    folder: RunFolder
    objects: TrainingObjects
    state: RunState
    """The stages change it in place."""
    parent: Estimator | Stored | None
    """The estimator that the run started from."""
    assemble: Callable[[Context], Estimator | Stored]
    """Makes an estimator of the networks as they stand."""
    device: torch.device
    workers: int
    """Processes that make training clouds and estimates; the result does not depend on it."""
    progress: bool
    """Show bars."""
    provenance: dict[str, Any]
    """See :func:`artperl.training.recipes.provenance`."""
    report: Report
    """Hears the figures of every step."""
    ranks: Ranks = field(default_factory=Ranks)
    """The processes that learn this run together."""
    stop: Stop = field(default_factory=Stop)
    """Whether the run is to stop after the present step."""
    _counting: str | None = None
    _since: float = 0.0

    def estimator(self) -> Estimator | Stored:
        """The estimator as it stands, on the processor. It has copies of the networks, which go on learning."""
        copies = {name: deepcopy(network).cpu() for name, network in self.state.networks.items()}
        return self.assemble(replace(self, state=replace(self.state, networks=copies), device=torch.device("cpu")))

    def best(self, device: torch.device | str = "cpu") -> Estimator | Stored:
        """The best estimator so far.

        Raises
        ------
        DatasetError
            When its files are damaged or missing.
        """
        try:
            method: str = self.options.method
            found = load_estimator(self.folder.best, method, device)
            return cast("Estimator | Stored", found)
        except DatasetError as error:
            raise DatasetError(f"the best estimator is lost ({error.what})", error.where, self.folder.fix) from error

    def about(self, figures: dict[str, Any]) -> dict[str, Any]:
        """What an estimator's file says about its training."""
        return {**self.provenance, "options": asdict(self.options), "done": dict(self.state.done), **rounded(figures)}

    @contextmanager
    def counted(self, name: str) -> Iterator[None]:
        """Count the processor time of this block for a stage, or for the validation; that of a block in it apart."""
        self._count()
        outer, self._counting = self._counting, name
        try:
            yield
        finally:
            self._count()
            self._counting = outer

    def _count(self) -> None:
        now = time.process_time()
        if self._counting is not None:
            self.state.seconds[self._counting] = self.state.seconds.get(self._counting, 0.0) + now - self._since
        self._since = now

    def save(self) -> None:
        """Write where the run stands; of several processes the first one does."""
        self._count()
        if self.ranks.first:
            self.state.save(self.folder, self.options)

    def stop_if_asked(self) -> None:
        """Write where the run stands and end it, if somebody has asked for that.

        Raises
        ------
        KeyboardInterrupt
        """
        if self.stop.asked:
            self.save()
            raise KeyboardInterrupt
