"""The worker process of a generation run: makes whole shards, follows its parent, never outlives it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from artsim.datasets.plan import Plan, Shard, ShardRecord, draw_sample, read_plan
from artsim.datasets.shards import write_shard
from artsim.loading.sources import Source
from artsim.object_file import ObjectCache, save_object
from artsim.renderers import Renderer, make_renderer
from artsim.sample import Sample

_STEP = 16  # samples between two reports


@dataclass
class _Worker:
    """What a worker process keeps between shards. The plan is read at the first: it may not exist before."""

    folder: Path
    made: Any  # shared counter of samples
    stop: Any  # shared event

    @cached_property
    def plan(self) -> Plan:
        return read_plan(self.folder)

    @cached_property
    def objects(self) -> ObjectCache:
        return ObjectCache(self.folder / "objects")

    @cached_property
    def renderer(self) -> Renderer:
        return make_renderer(self.plan.sample.renderer)


_worker: _Worker | None = None


def start_worker(folder: Path, made: Any, stop: Any) -> None:
    """Prepare a process for :func:`compile_source` and :func:`make_shard`.

    ``made`` counts samples, ``stop`` asks to stop. Ctrl-C is left to the parent; when that is killed, so is this.
    """
    global _worker
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        while os.getppid() == parent.pid:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()
    _worker = _Worker(folder, made, stop)


class _StoppedError(Exception):
    """The run was asked to stop."""


def make_shard(shard: Shard) -> ShardRecord | None:
    """Make and write one shard; None when asked to stop before it is whole."""
    assert _worker is not None
    try:
        size, digest = write_shard(_worker.folder / shard.name, _samples(_worker, shard))
    except _StoppedError:
        return None
    return ShardRecord(shard.name, shard.split, shard.first, shard.end, size, digest)


def _samples(worker: _Worker, shard: Shard) -> Iterator[Sample]:
    for index in range(shard.first, shard.end):
        if worker.stop.is_set():
            raise _StoppedError
        obj = worker.objects[worker.plan.object_of(index).key]
        yield draw_sample(obj, worker.plan.sample, worker.plan.seed, index, worker.renderer)
        made = index - shard.first + 1
        if made % _STEP == 0 or made == shard.end - shard.first:
            with worker.made.get_lock():
                worker.made.value += (made - 1) % _STEP + 1


@dataclass(frozen=True)
class CompiledSource:
    """What the plan needs to know of a source, and the name of its compiled file."""

    staged: str
    category: str
    object_id: str
    sha256: str
    num_parts: int


def compile_source(source: Source, staged: str) -> CompiledSource:
    """Load a source and keep it compiled in the dataset's folder, under a provisional name."""
    assert _worker is not None
    obj = source.load()
    save_object(obj, _worker.folder / "objects" / staged)
    return CompiledSource(staged, obj.category, obj.object_id, obj.sha256, len(obj))
