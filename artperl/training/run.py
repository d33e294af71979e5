"""Training and testing in one loop.

Stage 1 teaches perception by what is true of fresh procedural objects; stage 2 teaches the agent by behaviour cloning
and PPO (Algorithm 1) on fitting problems whose points carry the labels that perception gives them; stage 3 teaches
where boxes end, from the whole estimator's own estimates. At intervals the whole estimator is tested on a frozen set of
unseen objects, and the best is kept.

A run depends on its options alone. Batches, rollouts and learning rates are functions of their number, so that a
stopped run goes on exactly as if it had not been stopped: only weights, the optimiser's moments and the number of
steps taken have to be kept.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

from artsim.common.extras import needs

with needs("training"):
    import torch
    from torch import Tensor, nn
    from torch.utils.tensorboard import SummaryWriter

from artperl.agent.decision_process import Fitting
from artperl.agent.policy import Agent
from artperl.agent.ppo import algorithm_1
from artperl.boxes.network import Boxes
from artperl.core.pose import Theta
from artperl.data.batches import SENSOR, batches
from artperl.data.categories import arranged, objects_of
from artperl.data.fitting_problems import Problems
from artperl.data.sources import Recorded, Source, samples_from
from artperl.estimator import load_estimator, read_settings, save_estimator
from artperl.evaluation.artimage import real_train_objects
from artperl.evaluation.scoring import (
    NUM_POINTS,
    TEST_SEEDS,
    VALIDATION_SEEDS,
    calibrate,
    evaluate,
    frozen_samples,
    headline,
    mean_iou,
    mistake,
    retry_residual,
    samples_of,
    summary,
    table,
)
from artperl.fitting.search import EstimatorOptions
from artperl.methods.full import Estimator
from artperl.perception.network import Perception
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.shape_base import ShapeBase
from artperl.training.boxes import learn, record
from artperl.training.options import TrainOptions
from artperl.training.perception_losses import perception_figures, perception_losses
from artperl.training.report import rounded, scalars, write_report, write_scalars
from artperl.training.run_folder import RunFolder, differences
from artperl.training.steps import Stop, autocast, one_cycle, set_rate
from artsim.common.files import write_atomic
from artsim.common.progress import say, track
from artsim.datasets.plan import SampleOptions
from artsim.errors import ArtsimError, ConfigError, DatasetError
from artsim.families import FAMILIES
from artsim.loading.sources import find_sources
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample

BASE_SEEDS = 2_000_000
"""Seed of the first object of a base: neither in streams nor in test sets."""
_NOISY_EVERY = 4
"""Views of stage 3 of which one is seen by a sensor: boxes go by outermost points, which suffer most."""
_VIEWS = 8
"""Episodes of a rollout that fit the same object: most of the time goes into making objects."""
_AS_GOOD = 1.01
"""Of two estimators whose scores differ by less, the one that learnt longer is kept."""
_SAVE_STEPS, _SAVE_ROLLOUTS = 100, 10
"""Steps and rollouts after which a run is written down, for when it is not asked before it ends."""


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

    Raises
    ------
    DatasetError
        When the folder holds a run with other options, or a damaged one, or another process is training there.
    """

    def __init__(self, options: TrainOptions, out: Path, workers: int = 1, progress: bool = True):
        self.options, self.out, self.workers, self.progress = options, out, workers, progress
        self.folder, self._known = RunFolder(out), ""
        if options.dataset is not None and (options.real or options.files):
            raise ConfigError("a dataset is not mixed with other objects", "dataset", "generate one with them in it")
        self.procedural = objects_of(
            options.categories, options.base_objects, BASE_SEEDS, options.parts, options.max_parts
        )
        self.given = _given(options)
        self.base = self._base_of([*self.procedural, *self.given])
        if options.dataset is not None:  # what is wrong with it is told before anything is learnt
            rows, denser = self.base.shapes.trees.num_rows, options.denser if options.dense_steps else 1
            points = options.num_points * denser
            Recorded(options.dataset, options.categories, options.seed, rows, points, options.parts)
        self.device = _device(options.device)
        torch.manual_seed(options.seed)
        self.perception = Perception(self.base.shapes.trees.num_rows, options.width, options.votes).to(self.device)
        self.agent, self._agent_known = Agent().to(self.device), False
        self.boxes: Boxes | None = None
        if options.start_from is not None:
            self._take_over(load_estimator(options.start_from))
        self.optimizers = {
            "perception": torch.optim.AdamW(self.perception.parameters(), weight_decay=1e-2),
            "agent": torch.optim.AdamW(self.agent.parameters(), weight_decay=1e-4),
        }
        self.done = {"perception": 0, "agent": 0, "boxes": 0}
        self.best = float("inf")
        self.history: list[dict[str, Any]] = []
        self._validation: list[Sample] = []
        if self.folder.begun:
            with self.folder.held():
                self._load()

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
        """
        with self.folder.held():
            if self.folder.begun:  # another process may have trained here meanwhile
                self._load()
            with self.folder.curves() as board, Stop() as stop:
                self._learn_to_perceive(board, stop)
                self._learn_to_fit(board, stop)
                if not self.history:  # nothing was learnt: what is known is calibrated
                    self._validate(board, 0)
                self._learn_boxes(board, stop)
            return self._finish()

    def estimator(self) -> Estimator:
        """The estimator as it stands."""
        agent = self.agent if self.done["agent"] or self._agent_known else None
        options = EstimatorOptions(num_points=self.options.denser * self.options.num_points)
        return Estimator(self.perception, self.base, agent, options, boxes=self.boxes)

    @property
    def _mixed(self) -> bool:
        """Whether there are both procedural objects and given ones."""
        return bool(self.procedural and self.given)

    @property
    def _noisy_boxes(self) -> bool:
        """Whether boxes learn from some views by a sensor: those of a run with a sensor of its own do so anyway."""
        return self.options.dataset is None and self.options.sample.noise == "none"

    def _base_of(self, objects: list[ArticulatedObject]) -> ShapeBase:
        options = self.options
        rows = options.max_parts if options.files else None
        return by_boxes(ShapeBase.of(objects, options.reference_points, rows))

    def _take_over(self, estimator: Estimator) -> None:
        """Begin with the networks of another estimator."""
        theirs, own = estimator.perception, self.perception
        if (theirs.num_rows, theirs.width) != (own.num_rows, own.width):
            raise ConfigError(
                "networks of another size are to be learnt on", str(self.options.start_from),
                "use the same categories and preset",
            )  # fmt: skip
        alike = theirs.votes == own.votes  # votes need a head of their own
        fits = {name: t for name, t in theirs.state_dict().items() if t.shape == own.state_dict()[name].shape}
        own.load_state_dict(fits, strict=alike)
        if estimator.agent is not None:
            self.agent.load_state_dict(estimator.agent.state_dict())
            self._agent_known = True
        self.boxes = estimator.boxes if alike else None  # which learnt from what the other head says

    def _learn_to_perceive(self, board: SummaryWriter, stop: Stop) -> None:
        options = self.options
        steps, points, clouds = options.perception_steps, options.num_points, options.batch_size
        self._perceive(0, steps, points, clouds, options.seed, board, stop)
        points, clouds = points * options.denser, max(1, clouds // options.denser)
        self._perceive(steps, options.dense_steps, points, clouds, options.seed + 3, board, stop)

    def _perceive(
        self, before: int, total: int, num_points: int, batch_size: int, seed: int, board: SummaryWriter, stop: Stop
    ) -> None:
        """So many steps after those before, with their own cycle of the rate."""
        options, optimizer = self.options, self.optimizers["perception"]
        first = self.done["perception"] - before
        if first >= total:
            return
        data = batches(
            options.categories, self.perception.num_rows, num_points, batch_size, first, seed, self.workers,
            options.sample, options.parts, self.given, options.dataset, options.stretched, options.noisy,
        )  # fmt: skip
        bar = track("perception", total=total, initial=first, smoothing=0.02, shown=self.progress)
        for step in range(first, total):
            clouds, truth = next(data)
            clouds, truth = clouds.to(self.device), truth.to(self.device)
            set_rate(optimizer, options.perception_rate * one_cycle(step, total))
            self.perception.train()
            with autocast(self.device, options.mixed_precision):
                perceived = self.perception(clouds.points)
            losses = perception_losses(perceived, truth)
            loss = torch.stack(list(losses.values())).sum()
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(self.perception.parameters(), 1.0)
            optimizer.step()
            done = self.done["perception"] = before + step + 1
            figures = {name: value.item() for name, value in losses.items()}
            figures |= perception_figures(perceived, truth)
            write_scalars(board, "perception", figures, done - 1)
            bar.set_postfix_str(f"parts {100 * figures['accuracy']:.1f} %, off {100 * figures['coordinates']:.1f} %")
            bar.update()
            if (step + 1) % options.validate_every == 0 or step + 1 == total:
                self._validate(board, done)
            elif (step + 1) % _SAVE_STEPS == 0:
                self._save()
            self._stop_if(stop)
        bar.close()

    def _learn_to_fit(self, board: SummaryWriter, stop: Stop) -> None:
        options, optimizer = self.options, self.optimizers["agent"]
        first, total = self.done["agent"], options.agent_rollouts
        if first >= total:
            return
        problems = Problems(
            options.categories, self.base, options.episodes, options.num_points, options.seed + 1, options.start,
            options.sample, perception=self.perception if options.labels == "perceived" else None, parts=options.parts,
            given=self.given, views_per_object=_VIEWS, references=options.references,
            dataset=options.dataset,
        )  # fmt: skip
        bar = track("agent", total=total, initial=first, smoothing=0.1, shown=self.progress)

        def episodes(n: int) -> tuple[Fitting, Theta]:
            set_rate(optimizer, options.agent_rate * one_cycle(n, total))
            problem = problems[n].to(self.device)
            return Fitting(problem.shapes, problem.observed, problem.start, options.fitting), problem.goal

        rounds = algorithm_1(
            self.agent, optimizer, episodes, options.phase, options.ppo, options.seed, first, total
        )  # fmt: skip
        for n in range(first, total):
            with autocast(self.device, options.mixed_precision):
                figures = next(rounds)
            self.done["agent"] = n + 1
            write_scalars(board, "agent", figures, n)
            bar.set_postfix_str(f"reward {figures['reward']:.3f}, chamfer {figures['chamfer_end']:.3f}")
            bar.update()
            if (n + 1) % options.validate_rollouts == 0 or n + 1 == total:
                self._validate(board, self.done["perception"] + n + 1)
            elif (n + 1) % _SAVE_ROLLOUTS == 0:
                self._save()
            self._stop_if(stop)
        bar.close()

    def _learn_boxes(self, board: SummaryWriter, stop: Stop) -> None:
        """The last stage: the best estimator's boxes learn from its own estimates, and stay if they are better so."""
        options = self.options
        if self.done["boxes"] >= options.box_views:
            return
        best = learner = self._best(self.device)
        if self._mixed:  # a given object is its own best reference, as none will be in use
            learner = replace(best, base=self._base_of(self.procedural))
        file = self.out / "boxes.safetensors"
        records = record(learner, self._box_samples(), options.box_views, file, stop, self.workers, self.progress)
        learnt = None
        if records is not None:
            rows, width = self.perception.num_rows, options.box_width
            learnt = learn(records, rows, width, options.box_steps, options.seed, self.progress)
        self._stop_if(stop)
        self.done["boxes"] = options.box_views
        if learnt is None:
            say("boxes: no estimate fits its view; they stay as they are")
        else:
            self._choose_boxes(best, learner, learnt.half().float(), board)  # as precise as files are
        self._save()

    def _best(self, device: torch.device | str = "cpu") -> Estimator:
        """The best estimator so far.

        Raises
        ------
        DatasetError
            When its files are damaged or missing.
        """
        try:
            return load_estimator(self.out / "best", device)
        except DatasetError as error:
            raise DatasetError(f"the best estimator is lost ({error.what})", error.where, self.folder.fix) from error

    def _box_samples(self) -> Callable[[int], Sample]:
        """Fresh views by number."""
        options = self.options
        sample = replace(options.sample, num_points=options.num_points if options.dataset else NUM_POINTS)

        def source(sample: SampleOptions) -> Source:
            return samples_from(
                options.dataset, options.categories, sample, options.seed + 2, 2, self.perception.num_rows,
                options.parts, self.given,
            )  # fmt: skip

        clean = source(sample)
        if not self._noisy_boxes:
            return clean.__getitem__
        noisy = source(replace(sample, noise=SENSOR))
        return partial(_mostly_clean, clean, noisy)

    def _choose_boxes(self, best: Estimator, learner: Estimator, boxes: Boxes, board: SummaryWriter) -> None:
        """Give the best estimator other boxes if the learner's are better so on unseen objects, and on given ones."""
        views = self.options.validation_views
        validation = self._unseen(views, VALIDATION_SEEDS, self._as_tested)
        if self._mixed:
            validation += self._of_given(len(validation), VALIDATION_SEEDS, self._as_tested)
        noisy = []
        if self._noisy_boxes:
            with_noise = replace(self._as_tested, noise=SENSOR)
            noisy = self._unseen(-(-views // _NOISY_EVERY), VALIDATION_SEEDS, with_noise)
        before, after = (
            evaluate(estimator, validation + noisy, self.progress)
            for estimator in (learner, replace(learner, boxes=boxes))
        )
        figures = summary(after[: len(validation)])
        if mean_iou(after) > mean_iou(before):
            save_estimator(replace(best, boxes=boxes), self.out / "best", self._about({"validation": figures}))
        write_scalars(board, "validation", scalars(figures), sum(self.done.values()))
        say(f"boxes: mean IoU {100 * mean_iou(before):.1f} -> {100 * mean_iou(after):.1f} %")

    def _stop_if(self, stop: Stop) -> None:
        if stop.asked:
            self._save()
            raise KeyboardInterrupt

    def _validate(self, board: SummaryWriter, step: int) -> None:
        """Score the estimator on a frozen set of unseen objects, keep the best, and write down where the run stands."""
        if not self._validation:
            self._validation = self._unseen(self.options.validation_views, VALIDATION_SEEDS, self._as_tested)
        scored = evaluate(self.estimator(), self._validation, self.progress)
        figures, score = summary(scored), headline(scored)
        self.history.append({"step": step, "score": score, "done": dict(self.done)})
        write_scalars(board, "validation", scalars(figures) | {"score": score}, step)
        if score < _AS_GOOD * self.best:
            self.best = min(score, self.best)
            judge = evaluate if self.options.votes else mistake  # any parts are right if they are where they are
            foreign = judge(self.estimator(), self._foreign())
            best = replace(self.estimator(), calibration=calibrate(scored, foreign))
            best.options = replace(best.options, retry_residual=retry_residual(scored))
            save_estimator(best, self.out / "best", self._about({"validation": figures}))
        self._save()
        say(f"after {self.done}: score {score:.2f}\n{table(figures)}")

    def _foreign(self) -> list[Sample]:
        """Objects of other categories, by which confidence is calibrated, too."""
        others = [category for category in FAMILIES if category not in self.base.categories]
        return frozen_samples(others[: self.options.foreign_categories], 2, 1, None, VALIDATION_SEEDS, "any")

    @property
    def _as_tested(self) -> SampleOptions:
        return replace(self.options.sample, num_points=NUM_POINTS)

    def _unseen(self, views: int, first_seed: int, sample: SampleOptions) -> list[Sample]:
        options = self.options
        if not options.categories:
            return self._of_given(options.test_objects * views, first_seed, sample)
        return frozen_samples(
            options.categories, options.test_objects, views, sample, first_seed, options.parts, options.max_parts
        )

    def _of_given(self, views: int, first_seed: int, sample: SampleOptions) -> list[Sample]:
        """At least so many views of given objects, of each as many."""
        return samples_of(self.given, -(-views // len(self.given)), sample, first_seed)

    def _finish(self) -> dict[str, Any]:
        """Test the best estimator on objects that had no say in which one that is."""
        best = self._best()
        samples = self._unseen(self.options.test_views, TEST_SEEDS, self._as_tested)
        scored = evaluate(best, samples, self.progress)
        figures = summary(scored)
        about = read_settings(self.out / "best")["about"]
        told = {name: about[name] for name in ("options", "done")}  # not how validation went: it chose this one
        save_estimator(best, self.out / "best", {**told, "test": rounded(figures)})
        write_atomic(self.out / "figures.json", (json.dumps(figures, indent=1) + "\n").encode())
        write_atomic(self.out / "table.txt", (table(figures) + "\n").encode())
        try:
            write_report(self.out, best, samples, scored, table(figures))
        except ArtsimError as error:  # without matplotlib there are no pictures
            say(f"no report: {error}")
        return figures

    def _about(self, figures: dict[str, Any]) -> dict[str, Any]:
        return {"options": asdict(self.options), "done": dict(self.done), **rounded(figures)}

    def _save(self) -> None:
        """Everything that going on needs."""
        tensors: dict[str, Tensor] = {"done": torch.tensor(list(self.done.values()))}
        for name, network in (("perception", self.perception), ("agent", self.agent)):
            tensors |= {f"{name}.{key}": value for key, value in network.state_dict().items()}
            for number, moments in self.optimizers[name].state_dict()["state"].items():
                tensors |= {f"{name}/{number}/{key}": value for key, value in moments.items()}
        state = {"options": asdict(self.options), "best": self.best, "history": self.history}
        self._known = self.folder.write(state, tensors)

    def _load(self) -> None:
        state, tensors, digest = self.folder.read()
        if digest and digest == self._known:
            return
        # An option that was not known yet when the run was begun has its default.
        begun_with = completed(json.loads(json.dumps(asdict(TrainOptions()))), state["options"])
        changed = differences(begun_with, json.loads(json.dumps(asdict(self.options))))
        if changed:
            raise DatasetError(
                f"a run with other options is here: {changed}", self.out, "give the same options, or another --out"
            )
        try:
            self._take_up(state, tensors)
        except (AttributeError, KeyError, TypeError, ValueError, RuntimeError) as error:
            raise DatasetError(
                f"the state of the run does not fit this version ({error})", self.out, self.folder.fix
            ) from error
        self._known = digest

    def _take_up(self, state: dict[str, Any], tensors: dict[str, Tensor]) -> None:
        """Go on from what was written down."""
        self.best, self.history = float(state["best"]), list(state["history"])
        self.done |= dict(zip(self.done, tensors["done"].tolist(), strict=False))  # older runs had fewer stages
        for name, network in (("perception", self.perception), ("agent", self.agent)):
            own = {k.removeprefix(f"{name}."): v for k, v in tensors.items() if k.startswith(f"{name}.")}
            network.load_state_dict(own)
            moments: dict[int, dict[str, Tensor]] = {}
            for key, value in tensors.items():
                if key.startswith(f"{name}/"):
                    _, number, moment = key.split("/")
                    moments.setdefault(int(number), {})[moment] = value
            optimizer = self.optimizers[name]
            optimizer.load_state_dict({**optimizer.state_dict(), "state": moments})


def _mostly_clean(clean: Source, noisy: Source, number: int) -> Sample:
    return (noisy if number % _NOISY_EVERY == _NOISY_EVERY - 1 else clean)[number]


def _given(options: TrainOptions) -> list[ArticulatedObject]:
    """Objects to learn from that are not of procedural families.

    Raises
    ------
    ConfigError
        When one has too many parts.
    """
    if options.real:
        return real_train_objects(options.categories)
    roots = {name: Path(folder) for name, folder in options.package_roots}
    objects = [arranged(source.load(), options.parts) for source in find_sources(options.files, roots)]
    for obj in objects:
        if options.max_parts is not None and len(obj) > options.max_parts:
            raise ConfigError(
                f"{obj.object_id} has {len(obj)} parts, more than {options.max_parts}", obj.source,
                "use another preset, or lock joints",
            )  # fmt: skip
    return objects


def completed(defaults: dict[str, Any], known: dict[str, Any]) -> dict[str, Any]:
    """What is known, with defaults for all else, at every depth."""
    return defaults | {
        name: completed(defaults[name], value)
        if isinstance(value, dict) and isinstance(defaults.get(name), dict)
        else value
        for name, value in known.items()
    }


def _device(name: str) -> torch.device:
    device = torch.device(name)
    if device.type == "cuda" and not torch.cuda.is_available():
        raise ConfigError("torch finds no GPU here", "device", "use --device cpu, or a build of torch with CUDA")
    return device
