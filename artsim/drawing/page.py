"""Pages to look at: an object, samples or an estimate in one HTML file that any browser opens without a network.

The page draws with three.js, which comes in the package trimesh and is copied into each page when it is made.
"""

import base64
import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.names import printable
from artsim.common.outputs import write_output
from artsim.common.palette import PALETTE
from artsim.common.showing import page_of
from artsim.datasets.dataset import Dataset
from artsim.drawing.contact_sheet import spread
from artsim.errors import ArtsimError
from artsim.loading.urdf import load
from artsim.model.draws import joint_intervals
from artsim.model.joints import ROTATING
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import ArticulatedObject
from artsim.observing.annotation import axis_segment
from artsim.observing.sample import Sample

_MOST_POINTS = 20_000
"""Points of a cloud that a page holds; more make it slow, and look the same."""
_FRONT, _UP = (-1.0, -0.7, 0.6), (0.0, 0.0, 1.0)
"""Where an object is seen from first, rest frame: its front and right side, from above."""


@dataclass(frozen=True)
class PageFrame:
    """One of the things that a page shows by turns: a sample, or a step of an estimate."""

    name: str
    points: NDArray[Any] | None = None
    """(N, 3) float, optional. Metres, in the frame of the page."""
    part: NDArray[Any] | None = None
    """(N,) int, optional. Part of each point; below 0 for none."""
    T_page_part: Array | None = None
    """(K, 4, 4) float, optional."""
    box_center: Array | None = None
    box_size: Array | None = None
    """(K, 3) float, optional. Boxes in the frames of their parts."""
    arrows: Sequence[tuple[int, Array, Array]] = ()
    """sequence of (part, start, end). Joint axes, (3,) each in the frame of the page."""

    def to_json(self) -> dict[str, Any]:
        """What the page reads."""
        entry: dict[str, Any] = {"name": printable(self.name, 80)}
        if self.points is not None and self.part is not None:
            chosen = np.random.default_rng(0).permutation(len(self.points))[:_MOST_POINTS]
            entry |= {
                "points": _packed(self.points[chosen], np.float32),
                "part": _packed(np.asarray(self.part, np.int64)[chosen], np.int16),
            }
        if self.T_page_part is not None and self.box_center is not None and self.box_size is not None:
            entry["boxes"] = [
                {"T": _short(T), "center": _short(center), "size": _short(size)}
                for T, center, size in zip(self.T_page_part, self.box_center, self.box_size, strict=True)
            ]
        entry["arrows"] = [[k, [_short(start), _short(end)]] for k, start, end in self.arrows]
        return entry


@dataclass(frozen=True)
class PageContent:
    """What a page shows besides its frames."""

    title: str
    part_names: Sequence[str]
    joint_types: Sequence[str]
    """One for each part."""
    notes: Sequence[str] = ()
    warnings: Sequence[str] = ()
    """Paragraphs."""
    frame_word: str = "Sample"
    """What the frames are called."""
    first_frame: int = 0
    table: tuple[str, Sequence[str], Sequence[Sequence[str]]] | None = None
    """(title, head, rows), optional."""
    up: tuple[float, float, float] = (0.0, -1.0, 0.0)
    seen_from: tuple[float, float, float] = (0.0, 0.0, -1.0)
    """(3,) float. Which way is up, and from where the page looks first, in the frame of the page."""
    hidden: Sequence[str] = field(default=())


def write_page(
    path: Path,
    out: Path,
    samples: int = 12,
    split: str | None = None,
    package_roots: Mapping[str, Path] | None = None,
    body: str | None = None,
) -> None:
    """Write the page of a dataset or an object; see :class:`artsim.commands.view.View`.

    Raises
    ------
    ArtsimError
        When there is nothing to show, or the file cannot be written.
    """
    if (path / "dataset.json").is_file() or (path / "plan.json").is_file():
        dataset = Dataset(path, split)
        chosen = [dataset[i] for i in spread(len(dataset), samples)]
        page = sample_page(chosen, f"{path.resolve().name}: {len(chosen)} of {len(dataset)} samples")
    else:
        page = object_page(load(path, package_roots=package_roots, body=body))
    write_output(out, page.encode(), [path])


@page_of.register
def object_page(obj: ArticulatedObject) -> str:
    """HTML that shows an object: its parts, a slider for each joint, boxes and joint axes.

    Parameters
    ----------
    obj : ArticulatedObject
    """
    tree = obj.tree
    names = [printable(part.label, 60) for part in obj.parts]
    content = PageContent(
        f"{printable(obj.category, 40)} {printable(obj.object_id, 40)}",
        names,
        tree.types,
        notes=str(obj).splitlines()[:3],
        up=_UP,
        seen_from=_FRONT,
        hidden=("boxes",),
    )
    bodies = [
        {"vertices": _packed(part.vertices * obj.scale, np.float32), "faces": _packed(part.faces, np.uint32)}
        if len(part.faces)
        else None
        for part in obj.parts
    ]
    boxes = [
        {"center": _short(obj.box_center[k]), "size": _short(obj.box_size[k])} if obj.has_surface[k] else None
        for k in range(len(obj))
    ]
    return _page(content, [PageFrame("")], bodies, boxes, _joints(obj, tree), ("surfaces", "boxes", "axes"))


