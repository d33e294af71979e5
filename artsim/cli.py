"""The program ``artsim``: datasets, objects, variations, motions and scenes; checks, pictures, other formats."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal

import tyro

from artsim.common.program import cores, run_program
from artsim.datasets.plan import SampleOptions
from artsim.drawing.scene_command import Scene
from artsim.errors import ConfigError, DatasetError
from artsim.export.command import Export
from artsim.families.constraints import Constraints
from artsim.formats.base import FormatName
from artsim.formats.command import Convert
from artsim.loading.roots import Opened, PackageRoots
from artsim.physics.episode import EpisodeOptions
from artsim.variation.command import Vary

_LISTED = 50
"""Lines of a list before the rest is only counted."""


Having = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        metavar="NAME=VALUE",
        help="What every procedural object must have: a number or a range of parts (doors=2 drawers=1..3), of joints "
        "(joints=2..), of metres (size height width depth: size=0.4..0.8), joint types (joint_types=revolute), "
        "handles and legs (handles=no).",
    ),
]
"""Constraints of :func:`artsim.make`."""


@dataclass(frozen=True)
class Generate(Opened):
    """Generate a dataset of labelled partial point clouds.

    Poses each object in random joint states, looks at it from random viewpoints, and writes clouds with full ground
    truth as WebDataset tar shards. Objects are made (--categories), loaded (--objects), or both. Stop it at any moment:
    the same command goes on where it stopped, and makes again what is damaged. With a larger --num-samples it extends
    the dataset. The result depends on the options and the seed alone, never on the number of workers.

    To make objects: python generate.py --categories laptop drawer --objects-per-category 200 --out out/first

    To load objects: python generate.py --objects path/to/partnet_mobility/Laptop --out out/real --num-samples 500
    """

    out: Annotated[str, tyro.conf.arg(metavar="FOLDER|URL")]
    """Folder of the dataset, made if missing; or a URL such as s3://bucket/first."""
    categories: tuple[str, ...] = ()
    """Procedural categories, such as laptop or drawer; 'all' for every one."""
    objects_per_category: int = 50
    """Procedural objects of each category."""
    first_object: int = 0
    """Seed of the first procedural object; the others count up from it."""
    having: Having = ()
    objects: tuple[Path, ...] = ()
    """URDF, MJCF, USD and joint files, object folders, or folders of them (such as an unpacked PartNet-Mobility)."""
    num_samples: int = 1000
    """Samples in all; every object gets about the same number."""
    seed: int = 0
    """Seed of the dataset; sample i depends on (seed, i) only."""
    workers: int = field(default_factory=cores)
    """Worker processes; by default one for each core."""
    ray: str | None = None
    """Use a Ray cluster instead: auto (the one that this machine belongs to), local (starts one), or HOST:PORT. Nodes
    need the same artsim, and no disk in common."""
    part: Annotated[str | None, tyro.conf.arg(metavar="I/N")] = None
    """Do the part of machine I of N, from 0/N on, that share --out: for array jobs. Then artsim merge completes it."""
    sample: Annotated[SampleOptions, tyro.conf.arg(name="")] = field(default_factory=SampleOptions)
    splits: tuple[float, float, float] = (0.8, 0.1, 0.1)
    """Shares of each category's objects in train, val and test: by object, never by view."""
    shard_size: int = 256
    """Samples of each tar file."""
    skip_broken: bool = False
    """Leave out objects that do not load, or that no view sees, and say which, instead of stopping."""
    strict: bool = False
    """Refuse objects that were repaired while loading; with --skip-broken, leave them out."""
    load_limit: float = 300.0
    """Seconds that an object may take to load."""
    format: FormatName | None = None
    """Also convert the finished dataset to this format, into the folder <out>_<format>; see artsim convert."""

    def run(self) -> None:
        from artsim.common.names import printable
        from artsim.common.storage import is_url
        from artsim.datasets.generate import generate
        from artsim.datasets.parts import Part
        from artsim.datasets.summary import object_lines
        from artsim.loading.sources import Source, family_sources, find_sources

        part = None if self.part is None else Part.parse(self.part)
        if self.format is not None:  # before hours are spent on a dataset that it does not take
            from artsim.formats.conversion import FORMATS

            if is_url(self.out) or part is not None:
                raise ConfigError("a whole dataset in a folder is converted", "format", "leave --format out")
            FORMATS[self.format].check(self.sample, Path(self.out))
        sources: list[Source] = [*find_sources(self.objects, self.package_root, self.body)]
        sources += family_sources(
            _categories(self.categories), self.objects_per_category, self.first_object, _constraints(self.having)
        )
        try:
            result = generate(
                sources,
                self.out,
                num_samples=self.num_samples,
                seed=self.seed,
                sample=self.sample,
                workers=self.workers,
                shard_size=self.shard_size,
                splits=self.splits,
                skip_broken=self.skip_broken,
                strict=self.strict,
                load_limit=self.load_limit,
                ray=self.ray,
                part=part,
            )
        except KeyboardInterrupt:
            print(f"\nstopped; whole shards are kept in {self.out}: the same command goes on from there")
            raise
        for reason in result.left_out:
            print(f"left out: {printable(reason, 1000)}")
        if part is not None:
            print(f"{result.folder}: part {part} is done, {result.made} samples made now")
            print(f"when all are: artsim merge {result.folder}")
            return
        for line in object_lines(str(result.folder), result.objects):
            print(line)
        if result.grown_from is not None:
            kept = result.num_samples - result.made
            print(f"extended from {result.grown_from} samples, {kept} of which are kept in their shards")
        for file in result.restored:
            print(f"made again: {file}")
        if result.made == 0:
            print(f"{result.folder}: already complete, {result.num_samples} samples")
        else:
            made, rate = result.made, result.made / result.seconds
            print(f"{result.folder}: {result.num_samples} samples, {made} of them made now, {rate:.0f} samples/s")
            print(f"look at them: artsim view {result.folder}")
        if self.format is not None:
            Convert(Path(self.out), self.format, Path(f"{self.out}_{self.format}"), workers=self.workers).run()


