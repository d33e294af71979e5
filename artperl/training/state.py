"""Where a training run stands: weights, moments of the optimisers, steps taken, the best score and the history."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor, nn

from artperl.training.run_folder import RunFolder, differences
from artsim.errors import DatasetError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


@dataclass
class RunState:
    """All that changes while a run learns, and all that it needs to go on."""

    networks: dict[str, nn.Module]
    optimizers: dict[str, torch.optim.Optimizer]
    """One for each of the networks, by the same name."""
    done: Counter[str] = field(default_factory=Counter)
    """Steps that each stage has taken, by the stage's name."""
    best: float = float("inf")
    """Lowest validation score so far."""
    history: list[dict[str, Any]] = field(default_factory=list)
    """Every validation: its ``stage``, ``step``, ``score`` and ``done``."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Processor time of this process that each stage and the validation have taken, by name. Nothing depends on it."""
    _digest: str = ""

    @property
    def step(self) -> int:
        """Steps of all stages together."""
        return sum(self.done.values())

    def save(self, folder: RunFolder, options: DataclassInstance) -> None:
        """Write the state; a process that is killed meanwhile leaves the state before or after.

        Raises
        ------
        ConfigError
            When the folder cannot be written to.
        """
        tensors: dict[str, Tensor] = {}
        for name, network in self.networks.items():
            tensors |= {f"{name}.{key}": value for key, value in network.state_dict().items()}
            for number, moments in self.optimizers[name].state_dict()["state"].items():
                tensors |= {f"{name}/{number}/{key}": value for key, value in moments.items()}
        state = {"options": asdict(options), "done": self.done, "best": self.best, "history": self.history}
        self._digest = folder.write(state, tensors)
        folder.write_seconds(self.seconds)

    def load(self, folder: RunFolder, options: DataclassInstance) -> None:
        """Take up the state that a folder holds, if there is one; only while the folder is held.

        Raises
        ------
        DatasetError
            When it is damaged, or belongs to a run with other options.
        """
        if not folder.begun:
            return
        state, tensors, digest = folder.read()
        if digest == self._digest:
            return
        changed = differences(state["options"], json.loads(json.dumps(asdict(options))))
        if changed:
            raise DatasetError(
                f"a run with other options is here: {changed}", folder.path, "give the same options, or another --out"
            )
        try:
            self._restore(state, tensors)
        except (AttributeError, KeyError, TypeError, ValueError, RuntimeError) as error:
            raise DatasetError(
                f"the state of the run does not fit this version ({error})", folder.path, folder.fix
            ) from error
        self._digest = digest
        self.seconds = folder.read_seconds()

    def _restore(self, state: Mapping[str, Any], tensors: Mapping[str, Tensor]) -> None:
        for name, network in self.networks.items():
            network.load_state_dict(
                {k.removeprefix(f"{name}."): v for k, v in tensors.items() if k.startswith(f"{name}.")}
            )
            moments: dict[int, dict[str, Tensor]] = {}
            for key, value in tensors.items():
                if key.startswith(f"{name}/"):
                    _, number, moment = key.split("/")
                    moments.setdefault(int(number), {})[moment] = value
            optimizer = self.optimizers[name]
            optimizer.load_state_dict({**optimizer.state_dict(), "state": moments})
        self.done = Counter({str(name): int(steps) for name, steps in state["done"].items()})
        self.best, self.history = float(state["best"]), list(state["history"])