def sample_page(samples: Sequence[Sample], title: str = "") -> str:
    """HTML that shows samples one by one, in their cameras' frames: cloud by part, boxes, joint axes.

    Parameters
    ----------
    samples : sequence of Sample
        At least one. Parts are named as those of the first.
    title : str, optional

    Raises
    ------
    ArtsimError
        When there is none.
    """
    if not samples:
        raise ArtsimError("there is no sample to show", "page", "pass at least one")
    most = max(samples, key=lambda sample: len(sample.part_names))
    frames = [
        PageFrame(
            f"{sample.category} {sample.object_id}, {sample.index}",
            sample.points,
            sample.part,
            sample.T_camera_part,
            sample.box_center,
            sample.box_size,
            _arrows(sample),
        )
        for sample in samples
    ]
    alike = all(sample.part_names == most.part_names for sample in samples)
    names = most.part_names if alike else [f"part {k}" for k in range(len(most.part_names))]
    types = most.joint_type if alike else ["free"] * len(names)
    notes = [str(samples[0]).splitlines()[0]] if len(samples) == 1 else [f"{len(samples)} samples"]
    content = PageContent(
        title or f"{most.category} {most.object_id}", [printable(name, 60) for name in names], types, notes
    )
    return frames_page(content, frames)


page_of.register(Sample, lambda sample, **more: sample_page([sample], **more))


def _arrows(sample: Sample) -> list[tuple[int, Array, Array]]:
    moving = [k for k, kind in enumerate(sample.joint_type) if kind not in ("free", "fixed")]
    return [(k, *axis_segment(sample, k)) for k in moving]


def frames_page(content: PageContent, frames: Sequence[PageFrame]) -> str:
    """HTML that shows frames one by one.

    Parameters
    ----------
    content : PageContent
    frames : sequence of PageFrame
    """
    count = len(content.part_names)
    joints = [{"type": kind, "parent": -1, "rest": 0.0, "mimic": None} for kind in content.joint_types]
    return _page(content, frames, [None] * count, [None] * count, joints, ("cloud", "boxes", "axes"))


def _joints(obj: ArticulatedObject, tree: KinematicTree) -> list[dict[str, Any]]:
    """Joints as the page moves them; sliders of joints without end go half a turn to either side."""
    ends, entries = joint_intervals(obj), []
    for k, joint in enumerate(tree.joints):
        axis, origin = np.asarray(joint.axis), np.asarray(joint.origin)
        middle = obj.box_center[k] if obj.has_surface[k] else origin
        if joint.type in ROTATING:
            middle = origin + axis * ((middle - origin) @ axis)
        half = 0.18 * obj.diagonal * axis
        moves = k > 0 and joint.type != "fixed"
        entries.append(
            {
                "type": joint.type,
                "parent": joint.parent,
                "axis": list(joint.axis),
                "origin": list(joint.origin),
                "rest": joint.rest,
                "pitch": joint.pitch,
                "mimic": None if joint.mimic is None else [*vars(joint.mimic).values()],
                "slider": [float(end) for end in ends[k]] if moves else None,
                "arrow": [_short(middle - half), _short(middle + half)] if moves else None,
            }
        )
    return entries


def _page(
    content: PageContent,
    frames: Sequence[PageFrame],
    bodies: Sequence[Any],
    boxes: Sequence[Any],
    joints: Sequence[dict[str, Any]],
    layers: Sequence[str],
) -> str:
    def chain(k: int) -> int:
        mimic = joints[k]["mimic"]
        return 0 if mimic is None else 1 + chain(mimic[0])

    data = {
        "title": printable(content.title, 200),
        "notes": [printable(text, 1000) for text in content.notes],
        "warnings": [printable(text, 1000) for text in content.warnings],
        "parts": list(content.part_names),
        "palette": [f"rgb({r},{g},{b})" for r, g, b in PALETTE.tolist()],
        "bodies": bodies,
        "boxes": boxes,
        "joints": joints,
        "order": sorted((k for k in range(len(joints)) if joints[k]["mimic"] is not None), key=chain),
        "frames": [frame.to_json() for frame in frames],
        "frame_word": content.frame_word,
        "first_frame": content.first_frame,
        "layers": layers,
        "hidden": list(content.hidden),
        "view": {"from": content.seen_from, "up": content.up},
        "table": None if content.table is None else dict(zip(("title", "head", "rows"), content.table, strict=True)),
    }
    # A script ends where "</script" stands, even in a text.
    text = json.dumps(data, allow_nan=False).replace("<", "\\u003c").replace("\u2028", " ").replace("\u2029", " ")
    page = resources.files("artsim.drawing").joinpath("page.html").read_text(encoding="utf-8")
    return page.replace("/*LIBRARY*/", _library()).replace("/*DATA*/null", text)


def _library() -> str:
    """three.js with its controls, out of trimesh's own viewer.

    Raises
    ------
    ArtsimError
        When this trimesh brings none.
    """
    import trimesh

    archive = trimesh.resources.get_bytes("templates/viewer.zip")
    with zipfile.ZipFile(BytesIO(archive)) as files:
        text = files.read("viewer.html.template").decode("utf-8")
    start = text.find("<script>") + len("<script>")
    end = text.find("var camera,controls,scene,renderer")  # where trimesh's own program begins
    if not len("<script>") <= start < end:
        raise ArtsimError(
            f"trimesh {trimesh.__version__} holds no three.js where it is looked for", "page", "install trimesh 4 or 5"
        )
    return text[start:end]


def _packed(values: ArrayLike, kind: Any) -> str:
    """Little-endian bytes of an array, base64."""
    little = np.ascontiguousarray(values, dtype=np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(little.tobytes()).decode("ascii")


def _short(values: ArrayLike) -> Any:
    """Hundredths of a millimetre are enough for the eye."""
    return np.round(np.asarray(values, dtype=np.float64), 5).tolist()