@dataclass(frozen=True)
class GenerateObjects:
    """Write procedural objects as files: simulation-ready URDF folders in PartNet-Mobility's style, MJCF, USD.

    Every object has a folder <out>/<category>/<seed>, and index.csv lists them all. Stop it at any moment: the same
    command goes on where it stopped. On one kind of processor, bytes depend on category, seed and formats alone.

    Example: artsim generate-objects --category drawer --count 1000 --out out/drawers
    """

    category: tuple[str, ...]
    """Categories, such as drawer laptop; 'all' for every one."""
    out: Path
    """Folder to write to; made if missing."""
    count: int = 1000
    """Objects of each category."""
    formats: tuple[Literal["urdf", "mjcf", "usd"], ...] = ("urdf",)
    """File formats: mobility.urdf, mobility.xml, mobility.usda."""
    seed: int = 0
    """Seed of the first object; object n of a category is artsim.make(category, seed + n)."""
    having: Having = ()
    base: Literal["fixed", "free"] = "fixed"
    """fixed: the root is fixed to the world; free: it falls. Of MJCF and USD: for URDF the simulator is told."""
    actuators: Literal["none", "motor", "position"] = "none"
    """Of MJCF files. motor: a control of 1 is the effort limit at rest, and nothing at the velocity limit; position: a
    control is where the joint shall be."""
    materials: bool = False
    """Write finishes, other for each object: colours, textures, and where they lie."""
    workers: int = field(default_factory=cores)
    """Worker processes; by default one for each core."""

    def run(self) -> None:
        from artsim.export.batch import generate_objects
        from artsim.export.options import ExportOptions

        try:
            result = generate_objects(
                _categories(self.category),
                self.out,
                self.count,
                self.seed,
                self.formats,
                self.workers,
                constraints=_constraints(self.having),
                options=ExportOptions(self.base, self.actuators, self.materials),
            )
        except KeyboardInterrupt:
            print(f"\nstopped; whole objects are kept in {self.out}: the same command goes on from there")
            raise
        if result.made == 0:
            print(f"{result.folder}: already complete, {result.objects} objects")
            return
        rate = result.made / result.seconds
        print(f"{result.folder}: {result.objects} objects, {result.made} of them made now, {rate:.0f} objects/s")


@dataclass(frozen=True)
class Record:
    """Record motions for tracking: objects under physics, frame by frame, with full ground truth.

    Every motion is a shard of samples of one object, a control step apart, whose joints a motor drives from one random
    goal to the next; motions.json lists times, joint states and speeds. Parts keep their number from frame to frame.

    Example: artsim record --categories laptop door --motions 20 --camera orbit --out out/motions
    """

    out: Path
    """Folder to write to; made if missing."""
    motions: int = 10
    """Motions, each of an object of its own."""
    frames: int = 60
    """Frames of each: one for each control step."""
    seed: int = 0
    """Motion m depends on (seed, m) and the options alone."""
    episode: Annotated[EpisodeOptions, tyro.conf.arg(name="")] = field(default_factory=EpisodeOptions)

    def run(self) -> None:
        from artsim.physics.episode_file import record

        episode = replace(self.episode, categories=_categories(self.episode.categories))
        folder = record(self.out, episode, self.motions, self.frames, self.seed)
        print(f"{folder}: {self.motions} motions of {self.frames} frames; read them with artsim.physics.open_motions")


