"""A Hugging Face dataset: Parquet files, a card with its configuration, and metadata in Croissant."""

import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from artsim.common.extras import require_extra
from artsim.datasets.dataset import Dataset
from artsim.datasets.sample_options import SampleOptions
from artsim.formats.base import Format, Piece
from artsim.observing.sample import Sample
from artsim.runs.tasks import Output

COLUMNS: dict[str, tuple[str, tuple[int, ...]]] = {
    "index": ("int64", ()),
    "category": ("string", ()),
    "object_id": ("string", ()),
    "part_names": ("string", (0,)),
    "points": ("float32", (0, 3)),
    "part": ("uint8", (0,)),
    "npcs": ("float32", (0, 3)),
    "T_camera_part": ("float64", (0, 4, 4)),
    "box_center": ("float64", (0, 3)),
    "box_size": ("float64", (0, 3)),
    "visible_fraction": ("float64", (0,)),
    "joint_type": ("string", (0,)),
    "joint_parent": ("int64", (0,)),
    "joint_axis_camera": ("float64", (0, 3)),
    "joint_origin_camera": ("float64", (0, 3)),
    "joint_state": ("float64", (0,)),
    "joint_limits": ("float64", (0, 2)),
    "K": ("float64", (3, 3)),
    "T_world_camera": ("float64", (4, 4)),
    "diagonal": ("float64", ()),
}
"""Type and shape of each; 0 stands for any length."""
_SPLITS = {"val": "validation"}
"""Names that differ from ours."""
_TYPES = {"string": "sc:Text", "int64": "sc:Integer", "uint8": "sc:Integer", "float32": "sc:Float",
          "float64": "sc:Float"}  # fmt: skip
_ABOUT = "Labelled partial point clouds of articulated objects, with the 9D pose of every part. Metres, radians."


class HuggingFaceFormat(Format):
    """``data/<split>-<number>.parquet``, ``README.md``, ``croissant.json``."""

    def check(self, options: SampleOptions, folder: Path) -> None:
        """There must be pyarrow."""
        with require_extra("parquet"):
            import pyarrow  # noqa: F401

    def write_samples(self, dataset: Dataset, piece: Piece, samples: Iterable[Sample], output: Output) -> Any:
        """Write one file; the answer is its name."""
        import pyarrow as pa
        from pyarrow import parquet

        rows = [{name: _plain(getattr(sample, name)) for name in COLUMNS} for sample in samples]
        schema = pa.schema([(name, _arrow(*kind)) for name, kind in COLUMNS.items()])
        buffer = io.BytesIO()
        parquet.write_table(pa.Table.from_pylist(rows, schema=schema), buffer, compression="zstd")
        name = f"data/{_SPLITS.get(piece.split, piece.split)}-{piece.number:06d}.parquet"
        output.write(name, buffer.getvalue())
        return [name, *output.files[name], len(rows)]

    def finish(self, dataset: Dataset, answers: Sequence[tuple[Piece, Any]], output: Output) -> None:
        """Write the card and the metadata."""
        files = [answer for _, answer in answers]
        output.write("README.md", _card(dataset, files).encode())
        output.write("croissant.json", orjson.dumps(_croissant(dataset, files), option=orjson.OPT_INDENT_2))


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else list(value) if isinstance(value, tuple) else value


def _arrow(kind: str, shape: tuple[int, ...]) -> Any:
    import pyarrow as pa

    made = getattr(pa, kind)()
    for length in reversed(shape):
        made = pa.list_(made, length) if length else pa.list_(made)
    return made


def _card(dataset: Dataset, files: Sequence[Any]) -> str:
    splits = dict.fromkeys(Path(name).name.partition("-")[0] for name, *_ in files)
    patterns = "".join(f"  - split: {split}\n    path: data/{split}-*.parquet\n" for split in splits)
    categories = sorted({planned.category for planned in dataset.plan.objects})
    counts = {split: sum(rows for name, _, _, rows in files if f"/{split}-" in name) for split in splits}
    lines = [f"| {split} | {count} |" for split, count in counts.items()]
    return (
        f"---\npretty_name: artsim samples\ntags:\n- 3d\n- articulated-objects\n- pose-estimation\nconfigs:\n"
        f"- config_name: default\n  data_files:\n{patterns}---\n\n# artsim samples\n\n{_ABOUT} Made by artsim "
        f"{dataset.description['artsim_version']} from seed {dataset.plan.seed}. Objects of files keep their licence."
        "\n\n"
        "| split | samples |\n|---|---|\n" + "\n".join(lines) + f"\n\nCategories: {', '.join(categories)}.\n\n"
        '```python\nfrom datasets import load_dataset\n\nsamples = load_dataset("FOLDER").with_format("numpy")\n```\n'
    )


def _croissant(dataset: Dataset, files: Sequence[Any]) -> dict[str, Any]:
    """Metadata by version 1.0 of Croissant: a file and its digest, and the columns of all."""
    stored = [
        {"@type": "cr:FileObject", "@id": name, "name": name, "contentUrl": name, "contentSize": f"{size} B",
         "encodingFormat": "application/x-parquet", "sha256": sha256}
        for name, size, sha256, _ in files
    ]  # fmt: skip
    together = {"@type": "cr:FileSet", "@id": "parquet", "name": "parquet", "includes": "data/*.parquet",
                "encodingFormat": "application/x-parquet"}  # fmt: skip
    columns = [
        {"@type": "cr:Field", "@id": f"samples/{name}", "name": f"samples/{name}", "dataType": _TYPES[kind],
         "source": {"fileSet": {"@id": "parquet"}, "extract": {"column": name}},
         **({"repeated": True} if shape else {})}
        for name, (kind, shape) in COLUMNS.items()
    ]  # fmt: skip
    records = {"@type": "cr:RecordSet", "@id": "samples", "name": "samples", "field": columns}
    return {
        "@context": _CONTEXT, "@type": "sc:Dataset", "conformsTo": "http://mlcommons.org/croissant/1.0",
        "name": "artsim-samples", "description": _ABOUT, "version": "1.0.0", "distribution": [*stored, together],
        "recordSet": [records],
    }  # fmt: skip


_OWN = ("citeAs", "column", "equivalentProperty", "extract", "field", "fileObject", "fileProperty", "fileSet", "format",
        "includes", "isLiveDataset", "jsonPath", "key", "md5", "parentField", "path", "recordSet", "references",
        "regex", "repeated", "replace", "samplingRate", "separator", "source", "subField", "transform")  # fmt: skip
_CONTEXT: dict[str, Any] = {
    "@language": "en", "@vocab": "https://schema.org/", "sc": "https://schema.org/", "dct": "http://purl.org/dc/terms/",
    "cr": "http://mlcommons.org/croissant/", "rai": "http://mlcommons.org/croissant/RAI/",
    "conformsTo": "dct:conformsTo", "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    **{name: {"@id": f"cr:{name}", "@type": "@json"} for name in ("data", "examples")},
    **{name: f"cr:{name}" for name in _OWN},
}  # fmt: skip
"""What the names stand for: Croissant's own, else those of schema.org."""
