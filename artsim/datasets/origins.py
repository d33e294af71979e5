"""Where the objects of a dataset came from on this machine, so that they can be made again.

``.sources.json`` holds paths, which are no part of the dataset: its bytes are the same wherever the sources lie.
"""

import json
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

from artsim.common.files import MAX_JSON_BYTES, parse_json
from artsim.common.json_records import from_json_values
from artsim.datasets.description import write_if_other
from artsim.datasets.plan import PlannedObject
from artsim.errors import ArtsimError, AssetError
from artsim.loading.sources import FamilySource, FileSource, Source, find_sources
from artsim.runs.storage import Storage

ORIGINS = ".sources.json"
_MAX_SOURCES = 1_000_000


@dataclass(frozen=True)
class _Origin:
    path: str
    sha256: str
    package_roots: dict[str, str]
    body: str | None = None


@dataclass(frozen=True)
class _Origins:
    files: Annotated[tuple[_Origin, ...], range(_MAX_SOURCES + 1)]


def write_origins(storage: Storage, sources: Sequence[Source]) -> None:
    """Note the paths of sources that are files."""
    files = {
        (str(source.path), source.sha256): _Origin(
            str(source.path), source.sha256,
            {name: str(Path(root).absolute()) for name, root in source.package_roots.items()}, source.body,
        )
        for source in sources
        if isinstance(source, FileSource)
    }  # fmt: skip
    if files:
        text = json.dumps({"files": [asdict(files[key]) for key in sorted(files)]}, indent=1)
        write_if_other(storage, ORIGINS, text.encode())


class Origins:
    """Finds the source of an object: procedural ones by their name, files where they were, or where somebody says.

    Parameters
    ----------
    storage : Storage
        Of the dataset.
    sources : sequence of Source
        Those that are named now; they come first.
    """

    def __init__(self, storage: Storage, sources: Sequence[Source] = ()):
        self._files: dict[str, list[FileSource]] = defaultdict(list)
        for source in [*sources, *_read_origins(storage)]:
            if isinstance(source, FileSource):
                self._files[source.sha256].append(source)

    def of(self, planned: PlannedObject) -> list[Source]:
        """Sources that may be that of an object; only what comes of them tells."""
        made = FamilySource.named(planned.source)
        if made is not None and made.sha256 == planned.source_sha256:
            return [made]
        return list(self._files[planned.source_sha256])


def _read_origins(storage: Storage) -> list[FileSource]:
    """Files that are still where they were, and still as they were."""
    try:
        files = from_json_values(_Origins, parse_json(storage.read(ORIGINS, MAX_JSON_BYTES))).files
    except (ArtsimError, ValueError):
        return []  # a note that helps, no more
    found = []
    for file in files:
        path, roots = Path(file.path), {name: Path(root) for name, root in file.package_roots.items()}
        try:
            if path.suffix.lower() in (".urdf", ".xml", ".npz"):
                found += [source for source in find_sources([path], roots, file.body) if source.sha256 == file.sha256]
        except (AssetError, OSError, ValueError):
            continue
    return found
