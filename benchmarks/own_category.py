"""A category of one's own from 20 files: ``python -m benchmarks.own_category``.

Real objects of the dev half of PartNet-Mobility, 20 of two folders of furniture, are learnt as one category, as
``artperl train --objects FOLDER --name furniture`` does: 12 of them are learnt from, 4 choose the best estimator, and
4 test it. Each row is of the same views of these 4, by what was learnt, and by ``generic``, from which it started and
which has seen no real object. The last line is one JSON object, with the minutes of one processor core.
"""

import json
import os
from dataclasses import dataclass
from pathlib import Path

import tyro

from artperl.commands.train import Train
from artsim.checks.realism import read_split
from artsim.common.files import read_json
from artsim.errors import ConfigError


@dataclass(frozen=True)
class Options:
    """Which objects, and where the run is."""

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


def main(options: Options) -> None:
    """Train as the command does, which prints its table, and print what the docs show of it."""
    out = options.out / "furniture"
    Train(objects=(link_objects(options),), name="furniture", out=out, workers=0, threads=1).run()
    split, seconds = read_json(out / "split.json", "split"), read_json(out / "seconds.json", "seconds")
    result = {
        "objects": {half: len(those) for half, those in split.items()},
        "steps": read_json(out / "state.json", "state")["done"]["perception"],
        "minutes": round(sum(seconds.values()) / 60.0, 1),
        **{
            name: {"views": own["instances"], **{
                key: round(100.0 * own[key], 1) for key in ("right", "parts_found", "segmentation")
            }}
            for name, own in read_json(out / "figures.json", "figures").items()
        },
    }  # fmt: skip
    print("\n".join(f"{name}: {value}" for name, value in result.items()))
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
