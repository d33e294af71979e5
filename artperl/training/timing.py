"""How long a run takes, from a few steps of each of its stages; and how many steps fill a time."""

import json
import time
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import asdict, replace
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from artperl.training.options import LENGTHS, TrainOptions, scaled
from artperl.training.run import Training
from artperl.training.stages import stages_of
from artsim.common.files import read_json, write_atomic
from artsim.errors import ConfigError

_SHARE, _LEAST, _MOST = 25, 6, 40
"""Steps that a stage is timed by: of so many one, but between these bounds."""
_WARM_UP = 6
"""Of so many of them the first one is left out: it is slower, since memory is new."""
_MAX_BYTES = 1_000_000


def seconds_per_step(options: TrainOptions) -> dict[str, float]:
    """Processor seconds of a step of each stage, all in this process, by the group of figures that it reports."""
    few = {name: min(n, max(_LEAST, min(_MOST, n // _SHARE))) for name in LENGTHS if (n := getattr(options, name))}
    brief: TrainOptions = replace(
        options, **few, validate_every=max(few.values(), default=1), test_objects=1, validation_views=1, patience=0,
        box_residual=inf,
    )  # fmt: skip
    taken, last = defaultdict(list), 0.0
    timed = {group for stage in stages_of(brief) for group in stage.lengths}

    def report(group: str, figures: dict[str, float], step: int) -> None:
        nonlocal last
        if group not in timed:  # a test between steps is part of the next step
            return
        now = time.process_time()
        taken[group].append(now - last)
        last = now

    with TemporaryDirectory() as folder:
        context = Training(brief, Path(folder), workers=0, progress=False).context
        context.report = report
        for stage in stages_of(brief):
            if stage.lengths:
                last = time.process_time()
                stage.run(context)
    steady = {group: steps[len(steps) // _WARM_UP :] for group, steps in taken.items()}
    return {group: sum(steps) / len(steps) for group, steps in steady.items()}


def expected_seconds(options: TrainOptions, per_step: Mapping[str, float]) -> float:
    """Processor seconds of a run whose steps take so long."""
    lengths = {group: name for stage in stages_of(options) for group, name in stage.lengths.items()}
    return sum(seconds * getattr(options, lengths[group]) for group, seconds in per_step.items())


def filling(options: TrainOptions, minutes: float, kept: Path) -> TrainOptions:
    """The same run, with all stages longer or shorter by one factor, so that it takes so many minutes of one core.

    Parameters
    ----------
    options : TrainOptions
    minutes : float
    kept : Path
        File of the lengths. They are measured once: those that it holds for the same options and minutes are taken.

    Raises
    ------
    ConfigError
        When the file holds lengths of another run.
    """
    asked, names = (
        json.loads(json.dumps({"options": asdict(options), "minutes": minutes})),
        {*LENGTHS, "validate_every"},
    )
    if kept.is_file():
        told = read_json(kept, "the lengths of the run", ConfigError, _MAX_BYTES)
        known = told.get("lengths") if isinstance(told, dict) and told.get("asked") == asked else None
        if not isinstance(known, dict) or known.keys() != names or not all(type(n) is int for n in known.values()):
            raise ConfigError("it holds lengths of another run", kept, "name another --out, or remove it")
        return replace(options, **known)
    per_step = seconds_per_step(options)
    made = scaled(options, 60.0 * minutes / expected_seconds(options, per_step))
    lengths: dict[str, Any] = {name: getattr(made, name) for name in sorted(names)}
    told = {"asked": asked, "seconds_per_step": per_step, "lengths": lengths}
    write_atomic(kept, (json.dumps(told, indent=1) + "\n").encode())
    return made


def trained_minutes(training: Training) -> float:
    """Processor minutes that the stages of a run have learnt for, without validation, calibration and test."""
    seconds, stages = training.context.state.seconds, stages_of(training.context.options)
    return sum(seconds.get(stage.name, 0.0) for stage in stages if stage.lengths) / 60.0