@dataclass(frozen=True)
class View(Opened):
    """Draw samples of a dataset, or an object in several states.

    Writes a contact sheet (PNG: depth, part colours, boxes, joint axes). With --rerun, a recording for the rerun
    viewer comes with it. With --html, it writes a page for any browser instead: sliders for joints, boxes, clouds.
    """

    path: tyro.conf.Positional[Path]
    """Dataset folder, or an object: URDF, MJCF, USD, GLB or joint file, or its folder."""
    out: Path | None = None
    """PNG to write; by default contact_sheet.png in the dataset folder, or <object>.png here."""
    samples: int = 12
    """How many samples (or states of the object) to draw."""
    split: str | None = None
    """Draw from this split only."""
    rerun: Path | None = None
    """Also write a rerun recording (.rrd) to this file."""
    html: Path | None = None
    """Page to write, such as laptop.html; it needs no network and no other file."""

    def run(self) -> None:
        from artsim.drawing.contact_sheet import write_contact_sheet
        from artsim.drawing.page import write_page

        if self.html is not None:
            write_page(self.path, self.html, self.samples, self.split, self.package_root, self.body)
            print(f"wrote {self.html}")
            if self.out is None and self.rerun is None:
                return
        for written in write_contact_sheet(
            self.path, self.out, self.samples, self.split, self.rerun, self.package_root, self.body
        ):
            print(f"wrote {written}")


@dataclass(frozen=True)
class Gallery:
    """Draw procedural objects, each at rest and opened further and further, as one picture."""

    categories: tuple[str, ...] = ("all",)
    """Categories, such as faucet; 'all' for every one."""
    objects: int = 1
    """Objects of each category."""
    first_object: int = 0
    """Seed of the first object of each."""
    having: Having = ()
    states: int = 3
    """Pictures of each object."""
    out: Path = Path("gallery.png")
    """PNG to write."""

    def run(self) -> None:
        from artsim.common.outputs import write_output
        from artsim.drawing.gallery import draw_gallery
        from artsim.loading.sources import family_sources

        sources = family_sources(
            _categories(self.categories), self.objects, self.first_object, _constraints(self.having)
        )
        write_output(self.out, draw_gallery([source.load() for source in sources], self.states))
        print(f"wrote {self.out}")


@dataclass(frozen=True)
class Families:
    """Print what each procedural category is: parameters, joint types, numbers of parts, handles and legs.

    Numbers and kinds are those seen over the first seeds. Any of them may be asked for with --having.

    Example: artsim families storage_furniture
    """

    names: tyro.conf.Positional[tuple[str, ...]] = ()
    """Categories; by default all of them."""
    objects: int = 20
    """Objects of each that are looked at, seeds counting up from 0."""

    def run(self) -> None:
        from artsim.families.catalogue import describe_family

        for name in _categories(self.names or ("all",)):
            print(describe_family(name, self.objects))


@dataclass(frozen=True)
class Inspect(Opened):
    """Print an object's tree, joints, limits, boxes, and what was mended while loading it."""

    path: tyro.conf.Positional[Path]
    """URDF, MJCF or USD file, GLB or joint file (mobility_v2.json, motion_attributes.json), or its folder."""
    gates: bool = False
    """Also pass the object through the sim-readiness gates, and list what each finds."""

    def run(self) -> None:
        from artsim.drawing.inspect import describe
        from artsim.loading.urdf import load

        obj = load(self.path, package_roots=self.package_root, body=self.body)
        print(describe(obj))
        if self.gates:
            from artsim.checks.validity import check_file

            print("\ngates")
            for gate in check_file(obj, self.path, self.package_root):
                print(f"  {gate}")


@dataclass(frozen=True)
class Verify:
    """Check a dataset: every checksum, the descriptions, the objects, and what must hold of every sample's truth.

    Nothing is written. Each problem says what to do.
    """

    path: tyro.conf.Positional[Path]
    """Dataset folder."""
    workers: int = field(default_factory=cores)
    """Processes that check samples, of a dataset that is worth them."""

    def run(self) -> None:
        from artsim.datasets.problems import repair_command
        from artsim.datasets.verify import verify

        if self.workers < 1:
            raise ConfigError(f"{self.workers} processes check nothing", "workers", "use 1 or more")
        problems = verify(self.path, workers=self.workers)
        for problem in problems[:_LISTED]:
            print(problem)
        if len(problems) > _LISTED:
            print(f"... and {len(problems) - _LISTED} more")
        if problems:
            plural = "problem" if len(problems) == 1 else "problems"
            raise DatasetError(f"{len(problems)} {plural} found", self.path, repair_command(self.path))
        print(f"{self.path}: sound")


