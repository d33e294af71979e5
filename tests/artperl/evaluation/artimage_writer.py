"""Writes samples in the layout of the original ArtImage, for tests of what reads it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from artperl.evaluation.artimage_files import REST_OF_THEIRS
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample

REST = {"revolute": 30.0, "prismatic": 0.05}
"""State of every joint, degrees or lengths, in which the object is at rest: its file's zero is elsewhere."""
PLACE = np.array([0.2, -0.1, 0.3])
"""Where the middle of the object at rest is in their axes."""
LEAN = np.array([0.1, 0.05, -0.2])
"""Angles by which the base joints of two files of scissors differ."""


def write_artimage(
    root: Path, category: str, objects: dict[int, ArticulatedObject], views: Sequence[tuple[int, Sample]],
    three_channels: bool = False,
) -> None:  # fmt: skip
    """Write views, with depth and part masks, of objects by their numbers."""
    folder = root / category
    (folder / "train" / "annotations").mkdir(parents=True)
    for name in ("depth", "category_mask"):
        (folder / "train" / name).mkdir()
    K = views[0][1].K
    columns = (np.array([[1, 0, -0.5], [0, 1, -0.5], [0, 0, 1]]) @ K).T.ravel().tolist()
    size = {"width": views[0][1].width, "height": views[0][1].height}
    (root / "camera_intrinsic.json").write_text(json.dumps({**size, "intrinsic_matrix": columns}))
    zero = {number: write_object(folder, category, number, obj) for number, obj in objects.items()}
    rest = {
        str(number): {str(k): {"state": REST[obj.tree.types[k]]} for k in range(1, len(obj))}
        for number, obj in objects.items()
    }
    (folder / "urdf" / "rest_state.json").write_text(json.dumps(rest))
    names = [
        write_view(folder, n, number, sample, zero[number], three_channels) for n, (number, sample) in enumerate(views)
    ]
    for split in ("train", "test"):
        (folder / f"{split}.txt").write_text("\n".join(names) + "\n")


def rest_from_zero(kind: str, axis: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """(4, 4) in their axes."""
    T = np.eye(4)
    if kind == "prismatic":
        T[:3, 3] = REST[kind] * axis
    else:
        T[:3, :3] = Rotation.from_rotvec(-np.deg2rad(REST[kind]) * axis).as_matrix()
        T[:3, 3] = origin - T[:3, :3] @ origin
    return T


def write_object(folder: Path, category: str, number: int, obj: ArticulatedObject) -> np.ndarray:
    """The files of an object; returns (K, 4, 4) from the file's zero to our rest frame."""
    own, tree = folder / "urdf" / str(number), obj.tree
    (own / "part_point_sample").mkdir(parents=True)
    axes, origins = tree.axes @ REST_OF_THEIRS, tree.origins @ REST_OF_THEIRS + PLACE
    aligned = np.eye(4)
    if category == "scissors":  # the angles are those of the base joint, subtracted number by number
        aligned[:3, :3] = Rotation.from_euler("ZXY", [-LEAN[0], LEAN[2], -LEAN[1]]).as_matrix()
    back = np.linalg.inv(aligned)
    axes, origins = axes @ back[:3, :3].T, origins @ back[:3, :3].T
    angles = " ".join(map(str, np.array([1.5, 0.0, -1.5]) + LEAN))
    ends = '<parent link="base"/><child link="0"/>'
    lines = [f'<joint name="joint_0" type="fixed">{ends}<origin xyz="0 0 0" rpy="{angles}"/></joint>']
    ours = np.eye(4)
    ours[:3, :3], ours[:3, 3] = REST_OF_THEIRS, -REST_OF_THEIRS @ PLACE
    zero = np.tile(np.eye(4), (len(obj), 1, 1))
    for k in range(len(obj)):
        T = np.eye(4) if k == 0 else rest_from_zero(tree.types[k], axes[k], origins[k])
        zero[k] = ours @ aligned @ T
        points = (
            np.linalg.inv(zero[k]) @ np.c_[obj.parts[k].vertices * obj.scale, np.ones(len(obj.parts[k].vertices))].T
        )
        np.savetxt(own / "part_point_sample" / f"{k}.xyz", points[:3].T)
        if k:
            text = [" ".join(map(str, np.roll(values, 1))) for values in (axes[k], origins[k])]
            lines.append(
                f'<joint name="joint_{k}" type="{tree.types[k]}"><parent link="{tree.parents[k]}"/><child link="{k}"/>'
                f'<axis xyz="{text[0]}"/><origin xyz="{text[1]}"/><limit lower="-1" upper="2"/></joint>'
            )
    links = "".join(f'<link name="{name}"/>' for name in ("base", *range(len(obj))))
    (own / "mobility_for_unity_align.urdf").write_text(f'<robot name="r">{links}{"".join(lines)}</robot>')
    old = '<joint name="joint_0" type="fixed"><origin xyz="0 0 0" rpy="1.5 0.0 -1.5"/></joint>'
    (own / "mobility_for_unity.urdf").write_text(f'<robot name="r">{old}</robot>')
    return zero


def write_view(folder: Path, n: int, number: int, sample: Sample, zero: np.ndarray, three_channels: bool) -> str:
    """One frame; returns the name of its annotation."""
    assert sample.depth is not None
    assert sample.part_mask is not None
    millimetres = np.rint(1000.0 * sample.depth).astype(np.uint16)
    if three_channels:
        image = np.stack([millimetres % 256, millimetres // 256, np.zeros_like(millimetres)], axis=-1).astype(np.uint8)
        Image.fromarray(image).save(folder / "train" / "depth" / f"{n:06d}.png")
    else:
        Image.fromarray(millimetres).save(folder / "train" / "depth" / f"{n:06d}.png")
    mask = np.repeat(sample.part_mask[..., None], 3, axis=2)
    Image.fromarray(mask).save(folder / "train" / "category_mask" / f"{n:06d}.png")
    rows, columns = np.nonzero(sample.depth)
    links = []
    for k in reversed(range(len(zero))):
        state = REST.get(sample.joint_type[k], 0.0) + (
            sample.joint_state[k] if sample.joint_type[k] == "prismatic" else -np.rad2deg(sample.joint_state[k])
        )
        links.append({
            "link_category_id": k, "transformation": (sample.T_camera_part[k] @ zero[k]).tolist(), "state": state,
        })  # fmt: skip
    box = [int(columns.min()), int(rows.min()), int(columns.max()) + 1, int(rows.max()) + 1]
    annotation = {
        "width": sample.width, "height": sample.height, "depth_path": f"depth/{n:06d}.png",
        "instances": [{"urdf_id": number, "bbox": box, "links": links}],
    }  # fmt: skip
    (folder / "train" / "annotations" / f"{n:06d}.json").write_text(json.dumps(annotation))
    return f"{n:06d}.json"
