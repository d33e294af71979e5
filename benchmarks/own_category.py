"""A category of one's own from 20 files: ``python -m benchmarks.own_category``.

Real objects of the dev half of PartNet-Mobility, 20 of two folders of furniture, are learnt as one category, as
``artperl train --objects FOLDER --name furniture`` does: 12 of them are learnt from, 4 choose the best estimator, and
4 test it. Rows, on the same views of these 4:

- *generic*: the estimator that comes with the package, which has seen no real object;
- *from generic*: what the command makes, which starts from it;
- *from random*: the same without that start.

The last line is one JSON object, with minutes of one processor core.
"""

import json
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import tyro

from artperl.evaluation.samples import TEST_SEEDS
from artperl.evaluation.scoring import evaluate
from artperl.evaluation.tables import summary
from artperl.methods.estimator_files import load_estimator
from artperl.training.options import changed, preset_of
from artperl.training.run import Training
from artperl.training.validation import unseen_samples
from artsim.checks.realism import read_split
from artsim.errors import ConfigError


@dataclass(frozen=True)
class Options:
    """Which objects, and where the runs are."""

    folders: tuple[str, ...] = ("StorageFurniture", "Table")
    """Of PartNet-Mobility."""
    objects: int = 20
    out: Path = Path("out/own_category")


def link_objects(options: Options) -> Path:
    """A folder with links to the first objects of the dev half."""
    folder = os.environ.get("ARTSIM_PARTNET_DIR")
    if folder is None:
        raise ConfigError("no folder of real objects is named", "partnet", "set ARTSIM_PARTNET_DIR")
    split = read_split(Path(__file__).parent / "splits" / "partnet_dev.json")
    names = [f"{category}/{name}" for category in options.folders for name in split[category]["dev"]]
    made = options.out / "objects"
    made.mkdir(parents=True, exist_ok=True)
    for name in names[: options.objects]:
        link = made / name.replace("/", "-")
        if not link.is_symlink():
            link.symlink_to(Path(folder, name).absolute())
    return made


def row(figures: dict[str, Any], minutes: float) -> dict[str, float]:
    """What the table shows of the one category of a summary, per cent."""
    (own,) = figures.values()
    shares = {
        "right": own["right"], "parts found": own["parts_found"], "points right": own["segmentation"],
        "failures": own["failures"] / own["instances"], "IoU of the root": own["parts"][0]["iou_exact"]["mean"],
    }  # fmt: skip
    return {name: round(100.0 * share, 1) for name, share in shares.items()} | {"minutes": round(minutes, 1)}


def main(options: Options) -> None:
    """Measure and print."""
    told = {"objects": [str(link_objects(options))], "name": "furniture", "categories": []}
    own = changed(preset_of("full", "own"), told)
    result, samples = dict[str, dict[str, float]](), []
    for start in ("generic", None):
        training = Training(replace(own, start_from=start), options.out / f"from_{start or 'random'}", workers=0)
        figures = training.run()
        result[f"from {start or 'random'}"] = row(figures, sum(training.context.state.seconds.values()) / 60.0)
        samples = unseen_samples(training.context, own.test_views, TEST_SEEDS)
    result["generic"] = row(summary(evaluate(load_estimator("generic"), samples, True)), 0.0)
    print(f"{'':14s}" + "".join(f"{name:>17s}" for name in result["generic"]))
    for name in ("generic", "from generic", "from random"):
        print(f"{name:14s}" + "".join(f"{value:17g}" for value in result[name].values()))
    print(json.dumps({"objects": options.objects, "steps": own.perception_steps, "views": len(samples), **result}))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