@dataclass(frozen=True)
class Repair:
    """Restore what is damaged or missing of a dataset, to the same bytes, or say why that cannot be.

    Shards are drawn again, objects are made or loaded again, plan.json and dataset.json restore each other. A dataset
    that was stopped is completed. What cannot be restored is listed, and the exit code is 2.
    """

    path: tyro.conf.Positional[Path]
    """Dataset folder."""
    objects: tuple[Path, ...] = ()
    """Where objects lie that were loaded from files, if they are not where they were."""
    package_root: PackageRoots = field(default_factory=dict)
    """Folder of a package:// name: NAME=FOLDER ..."""
    workers: int = field(default_factory=cores)
    """Worker processes; by default one for each core."""

    def run(self) -> None:
        from artsim.datasets.repair import repair
        from artsim.loading.sources import find_sources

        try:
            result = repair(self.path, find_sources(self.objects, self.package_root), self.workers)
        except KeyboardInterrupt:
            print(f"\nstopped; what was restored stays in {self.path}: the same command goes on from there")
            raise
        for file in result.restored[:_LISTED]:
            print(f"restored: {file}")
        if len(result.restored) > _LISTED:
            print(f"... and {len(result.restored) - _LISTED} more")
        for problem in result.failed[:_LISTED]:
            print(problem)
        if result.failed:
            raise DatasetError(f"{len(result.failed)} problems are left", self.path)
        print(f"{self.path}: " + (f"{len(result.restored)} files restored" if result.restored else "nothing to repair"))


@dataclass(frozen=True)
class Merge:
    """Complete a dataset that several machines made with generate.py --part.

    Nothing is complete before: shards that are missing are named, with the parts to run again.

    Example: artsim merge s3://bucket/first --check
    """

    path: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FOLDER|URL")]
    """Folder or URL that the parts wrote to."""
    check: bool = False
    """Read every file again, and compare its checksum; otherwise sizes alone are compared."""

    def run(self) -> None:
        from artsim.datasets.merge import merge

        result = merge(self.path, self.check)
        if result.already:
            print(f"{result.place}: already complete, {result.num_samples} samples")
        else:
            print(f"{result.place}: {result.num_samples} samples in {result.num_shards} shards, complete")


@dataclass(frozen=True)
class Doctor:
    """Try every backend: does it work, on which device, how fast, and what to do if not."""

    backends: tyro.conf.Positional[tuple[str, ...]] = ()
    """raycast, pybullet, pybullet-egl, sapien, warp, maniskill, ray, torch; by default all of them."""

    def run(self) -> None:
        from artsim.doctor import BACKENDS, examine, finding_table

        print(finding_table([examine(backend) for backend in self.backends or BACKENDS]))


def _categories(named: tuple[str, ...]) -> tuple[str, ...]:
    """Categories by name; 'all' stands for every one."""
    from artsim.families import FAMILIES

    return tuple(sorted(FAMILIES)) if "all" in named else named


def _constraints(having: tuple[str, ...]) -> Constraints:
    """Constraints out of texts."""
    return Constraints.parse(having)


Verb = (
    Annotated[Generate, tyro.conf.subcommand("generate")]
    | Annotated[Gallery, tyro.conf.subcommand("gallery")]
    | Annotated[Families, tyro.conf.subcommand("families")]
    | Annotated[GenerateObjects, tyro.conf.subcommand("generate-objects")]
    | Annotated[Export, tyro.conf.subcommand("export")]
    | Annotated[Vary, tyro.conf.subcommand("vary")]
    | Annotated[Record, tyro.conf.subcommand("record")]
    | Annotated[Scene, tyro.conf.subcommand("scene")]
    | Annotated[View, tyro.conf.subcommand("view")]
    | Annotated[Inspect, tyro.conf.subcommand("inspect")]
    | Annotated[Verify, tyro.conf.subcommand("verify")]
    | Annotated[Repair, tyro.conf.subcommand("repair")]
    | Annotated[Merge, tyro.conf.subcommand("merge")]
    | Annotated[Convert, tyro.conf.subcommand("convert")]
    | Annotated[Doctor, tyro.conf.subcommand("doctor")]
)


def main() -> None:
    """Entry point of the program ``artsim``."""
    run_program(Verb, "artsim", __doc__)


def generate_main() -> None:
    """Entry point of ``generate.py``."""
    run_program(Generate, "generate.py")
