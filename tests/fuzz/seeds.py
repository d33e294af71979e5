"""Seeds: small folders of each kind, all our own: those of ``tests/cases/seeds``, and what our programs write."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from random import Random

from artsim.making.assembly import Assembly, prismatic, revolute
from artsim.making.solids import box
from artsim.model.object_file import save_object
from artsim.model.objects import ArticulatedObject
from tests.fuzz.mutations import mutated

FOLDER = Path(__file__).parents[1] / "cases" / "seeds"
WEIGHTS = {
    "urdf": 50, "joints": 8, "object": 12, "cloud": 14, "image": 16, "dataset": 10, "motions": 3, "base": 8,
    "estimator": 4, "state": 4,
}  # fmt: skip
"""Share of the inputs of each kind."""


@dataclass(frozen=True)
class Seed:
    """A folder of files, of which any may be mutated.

    Attributes
    ----------
    kind : str
        What reads it: a key of :data:`tests.fuzz.targets.TARGETS`.
    name : str
        Unique among seeds of the kind.
    files : mapping of str to bytes
        Names within the folder, and contents.
    """

    kind: str
    name: str
    files: dict[str, bytes]


@dataclass(frozen=True)
class Input:
    """A seed with other content in one of its files."""

    seed: Seed
    member: str
    data: bytes

    def file_name(self, index: int) -> str:
        """Name for the data alone, from which :func:`input_of` finds the seed."""
        return f"{self.seed.kind}-{self.seed.name}-{index}-{self.member.replace('/', '+')}"

    def lay_out(self, root: Path) -> Path:
        """A folder that holds the input; files beside the mutated one stay from the last time."""
        folder = root / f"{self.seed.kind}-{self.seed.name}-{self.member.replace('/', '+')}"
        if not folder.is_dir():
            for name, content in self.seed.files.items():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                (folder / name).write_bytes(content)
        (folder / self.member).write_bytes(self.data)
        return folder


def input_at(seed: int, i: int, kinds: Sequence[str]) -> Input:
    """Input ``i`` of a run, out of (seed, i) and the kinds alone."""
    rng = Random(f"{seed}:{i}")
    (kind,) = rng.choices(kinds, [WEIGHTS[kind] for kind in kinds])
    seeds = seeds_of(kind)
    chosen = rng.choice(seeds)
    member = rng.choice(list(chosen.files))
    alike = [one.files[member] for one in seeds if member in one.files]
    return Input(chosen, member, mutated(rng, chosen.files[member], Path(member).suffix, rng.choice(alike)))


def input_of(file: Path) -> Input:
    """The input that a file holds which a run, or a test, has stored."""
    kind, name, _, member = file.name.split("-", 3)
    (seed,) = (one for one in seeds_of(kind) if one.name == name)
    return Input(seed, member.replace("+", "/"), file.read_bytes())


def corpus() -> tuple[Seed, ...]:
    """All seeds."""
    return tuple(seed for kind in WEIGHTS for seed in seeds_of(kind))


@cache
def seeds_of(kind: str) -> tuple[Seed, ...]:
    """All seeds of a kind, always the same ones in the same order."""
    with tempfile.TemporaryDirectory() as name:
        made = Path(name)
        shutil.copytree(FOLDER, made, dirs_exist_ok=True)
        if kind in MAKERS:
            MAKERS[kind](made)
        return tuple(Seed(kind, folder.name, dict(_files(folder))) for folder in sorted((made / kind).iterdir()))


def _files(folder: Path) -> Iterator[tuple[str, bytes]]:
    for path in sorted(path for path in folder.rglob("*") if path.is_file() and not path.name.startswith(".")):
        yield path.relative_to(folder).as_posix(), path.read_bytes()


def small_object() -> ArticulatedObject:
    """A box with a lid and a drawer."""
    assembly = Assembly()
    assembly.add("body", box((-0.2, -0.15, -0.1), (0.2, 0.15, 0.1)))
    hinge = revolute("body", (0, 1, 0), (0.2, 0, 0.1), 0.0, 1.5)
    assembly.add("lid", box((-0.2, -0.15, 0.1), (0.2, 0.15, 0.11)), hinge)
    assembly.add("drawer", box((-0.21, -0.1, -0.05), (-0.2, 0.1, 0.05)), prismatic("body", (-1, 0, 0), 0.0, 0.2))
    return assembly.build("box", "7")


def _object(made: Path) -> None:
    (made / "object" / "npz").mkdir(parents=True)
    save_object(small_object(), made / "object" / "npz" / "o.npz")


def _urdf(made: Path) -> None:
    """Exported files, and USD files in the binary format, too."""
    from pxr import Sdf

    from artsim.export import export

    for file in (FOLDER / "urdf").glob("usda_*/*.usda"):
        out = made / "urdf" / file.parent.name.replace("usda", "usdc") / "mobility.usdc"
        out.parent.mkdir()
        Sdf.Layer.FindOrOpen(str(file)).Export(str(out))
    for suffix, name in (("mjcf", "mobility.xml"), ("usd", "mobility.usda")):
        export(small_object(), made / "export", [suffix])
        (made / "urdf" / f"exported_{suffix}").mkdir()
        (made / "export" / name).rename(made / "urdf" / f"exported_{suffix}" / name)
        if suffix == "mjcf":
            (made / "export" / "meshes").rename(made / "urdf" / f"exported_{suffix}" / "meshes")


def _dataset(made: Path) -> None:
    from artsim.datasets.generate import generate
    from artsim.datasets.plan import SampleOptions
    from artsim.loading.sources import find_sources
    from artsim.model.draws import ViewOptions

    out, motions = made / "dataset" / "small", made / "motions" / "small"
    options = SampleOptions(num_points=16, images=("depth", "part_mask"), views=ViewOptions(width=16, height=12))
    pair = made / "pair"  # without the side files that the seed has
    pair.mkdir()
    shutil.copy(FOLDER / "urdf" / "pair" / "mobility.urdf", pair)
    generate(find_sources([pair]), out, 2, sample=options, workers=1, shard_size=2, progress=False)
    (motions / "objects").mkdir(parents=True)
    motion = {"name": "motion-000000", "joint_state": [[0.0, 0.1]] * 2, "joint_velocity": [[0.0, 0.0]] * 2}
    recorded = {"format": 1, "control_step": 0.05, "motions": [motion]}
    (motions / "motions.json").write_text(json.dumps(recorded))
    shutil.copy(next(out.glob("*.tar")), motions / "motion-000000.tar")
    shutil.copy(next(out.rglob("*.npz")), motions / "objects" / "motion-000000.npz")


def _estimator(made: Path) -> None:
    import torch

    from artperl.boxes.network import Boxes
    from artperl.methods.estimator_writing import save_estimator
    from artperl.methods.full import Estimator
    from artperl.perception.network import Perception
    from artperl.retrieval.box_embedding import by_boxes
    from artperl.retrieval.shape_base import ShapeBase

    torch.manual_seed(0)
    base = by_boxes(ShapeBase.of([small_object(), small_object()], points_per_part=8))
    out = made / "estimator" / "small"
    save_estimator(Estimator(Perception(3, 4), base, boxes=Boxes(3, 4)), out, {"options": {"categories": ["box"]}})
    (made / "base" / "small").mkdir(parents=True)
    shutil.copy(out / "base.npz", made / "base" / "small")


def _state(made: Path) -> None:
    import torch

    from artperl.training.options import TrainOptions
    from artperl.training.run_folder import RunFolder

    state = {"options": asdict(TrainOptions()), "best": 1.5, "history": [{"step": 10, "laptop": {"parts": []}}]}
    run, out = made / "run", made / "state" / "small"
    RunFolder(run).write(state, {"done": torch.tensor([10, 0, 0]), "perception.a": torch.zeros(3, 4)})
    out.mkdir(parents=True)
    for file in run.glob("state*"):
        shutil.copy(file, out)


MAKERS: dict[str, Callable[[Path], None]] = {
    "urdf": _urdf, "object": _object, "dataset": _dataset, "motions": _dataset, "base": _estimator,
    "estimator": _estimator, "state": _state,
}  # fmt: skip
"""What makes the seeds of a kind that are not stored."""
