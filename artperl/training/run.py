"""Training and testing in one loop: the stages of a run, one after the other.

A run depends on its options alone. Batches, rollouts and learning rates are functions of their number, so that a
stopped run goes on exactly as if it had not been stopped: only the :class:`~artperl.training.state.RunState` is kept.
"""

from pathlib import Path
from typing import Any, cast

from artsim.common.extras import require_extra

with require_extra("training"):
    import torch
    from torch import nn

from artperl.core.distributed import Ranks, several_started
from artperl.methods import StoredMethod
from artperl.methods.estimator_files import load_estimator
from artperl.methods.full import Estimator
from artperl.methods.protocol import Stored
from artperl.perception.network import Perception
from artperl.training.context import Context, Report
from artperl.training.objects import TrainingObjects
from artperl.training.options import TrainOptions
from artperl.training.recipes import Recipe, provenance
from artperl.training.report import write_scalars
from artperl.training.run_folder import RunFolder
from artperl.training.stages import PROGRAMMES, stages_of
from artperl.training.state import RunState
from artperl.training.validation import test
from artsim.errors import ConfigError

_WEIGHT_DECAY, _PERCEPTION_DECAY = 1e-4, 1e-2
"""Of AdamW. Perception is the largest network and the one that has to generalise from families to real objects."""


_SHARED: tuple[StoredMethod, ...] = ("full", "artperl")
"""Methods that several processes can learn together."""


class Training:
    """A run that may be stopped and gone on with.

    Parameters
    ----------
    options : TrainOptions
    out : Path
        Folder of the run: ``best`` holds the estimator, ``state.*`` and ``boxes.safetensors`` what is needed to go on,
        ``events`` curves for TensorBoard, ``table.txt`` and ``figures.json`` the last test.
    workers : int
        Processes that make training clouds, and estimates that boxes learn from; the result does not depend on it.
    progress : bool
        Show a bar, and tables as they come.
    report : Report, optional
        Hears the figures of every step, as the curves do.
    recipe : Recipe, optional
        The recipe that the options are of.
    device : str
        Where the networks learn: "cpu", "cuda". Estimates are made on the processor, which is faster at them. A run may
        go on elsewhere than where it was begun; its result is the same up to the rounding of the devices.

    Raises
    ------
    DatasetError
        When the folder holds a run with other options, or a damaged one, or another process is training there.
    """

    def __init__(
        self, options: TrainOptions, out: Path, workers: int = 1, progress: bool = True, report: Report | None = None,
        recipe: Recipe | None = None, device: str = "cpu",
    ):  # fmt: skip
        self.out, self._report = out, report
        objects, programme = TrainingObjects.of(options), PROGRAMMES[options.method]
        programme.check(objects)
        if options.method not in _SHARED and several_started():
            raise ConfigError(
                f"the method {options.method} learns in one process", "torchrun", "start it without torchrun"
            )
        ranks, own = Ranks.started(device)
        torch.manual_seed(options.seed)
        networks = programme.networks(options, objects.num_rows)
        start = options.start_from
        method: str = options.method
        parent = None if start is None else cast("Estimator | Stored", load_estimator(start, method, own))
        if parent is not None:
            _start_from(parent, networks, str(start))
        optimizers: dict[str, torch.optim.Optimizer] = {
            name: torch.optim.AdamW(
                network.to(own).parameters(),
                weight_decay=_PERCEPTION_DECAY if name == "perception" else _WEIGHT_DECAY,
            )
            for name, network in networks.items()
        }
        self.context = Context(
            options, RunFolder(out), objects, RunState(networks, optimizers), parent, programme.estimator, own,
            workers, progress and ranks.first, provenance(options, recipe), _no_report, ranks,
        )  # fmt: skip
        if self.context.folder.begun and ranks.first:
            with self.context.folder.held():
                self.context.state.load(self.context.folder, options)

    def run(self) -> dict[str, Any]:
        """Train to the end and return the figures of the best estimator.

        Raises
        ------
        KeyboardInterrupt
            After Ctrl-C, once the step has come to its end and been written down. A second Ctrl-C does not wait.
        ConfigError
            When the folder cannot be written to, or the disk is full: the same call goes on from what was written.
        DatasetError
            When another process is training here.

        Of several processes, the first one alone writes, tests, and has figures.
        """
        context = self.context
        if not context.ranks.first:
            context.ranks.same(None)  # the first one holds the folder, and what it holds is sound
            context.state.load(context.folder, context.options)
            with context.stop:
                for stage in stages_of(context.options):
                    stage.run(context)
            return context.ranks.same({})
        with context.folder.held():
            context.state.load(context.folder, context.options)  # another process may have trained here meanwhile
            context.objects.given.freeze(self.out / "split.json")
            context.ranks.same(None)
            with context.folder.curves() as board, context.stop:

                def report(group: str, figures: dict[str, float], step: int) -> None:
                    write_scalars(board, group, figures, step)
                    if self._report is not None:
                        self._report(group, figures, step)

                context.report = report
                for stage in stages_of(context.options):
                    with context.counted(stage.name):
                        stage.run(context)
            return context.ranks.same(test(context))


def _no_report(group: str, figures: dict[str, float], step: int) -> None:
    """Before a run begins nobody listens."""


def _start_from(parent: Estimator | Stored, networks: dict[str, nn.Module], folder: str) -> None:
    """Begin with the weights of another estimator.

    Raises
    ------
    ConfigError
        When its networks have another size.
    """
    for name, own in networks.items():
        their = getattr(parent, name, None)
        if their is None:
            continue
        alike = True
        if isinstance(own, Perception):
            if (their.num_rows, their.width) != (own.num_rows, own.width):
                raise ConfigError(
                    "its networks have another size than this run's", folder, "use the same categories and preset"
                )
            alike = their.votes == own.votes  # votes need a head of their own
        state = own.state_dict()
        fits = {key: t for key, t in their.state_dict().items() if alike or t.shape == state[key].shape}
        own.load_state_dict(fits, strict=alike)
