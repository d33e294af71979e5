"""What ``python -m benchmarks.compare`` measures: each name, and the ``module:function`` that prepares it.

The functions run against two checkouts of the project, of which one may be older: they import nothing of
``benchmarks``, and nothing of artsim or artperl before they are called. Each prepares its work in a folder of its own,
and gives a function that does the work once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal


@dataclass(frozen=True)
class Work:
    """What a piece of work was.

    Attributes
    ----------
    count : int
        How many things were done: clouds, samples, objects.
    digest : callable
        Digest of the result, where two revisions have to give the same bytes; "" where there is none.
    facts : dict
        Figures of the result that two revisions may differ in, such as errors.
    """

    count: int
    digest: Callable[[], str] = lambda: ""
    facts: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Measure:
    """One line of the comparison.

    Attributes
    ----------
    what : str
        What is counted.
    prepare : str
        ``module:function`` of this package. The function takes a folder and ``arguments``.
    arguments : tuple
    clock : {"processor", "wall"}
        Processor time, that of child processes included, is little disturbed by other programs. Wall time shows what
        several processes gain.
    """

    what: str
    prepare: str
    arguments: tuple[str | int, ...] = ()
    clock: Literal["processor", "wall"] = "processor"


MEASURES: dict[str, Measure] = {
    "clouds": Measure("clouds of 2,048 points, 40 objects x 4 views", "generation:clouds", ("none",)),
    "noise-kinect_v1": Measure("clouds with noise of kinect_v1", "generation:clouds", ("kinect_v1",)),
    "noise-d435": Measure("clouds with noise of d435", "generation:clouds", ("d435",)),
    "noise-azure": Measure("clouds with noise of azure", "generation:clouds", ("azure",)),
    "noise-gaussian3mm": Measure("clouds with noise of gaussian3mm", "generation:clouds", ("gaussian3mm",)),
    "parts-16": Measure("clouds of objects of 16 parts, many small", "generation:many_parts", (16,)),
    "parts-64": Measure("clouds of objects of 64 parts, many small", "generation:many_parts", (64,)),
    "images": Measure("samples with depth and part mask, 640x480", "generation:images"),
    "end-to-end": Measure("3,000 samples onto disk, one worker, start-up included", "generation:end_to_end", (1,)),
    "end-to-end-long": Measure("20,000 samples, the same", "generation:end_to_end", (1, 20_000)),
    "end-to-end-2": Measure("the same, two workers", "generation:end_to_end", (2,), "wall"),
    "verify": Measure("2,000 samples verified", "reading:verified", (1,)),
    "verify-2": Measure("the same, two processes", "reading:verified", (2,), "wall"),
    "verify-2-long": Measure("10,000 samples verified, two processes", "reading:verified", (2, 10_000), "wall"),
    "reads-10": Measure("samples read in shuffled order, 10 shards", "reading:shuffled", (10,)),
    "reads-100": Measure("samples read in shuffled order, 100 shards", "reading:shuffled", (100,)),
    "reads-1000": Measure("samples read in shuffled order, 1,000 shards", "reading:shuffled", (1000,)),
    "load": Measure("real objects loaded (demo objects without ARTSIM_PARTNET_DIR)", "reading:loaded"),
    "import": Measure("import artsim", "programs:started", ("import artsim",)),
    "artsim-help": Measure("artsim --help", "programs:command", ("artsim", "--help")),
    "generate-help": Measure("artsim generate --help", "programs:command", ("artsim", "generate", "--help")),
    "artperl-help": Measure("artperl --help", "programs:command", ("artperl", "--help")),
    "estimate-cold": Measure("artperl estimate of one PLY file, start-up included", "programs:cold_estimate"),
    **{
        f"estimates-{category}": Measure(f"estimates of {category}", "estimates:estimates", (category, 1024))
        for category in ("laptop", "eyeglasses", "dishwasher", "scissors", "drawer")
    },
    **{
        f"dense-{category}": Measure(f"estimates of {category}, 8,192 points", "estimates:estimates", (category, 8192))
        for category in ("laptop", "eyeglasses", "dishwasher", "scissors", "drawer")
    },
    "estimates-512": Measure("estimates of laptops from 512 points", "estimates:estimates", ("laptop", 512)),
    "estimates-any-8": Measure("estimates by `any` of objects of 8 parts", "estimates:any_of_parts", (8,)),
    "environment": Measure("steps of the fitting environment", "environment:steps"),
    "stable-baselines": Measure("steps that PPO of Stable-Baselines3 learns from", "environment:learnt_from"),
}
