"""Pages to look at: an object, samples or an estimate in one HTML file that any browser opens without a network.

The page draws with three.js, which comes in the package trimesh and is copied into each page when it is made.
"""

import base64
import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.names import numbered, printable
from artsim.common.outputs import write_output
from artsim.common.palette import PALETTE
from artsim.common.showing import page_of
from artsim.common.tables import centimetres, joint_value
from artsim.datasets.dataset import Dataset
from artsim.drawing.contact_sheet import open_shown, spread
from artsim.errors import ArtsimError
from artsim.model.draws import joint_intervals
from artsim.model.joints import ROTATING
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import transform_points
from artsim.observing.annotation import axis_segment
from artsim.observing.sample import Sample, part_rows

_MOST_POINTS = 20_000
"""Points of a cloud that a page holds; more make it slow, and look the same."""
_NEAREST = 0.9
"""Share of the points that a view shows for sure: a few stray ones may lie anywhere."""
_CORNERS = np.array([[i & 1, i & 2, i & 4] for i in range(8)], dtype=bool) - 0.5
SENSOR_ERROR = "error of the sensor"
_FRONT, _UP = (-1.0, -0.7, 0.6), (0.0, 0.0, 1.0)
"""Where an object is seen from first, rest frame: its front and right side, from above."""


@dataclass(frozen=True)
class PageView:
    """From where a page looks at a frame: it turns about the object's own centre, and up stays up."""

    center: Array
    """(3,) float. What the page turns about, metres, in the frame of the page."""
    radius: float
    """Of the ball about it that is fitted into view, metres."""
    up: ArrayLike = (0.0, -1.0, 0.0)
    seen_from: ArrayLike = (0.0, 0.0, -1.0)
    """(3,) float. Which way is up, and from where the page looks first, in the frame of the page."""


@dataclass(frozen=True)
class PageParts:
    """Boxes and joint axes of the K parts of one object."""

    T_page_part: Array
    """(K, 4, 4) float."""
    box_center: Array
    box_size: Array
    """(K, 3) float. Boxes in the frames of their parts, metres."""
    arrows: Sequence[tuple[int, Array, Array]] = ()
    """sequence of (part, start, end). Joint axes, (3,) each in the frame of the page."""

    def view(self, up: ArrayLike, points: ArrayLike = ()) -> PageView:
        """The view about the middle of the boxes. It shows them, and the nearest of the points (N, 3).

        Parameters
        ----------
        up : (3,) float
            In the frame of the page.
        points : (N, 3) float, optional
        """
        corners = self.box_center[:, None] + _CORNERS * self.box_size[:, None]
        corners = transform_points(self.T_page_part, corners).reshape(-1, 3)
        center = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        radius = float(np.linalg.norm(corners - center, axis=1).max())
        away = np.linalg.norm(np.asarray(points, np.float64).reshape(-1, 3) - center, axis=1)
        near = float(np.quantile(away, _NEAREST)) if len(away) else 0.0
        return PageView(center, max(radius, near), up)

    def to_json(self) -> dict[str, Any]:
        """What the page reads."""
        boxes = zip(self.T_page_part, self.box_center, self.box_size, strict=True)
        return {
            "boxes": [{"T": _short(T), "center": _short(center), "size": _short(size)} for T, center, size in boxes],
            "arrows": [[k, [_short(start), _short(end)]] for k, start, end in self.arrows],
        }


@dataclass(frozen=True)
class PageFrame:
    """One of the things that a page shows by turns: an object, a sample, or a step of an estimate. K parts."""

    name: str
    part_names: Sequence[str]
    joint_types: Sequence[str]
    """One for each part."""
    view: PageView
    shown: PageParts | None = None
    truth: PageParts | None = None
    """What is drawn beside it."""
    points: NDArray[Any] | None = None
    """(N, 3) float, optional. Metres, in the frame of the page."""
    part: NDArray[Any] | None = None
    """(N,) int, optional. Part of each point; of none below 0, or from K on."""
    error: NDArray[Any] | None = None
    """(N,) float, optional. Metres, by which points can be coloured; NaN where there is none."""
    table: tuple[Sequence[str], Sequence[Sequence[Sequence[str]]]] = ((), ())
    """(head, rows of each part). A row has a cell for each of the head."""

    def to_json(self) -> dict[str, Any]:
        """What the page reads."""
        names = numbered([printable(name, 60) for name in self.part_names])
        entry: dict[str, Any] = {
            "name": printable(self.name, 80),
            "parts": [{"name": name, "type": kind} for name, kind in zip(names, self.joint_types, strict=True)],
            "view": {name: _short(value) for name, value in vars(self.view).items()},
            "shown": self.shown and self.shown.to_json(),
            "truth": self.truth and self.truth.to_json(),
            "table": {"head": self.table[0], "rows": self.table[1]},
        }
        if self.points is not None and self.part is not None:
            chosen = np.random.default_rng(0).permutation(len(self.points))[:_MOST_POINTS]
            part = np.where(np.asarray(self.part) < len(names), np.asarray(self.part, np.int64), -1)
            entry |= {"points": _packed(self.points[chosen], np.float32), "part": _packed(part[chosen], np.int16)}
            if self.error is not None:
                entry["error"] = _packed(self.error[chosen], np.float32)
        return entry


