"""A training run of the paper's method: its stages one after the other, then the test on unseen objects."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from artsim.common.extras import needs

with needs("training"):
    import torch
    from torch import Tensor, nn

from artperl.data.categories import objects_of
from artperl.estimator import save_estimator
from artperl.evaluation.scoring import NUM_POINTS, TEST_SEEDS, evaluate, frozen_samples, summary, table
from artperl.retrieval.shape_base import ShapeBase
from artperl.training.options import TrainOptions
from artperl.training.paper_stages import PAPER_STAGES, estimator, networks
from artperl.training.report import rounded, write_report, write_scalars
from artperl.training.run import BASE_SEEDS
from artperl.training.run_folder import RunFolder, differences
from artperl.training.steps import Stop
from artsim.common.files import write_atomic
from artsim.common.progress import say
from artsim.datasets.plan import SampleOptions
from artsim.errors import ArtsimError, DatasetError


@dataclass
class State:
    """What a stopped run goes on from."""

    networks: dict[str, nn.Module]
    optimizers: dict[str, torch.optim.Optimizer]
    done: Counter[str] = field(default_factory=Counter)


@dataclass
class Context:
    """What every stage of a run works with."""

    options: TrainOptions
    folder: RunFolder
    objects: Any
    state: State
    device: torch.device
    workers: int
    progress: bool
    report: Callable[[str, dict[str, float], int], None]
    stop: Stop

    def save(self) -> None:
        """Write where the run stands."""
        tensors: dict[str, Tensor] = {}
        for name, network in self.state.networks.items():
            tensors |= {f"{name}.{key}": value for key, value in network.state_dict().items()}
            for number, moments in self.state.optimizers[name].state_dict()["state"].items():
                tensors |= {f"{name}/{number}/{key}": value for key, value in moments.items()}
        state = {"options": asdict(self.options), "done": self.state.done, "best": 0.0, "history": []}
        self.folder.write(state, tensors)

    def load(self) -> None:
        """Take up where the run stands."""
        state, tensors, _ = self.folder.read()
        changed = differences(state["options"], json.loads(json.dumps(asdict(self.options))))
        if changed:
            raise DatasetError(
                f"a run with other options is here: {changed}", self.folder.path,
                "give the same options, or another --out",
            )  # fmt: skip
        for name, network in self.state.networks.items():
            network.load_state_dict(
                {k.removeprefix(f"{name}."): v for k, v in tensors.items() if k.startswith(f"{name}.")}
            )
            moments: dict[int, dict[str, Tensor]] = {}
            for key, value in tensors.items():
                if key.startswith(f"{name}/"):
                    _, number, moment = key.split("/")
                    moments.setdefault(int(number), {})[moment] = value
            optimizer = self.state.optimizers[name]
            optimizer.load_state_dict({**optimizer.state_dict(), "state": moments})
        self.state.done = Counter(state["done"])

    def stop_if_asked(self) -> None:
        """Write where the run stands and end it, if somebody has asked for that."""
        if self.stop.asked:
            self.save()
            raise KeyboardInterrupt


def train(options: TrainOptions, out: Path, workers: int = 1, progress: bool = True) -> dict[str, Any]:
    """Train to the end, and return the figures on unseen objects; the same call goes on where one was stopped."""
    objects = objects_of(options.categories, options.base_objects, BASE_SEEDS, options.parts, options.max_parts)
    base = ShapeBase.of(objects, options.reference_points)
    device = torch.device(options.device)
    torch.manual_seed(options.seed)
    own = {name: net.to(device) for name, net in networks(options, base.shapes.trees.num_rows).items()}
    optimizers: dict[str, torch.optim.Optimizer] = {
        name: torch.optim.AdamW(net.parameters(), weight_decay=1e-4) for name, net in own.items()
    }
    folder = RunFolder(out)
    with folder.held(), folder.curves() as board, Stop() as stop:
        context = Context(
            options, folder, SimpleNamespace(base=base, given=()), State(own, optimizers), device, workers, progress,
            lambda group, figures, step: write_scalars(board, group, figures, step), stop,
        )  # fmt: skip
        if folder.begun:
            context.load()
        for stage in PAPER_STAGES:
            stage.run(context)
        context.save()
        method = estimator(context)
        sample = SampleOptions(**{**vars(options.sample), "num_points": NUM_POINTS})
        samples = frozen_samples(
            options.categories, options.test_objects, options.test_views, sample, TEST_SEEDS, options.parts,
            options.max_parts,
        )  # fmt: skip
        scored = evaluate(method, samples, progress)
        figures = summary(scored)
        about = {"options": asdict(options), "done": dict(context.state.done), "test": rounded(figures)}
        save_estimator(method, out / "best", about)
    write_atomic(out / "figures.json", (json.dumps(figures, indent=1) + "\n").encode())
    write_atomic(out / "table.txt", (table(figures) + "\n").encode())
    try:
        write_report(out, method, samples, scored, table(figures))
    except ArtsimError as error:  # without matplotlib there are no pictures
        say(f"no report: {error}")
    return figures
