"""The tasks of a generation run: to load an object, to make a whole shard."""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property

from artsim.datasets.description import read_plan
from artsim.datasets.object_cache import ObjectCache
from artsim.datasets.plan import Plan, Shard, ShardRecord
from artsim.datasets.sample_options import PLANNED_ATTEMPTS, SampleOptions, check_visible, draw_sample
from artsim.datasets.shards import OtherBytesError, write_shard
from artsim.errors import ArtsimError, DatasetError
from artsim.loading.sources import FamilySource, Source
from artsim.model.object_file import object_bytes
from artsim.observing.sample import Sample
from artsim.renderers import Renderer, make_renderer
from artsim.runs.storage import Storage
from artsim.runs.worker import StoppedError, report, stop_if_asked, this_worker

_STEP = 16  # samples between two reports


PARTS, PARTS_OF_ONE = "parts", ".parts"
"""Folder of what is done of a dataset that is not complete, by several machines and by one.

Its folder ``objects`` holds objects before they have a name in the plan, each called by the digest of its file, and
``shards`` the record of each finished shard.
"""


class DatasetFiles:
    """What a worker process keeps of a dataset. The plan is read at the first shard: it may not exist before."""

    def __init__(self, storage: Storage):
        self.storage = storage

    @cached_property
    def plan(self) -> Plan:
        return read_plan(self.storage)

    @cached_property
    def objects(self) -> ObjectCache:
        return ObjectCache(self.storage)

    @cached_property
    def renderer(self) -> Renderer:
        return make_renderer(self.plan.sample.renderer)


def make_shard(shard: Shard, sha256: str | None, parts: str) -> ShardRecord | bool | None:
    """Make and write one shard.

    Parameters
    ----------
    shard : Shard
    sha256 : str or None
        What its digest has to be, if the dataset is complete: any other bytes are not written. Else it gets a record.
    parts : str
        Folder of records. Until a dataset of several machines is complete, its objects are there, too.

    Returns
    -------
    ShardRecord or False or None
        False where its digest is not as wanted; None when asked to stop before the shard is whole.
    """
    dataset, prepared = this_worker().kept(DatasetFiles), parts == PARTS and sha256 is None
    try:
        size, digest = write_shard(dataset.storage, shard.name, _samples(dataset, shard, prepared), sha256)
    except OtherBytesError:
        return False
    except StoppedError:
        return None
    recipe = dataset.plan.recipe(shard)
    record = ShardRecord(shard.name, shard.split, shard.first, shard.end, size, digest, recipe)
    if sha256 is None:
        dataset.storage.write(f"{parts}/shards/{shard.name}.json", json.dumps(asdict(record)).encode())
    return record


def _samples(dataset: DatasetFiles, shard: Shard, prepared: bool) -> Iterator[Sample]:
    plan, renderer = dataset.plan, dataset.renderer  # which says itself what it lacks
    for made, index in enumerate(plan.indices(shard), start=1):
        stop_if_asked()
        planned = plan.object_of(index)
        try:
            file = f"{PARTS}/objects/{planned.file_sha256}.npz" if prepared else planned.file
            yield draw_sample(dataset.objects[file], plan.sample, plan.seed, index, renderer, PLANNED_ATTEMPTS)
        except ImportError:  # which says what to install
            raise
        except Exception as error:  # whatever a renderer or a view function stumbles on: what matters is where
            what = error.what if isinstance(error, ArtsimError) else f"{type(error).__name__}: {error}"
            raise DatasetError(
                f"sample {index} of {planned.source} cannot be made ({what})",
                dataset.storage.place,
                "generate into a new folder, without this object or with other options",
            ) from error
        if made % _STEP == 0 or made == len(shard):
            report((made - 1) % _STEP + 1)


@dataclass(frozen=True)
class CompiledSource:
    """What the plan needs to know of a source that is loaded."""

    identity: str
    """Digest of what it is named by: category and seed of a procedural object, the bytes of the files of a loaded one.
    Splits follow from it."""
    category: str
    object_id: str
    sha256: str
    num_parts: int
    rigid: bool
    repairs: tuple[tuple[str, str], ...]
    file_sha256: str
    """As in :class:`artsim.datasets.plan.PlannedObject`."""


@dataclass(frozen=True)
class RefusedSource:
    """Why a source is of no use."""

    why: str


def compile_source(
    source: Source, folder: str, seed: int, options: SampleOptions | None, strict: bool = False
) -> CompiledSource | RefusedSource:
    """Load a source and keep it compiled, as the digest of its file.

    Parameters
    ----------
    source : Source
    folder : str
        Of prepared objects, in the storage of the dataset.
    seed : int
        Of the dataset.
    options : SampleOptions or None
        Views of which some must see it, if given.
    strict : bool
        Refuse an object that had to be repaired.
    """
    try:
        obj = source.load()
        repairs = tuple((r.where, r.what) for r in obj.repairs if not r.note)
        if strict and repairs:
            return RefusedSource(
                f"{source.name}: repaired while loading: " + "; ".join(f"{a}: {b}" for a, b in repairs)
            )
        identity = source.sha256 if isinstance(source, FamilySource) else obj.sha256
        if options is not None:
            check_visible(obj, options, seed, identity)
    except ArtsimError as error:
        return RefusedSource(str(error) if source.name in str(error) else f"{source.name}: {error}")
    except (Exception, SystemExit) as error:  # parsers raise whatever they stumble on; memory and stack run out, too
        return RefusedSource(f"{source.name}: cannot be loaded ({type(error).__name__}: {error})")
    data = object_bytes(obj)
    digest = hashlib.sha256(data).hexdigest()
    storage: Storage = this_worker().context
    storage.write(f"{folder}/{digest}.npz", data)
    return CompiledSource(identity, obj.category, obj.object_id, obj.sha256, len(obj), obj.is_rigid, repairs, digest)