@dataclass(frozen=True)
class PageContent:
    """What a page shows besides its frames."""

    title: str
    notes: Sequence[str] = ()
    warnings: Sequence[str] = ()
    """Paragraphs."""
    frame_word: str = "Sample"
    """What the frames are called."""
    first_frame: int = 0
    hidden: Sequence[str] = ()
    """Layers that are hidden first."""
    shown_word: str = "estimate"
    """What stands beside the ground truth."""
    error_word: str = "error"
    """What the colours of points show besides parts."""
    index: Mapping[str, Any] | None = None
    """Of frames that are loaded on demand: see :mod:`artsim.drawing.serve`."""


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
    opened = open_shown(path, split, package_roots, body)
    if isinstance(opened, Dataset):
        chosen = [opened[i] for i in spread(len(opened), samples)]
        page = sample_page(chosen, f"{path.resolve().name}: {len(chosen)} of {len(opened)} samples")
    else:
        page = object_page(opened)
    write_output(out, page.encode(), [path])


@page_of.register
def object_page(obj: ArticulatedObject) -> str:
    """HTML that shows an object: its parts, a slider for each joint, boxes and joint axes.

    Parameters
    ----------
    obj : ArticulatedObject
    """
    tree, ends = obj.tree, joint_intervals(obj)
    kinds = [(kind,) if kind in ("free", "fixed") else (kind, *ends[k]) for k, kind in enumerate(tree.types)]
    rows = [
        [("joint", kind), *((word, joint_value(end, kind)) for word, end in zip(("from", "to"), limits, strict=False)),
         ("box size, cm", centimetres(size))]
        for (kind, *limits), size in zip(kinds, obj.box_size, strict=True)
    ]  # fmt: skip
    low, high = obj.bounds
    frame = PageFrame(
        "",
        [part.label for part in obj.parts],
        tree.types,
        PageView(0.5 * (low + high), 0.5 * obj.diagonal, _UP, _FRONT),
        table=(("", ""), rows),
    )
    content = PageContent(f"{obj.category} {obj.object_id}", notes=str(obj).splitlines()[:3], hidden=("boxes",))
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
    return _page(content, [frame], bodies, boxes, _joints(obj, tree), ("surfaces", "boxes", "axes"))


def sample_page(samples: Sequence[Sample], title: str = "") -> str:
    """HTML that shows samples one by one, in their cameras' frames: cloud by part, boxes, joint axes.

    Parameters
    ----------
    samples : sequence of Sample
        At least one.
    title : str, optional

    Raises
    ------
    ArtsimError
        When there is none.
    """
    if not samples:
        raise ArtsimError("there is no sample to show", "page", "pass at least one")
    first, *more = samples
    named = f"{len(samples)} samples" if more else f"{first.category} {first.object_id}"
    notes = () if more else str(first).splitlines()[:1]
    content = PageContent(title or named, notes, error_word=SENSOR_ERROR)
    return frames_page(content, [sample_frame(sample) for sample in samples])


def sample_frame(sample: Sample) -> PageFrame:
    """A sample as a frame of a page: in its camera's frame, with the world's up."""
    shown = sample_parts(sample)
    own = sample.part < len(shown.box_size)
    part = np.where(own, sample.part, 0)
    truly = transform_points(sample.T_camera_part[part], sample.rest_points[:, None])[:, 0]
    (_, _, *head), *rows = part_rows(sample)
    return PageFrame(
        f"{sample.category} {sample.object_id}" + (f", sample {sample.index}" if sample.index >= 0 else ""),
        sample.part_names,
        sample.joint_type,
        shown.view(world_up(sample)),
        shown,
        points=sample.points,
        part=sample.part,
        error=np.where(own, np.linalg.norm(sample.points - truly, axis=1), np.nan),
        table=(("", ""), [[pair for pair in zip(head, row[2:], strict=True) if pair[1]] for row in rows]),
    )


def sample_parts(sample: Sample) -> PageParts:
    """Boxes and joint axes of a sample's parts, in its camera's frame."""
    moving = [k for k, kind in enumerate(sample.joint_type) if kind not in ("free", "fixed")]
    arrows = [(k, *axis_segment(sample, k)) for k in moving]
    return PageParts(sample.T_camera_part, sample.box_center, sample.box_size, arrows)


def world_up(sample: Sample) -> Array:
    """(3,) the world's up in the frame of a sample's camera."""
    return sample.T_world_camera[2, :3]


page_of.register(Sample, lambda sample, **more: sample_page([sample], **more))


def frames_page(content: PageContent, frames: Sequence[PageFrame]) -> str:
    """HTML that shows frames one by one.

    Parameters
    ----------
    content : PageContent
    frames : sequence of PageFrame
    """
    return _page(content, frames, (), (), (), ("cloud", "boxes", "axes"))


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

    data = vars(content) | {
        "title": printable(content.title, 200),
        "notes": [printable(text, 1000) for text in content.notes],
        "warnings": [printable(text, 1000) for text in content.warnings],
        "palette": [f"rgb({r},{g},{b})" for r, g, b in PALETTE.tolist()],
        "bodies": bodies,
        "boxes": boxes,
        "joints": joints,
        "order": sorted((k for k in range(len(joints)) if joints[k]["mimic"] is not None), key=chain),
        "frames": [frame.to_json() for frame in frames],
        "layers": layers,
    }
    # A script ends where "</script" stands, even in a text.
    text = json.dumps(data, allow_nan=False).replace("<", "\\u003c").replace("\u2028", " ").replace("\u2029", " ")
    folder = resources.files("artsim.drawing")
    page, program = (folder.joinpath(name).read_text(encoding="utf-8") for name in ("page.html", "page.js"))
    return page.replace("/*PROGRAM*/", program).replace("/*LIBRARY*/", _library()).replace("/*DATA*/null", text)


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
