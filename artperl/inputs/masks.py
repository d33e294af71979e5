"""Masks of files: which pixels of a depth image show the object."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.bounds import guard, read_file, read_npy, read_npz
from artperl.inputs.coco_masks import decode_segmentation
from artperl.inputs.images import Picture, read_picture
from artsim.common.files import parse_json
from artsim.errors import ConfigError

MaskKind = Literal["auto", "binary", "parts"]
"""binary: the object is what is not 0; parts: artsim's own part masks, where 255 is what shows no part and 0 is the
root; auto: parts where the mask looks like one, binary otherwise."""

MASK_FILES = (
    ".png", ".bmp", ".gif", ".tif", ".tiff", ".pgm", ".pbm", ".ppm", ".jpg", ".jpeg", ".webp", ".npy", ".npz", ".json",
)  # fmt: skip
_MAX_JSON_BYTES = 64_000_000
"""All masks of one image take one or two."""
_TOLD = 8
"""Masks whose areas an error names: more do not fit a line."""
_MOST_SIDE = 16_384
"""Pixels."""
_FIX = "give a PNG that is black where the object is not, or .npy of (H, W)"
_NONE = 255
"""What artsim writes where no part, or no instance, is seen."""
_MOST_PARTS = 64
"""Parts that an object has, at most, in a mask of parts."""
_LOSSY = ("JPEG", "WEBP")
_OURS = ("part_mask", "part_ids")
"""Names of artsim's own masks of parts."""
_INSTANCES = "instance_ids"
"""Name of artsim's own mask of the objects in a scene."""
_LISTED = 12
_MOST_LOGIT = 100.0
"""Numbers below 0 beside larger ones are greys that a resize has overshot."""
_END, _SAME = 0.125, 0.5
"""Share of the range at each end where a soft mask is all but sure; share of equal neighbours between, at most."""
_NEARLY_GREY = 24
"""Difference of channels in a grey picture that was compressed."""


@dataclass(frozen=True)
class Mask:
    """Where an object is, and what was assumed to tell."""

    shown: NDArray[np.bool_]
    """(H, W) bool."""
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def read_mask(path: Path, mask_id: str | None = None, kind: MaskKind = "auto") -> Mask:
    """The mask of a file.

    Parameters
    ----------
    path : Path
        A picture, ``.npy``, or ``.npz`` with an array 'mask', or only one that fits; or ``.json`` of run lengths, as
        Segment Anything writes it.
    mask_id : str, optional
        Which object, where several are in the mask: the number that its pixels have (with a palette: their index); the
        colour, as "#ff8000" or "255,128,0"; of a stack of masks (N, H, W), the number of one.
    kind : MaskKind

    Raises
    ------
    ConfigError
        When it cannot be read, or nothing in it has that number or colour.
    """
    ending = path.suffix.lower()
    if ending in (".npy", ".npz"):
        return _of_array(_read_array(path), path, mask_id, kind)
    if ending == ".json":
        return _of_run_lengths(path, mask_id)
    picture = read_picture(path, "mask")
    if picture.mode == "CMYK":
        raise ConfigError("a mask in CMYK is not read", path, _FIX)
    if picture.format in _LOSSY:
        return _of_lossy(picture, path, mask_id)
    if picture.mode == "P":
        return _of_palette(picture, path, mask_id)
    if picture.values.ndim == 3 and picture.values.shape[2] == 2:
        return _with_alpha(picture.values, path, mask_id, kind)
    return _of_array(picture.values, path, mask_id, kind)


def _read_array(path: Path) -> NDArray[Any]:
    if path.suffix.lower() == ".npy":
        return read_npy(path, "mask", _FIX)
    choice = read_npz(path, "mask", _FIX, lambda shape, dtype: len(shape) in (2, 3, 4) and dtype.kind in "bfiu")
    return choice.one_of(("mask", "masks", "segmentation", "part_mask"))[1]


def _of_run_lengths(path: Path, mask_id: str | None) -> Mask:
    """A mask of Segment Anything: an entry with a ``segmentation``, as COCO has it, a list of such, or annotations."""
    content: Any = guard(lambda: parse_json(read_file(path, "mask", _MAX_JSON_BYTES)), path, "mask", _FIX)
    if isinstance(content, dict):
        content = content.get("annotations", [content])
    entries = content if isinstance(content, list) else []
    if len(entries) != 1 and (mask_id is None or not mask_id.isdigit() or int(mask_id) >= len(entries)):
        fix = f"choose one: --mask-id 0 to {len(entries) - 1}" if entries else _FIX
        raise ConfigError(f"it holds {len(entries)} masks{_areas(entries)}", path, fix)
    entry = entries[int(mask_id or 0) if len(entries) > 1 else 0]

    def decoded() -> Mask:
        runs = entry.get("segmentation", entry)
        height, width = runs["size"]
        if not (type(height) is type(width) is int and 0 < height <= _MOST_SIDE and 0 < width <= _MOST_SIDE):
            raise ValueError(f"a mask of {width!r:.20} x {height!r:.20} pixels is not read")
        return Mask(decode_segmentation(runs, width, height))

    return guard(decoded, path, "mask", _FIX)


def _areas(entries: list[Any]) -> str:
    """How large the first masks are, where their entries say so, as Segment Anything's do."""
    areas = [entry.get("area") for entry in entries[:_TOLD] if isinstance(entry, dict)]
    if not areas or not all(isinstance(area, int) for area in areas):
        return ""
    return f", of {', '.join(map(str, areas))}{' ...' if len(entries) > _TOLD else ''} pixels"


def _of_array(values: NDArray[Any], path: Path, mask_id: str | None, kind: MaskKind) -> Mask:
    while values.ndim > 3 and values.shape[0] == 1:  # a batch of one
        values = values[0]
    if values.dtype.kind not in "bfiu" or values.size == 0 or values.ndim not in (2, 3):
        raise ConfigError(f"an array of shape {values.shape} and type {values.dtype} is no mask", path, _FIX)
    if values.ndim == 3 and 1 in (values.shape[0], values.shape[2]):
        values = values[..., 0] if values.shape[2] == 1 else values[0]
    if values.ndim == 2:
        return _of_numbers(values, path, mask_id, kind)
    if values.shape[2] == 3:
        return _of_colours(values, path, mask_id, kind)
    if values.shape[2] == 4:
        return _with_alpha(values, path, mask_id, kind)
    if mask_id is None or not mask_id.isdigit() or int(mask_id) >= len(values):
        raise ConfigError(
            f"it is a stack of {len(values)} masks", path, f"choose one: --mask-id 0 to {len(values) - 1}"
        )
    return _of_numbers(values[int(mask_id)], path, None, kind)


def _of_numbers(values: NDArray[Any], path: Path, mask_id: str | None, kind: MaskKind) -> Mask:
    """A mask of one channel."""
    if values.dtype.kind == "b":
        values = values.astype(np.uint8)
    if values.dtype.kind == "f":
        values = np.nan_to_num(values.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0)
    found = np.unique(values)
    soft = _soft(values, found) if mask_id is None and kind == "auto" else None
    if soft is not None and not _is_of_parts(values, found, path):
        return soft
    if mask_id is not None:
        number = _number(mask_id, path)
        shown: NDArray[np.bool_] = values == number
        if not shown.any():
            raise ConfigError(
                f"no pixel has the number {mask_id} (it has {_join(found)})",
                path,
                "choose one of these: --mask-id N",
            )
        return Mask(shown)
    if kind == "auto" and _INSTANCES in path.name.lower():
        raise ConfigError(f"it holds several objects (it has {_join(found)})", path, "choose one: --mask-id N")
    if kind == "parts" or (kind == "auto" and _is_of_parts(values, found, path)):
        return _of_parts(values, path)
    shown = values != 0
    if kind == "auto" and len(found) > 2:
        return Mask(shown, (), (
            f"the mask holds the numbers {_join(found)}: all but 0 are taken for the object. Fix: add --mask-id N to"
            " choose one, or --mask-kind binary if this is right",
        ))  # fmt: skip
    warnings: tuple[str, ...] = ()
    if kind == "auto" and _on_border(shown) > 0.5 and not shown.all():
        warnings = (
            "the mask is not 0 along most of its border: is black the object? Fix: invert the mask; give --mask-kind"
            " parts if it is a part mask of artsim, or --mask-kind binary if it is right",
        )
    return Mask(shown, (), warnings)


def _soft(values: NDArray[Any], found: NDArray[Any]) -> Mask | None:
    """A mask of how sure its maker is of each pixel, read where that is over half; None of one of numbers."""
    least, most = float(found[0]), float(found[-1])
    whole = bool((found == np.round(found)).all())
    if not whole and least >= -0.5 and most <= 1.5:  # a resize overshoots
        return Mask(values > 0.5, ("the mask holds probabilities: the object is where they are over 0.5",))
    if not whole and least < 0.0 and most <= _MOST_LOGIT:
        return Mask(values > 0.0, ("the mask holds logits: the object is where they are over 0, which is over half",))
    full = next((full for full in (255.0, 65535.0) if 0.5 * full < most <= 1.1 * full), None)
    if full is None or least < -0.1 * full:
        return None
    middle = (values > _END * full) & (values < (1.0 - _END) * full)
    low = int((found <= 0.5 * full).sum())
    if not middle.any():
        soft = low > 0 and (least > 0 or min(low, len(found) - low) > 1)
    else:  # numbers of objects are those of their neighbours, too, but for edges; a slope's are not
        soft = bool((values[:, 1:] == values[:, :-1])[middle[:, 1:]].mean() < _SAME) if middle[:, 1:].any() else False
    note = f"the mask holds greys from {least:g} to {most:g}: the object is where they are over {0.5 * full:g}"
    return Mask(values > 0.5 * full, (note,)) if soft else None


def _is_of_parts(values: NDArray[Any], found: NDArray[Any], path: Path) -> bool:
    """Whether it is a mask of parts as artsim writes it: 255 where there is none, as along most of the border."""
    if values.dtype.kind == "f" or found[-1] != _NONE:
        return False
    small = bool((found[:-1] < _MOST_PARTS).all() and found[0] >= 0)
    named = any(name in path.name.lower() for name in _OURS)
    several = len(found) > 2 or (len(found) == 2 and found[0] > 0)
    return small and (named or (several and _on_border(values == _NONE) > 0.5))


def _of_parts(values: NDArray[Any], path: Path) -> Mask:
    shown: NDArray[np.bool_] = values != _NONE
    note = f"a part mask of artsim: the object is what is not {_NONE}, parts {_join(np.unique(values[shown]))}"
    warnings: tuple[str, ...] = ()
    if "part_ids" in path.name.lower():
        warnings = (
            "part_ids.png holds the parts of all objects of a scene. Fix: give --mask instance_ids.png --mask-id N if"
            " there are several",
        )
    return Mask(shown, (note,), warnings)


def _of_colours(values: NDArray[Any], path: Path, mask_id: str | None, kind: MaskKind) -> Mask:
    """A mask of three channels."""
    if (values == values[..., :1]).all():  # grey
        return _of_numbers(values[..., 0], path, mask_id, kind)
    if mask_id is None and kind == "auto" and values.dtype == np.uint8 and _differ(values) <= _NEARLY_GREY:
        grey = values[..., 1]  # green is most of the light
        soft = _soft(grey, np.unique(grey))
        if soft is not None:
            return soft
    if mask_id is not None:
        shown: NDArray[np.bool_] = (values == np.array(_colour(mask_id, path))).all(axis=2)
        if not shown.any():
            raise ConfigError(f"no pixel has the colour {mask_id}", path, f"choose one of {_colours(values)[0]}")
        return Mask(shown)
    shown = (values != 0).any(axis=2)
    colours, several = _colours(values)
    text = f"the mask holds the colours {colours}: all but black are taken for the object."
    return Mask(shown, (), (f"{text} Fix: add --mask-id with one of them",) if several and kind == "auto" else ())


def _with_alpha(values: NDArray[Any], path: Path, mask_id: str | None, kind: MaskKind) -> Mask:
    """Alpha is no colour: what is black is not the object. But what is transparent is not there either."""
    colour, alpha = values[..., :-1], values[..., -1]
    soft = _soft(alpha, np.unique(alpha)) if kind == "auto" else None
    opaque = alpha != 0 if soft is None else soft.shown
    if mask_id is None and not (colour != 0).any() and not opaque.all():
        return Mask(opaque, ("the mask has no colour: the object is what is not transparent",))
    mask = _of_colours(np.repeat(colour, 3, axis=2) if colour.shape[2] == 1 else colour, path, mask_id, kind)
    if opaque.all():
        return mask
    return Mask(mask.shown & opaque, (*mask.notes, "what is transparent in the mask is not the object"), mask.warnings)


def _of_palette(picture: Picture, path: Path, mask_id: str | None) -> Mask:
    """A mask with a palette: black is not the object, whatever its index."""
    indices, palette = picture.values, picture.palette
    assert palette is not None
    found = np.unique(indices)
    if mask_id is not None and mask_id.isdigit():
        return _of_numbers(indices, path, mask_id, "binary")
    colours = np.vstack([palette, np.zeros((1, 3), dtype=np.uint8)])
    if mask_id is not None:
        return _of_colours(colours[indices], path, mask_id, "binary")
    grey = palette[found[found < 256]]
    if len(grey) > 1 and _differ(grey[None]) == 0 and not picture.transparent:
        soft = _soft(palette[indices, 0], np.unique(grey))
        if soft is not None:
            return soft
    back = {index for index in range(256) if not palette[index].any()} | picture.transparent
    note = ""
    if not back & set(found.tolist()):
        back, note = {0}, "no colour of the mask's palette is black: index 0 is taken for the background"
    shown = ~np.isin(indices, list(back))
    objects = [index for index in found.tolist() if index not in back]
    warnings: tuple[str, ...] = ()
    if len(objects) > 1:
        warnings = (
            f"the mask holds the indices {_join(np.array(objects))}: all are taken for the object. Fix: add"
            " --mask-id N to choose one",
        )
    return Mask(shown, (note,) if note else (), warnings)


def _of_lossy(picture: Picture, path: Path, mask_id: str | None) -> Mask:
    if mask_id is not None:
        raise ConfigError(
            f"a {picture.format} does not keep numbers exactly", path, "give the mask as PNG, or leave out --mask-id"
        )
    values = picture.values.astype(np.float64)
    weights = {1: [1.0], 3: [0.299, 0.587, 0.114], 4: [0.299, 0.587, 0.114, 0.0]}  # ITU-R BT.601; alpha is no colour
    light = values if values.ndim == 2 else values @ np.array(weights.get(values.shape[2], [0.0] * values.shape[2]))
    return Mask(light > 127, (f"a {picture.format} mask: the object is what is lighter than 127 of 255",))


def _differ(values: NDArray[np.uint8]) -> int:
    """Largest difference of channels (H, W, 3)."""
    return int((values.max(axis=2) - values.min(axis=2)).max())


def cut_warnings(shown: NDArray[np.bool_]) -> tuple[str, ...]:
    """What to say of an object that is cut by the border of its image; nothing where it is not.

    Parameters
    ----------
    shown : (H, W) bool
        Where it is.
    """
    return (_CUT,) if _on_border(shown) > 0.0 else ()


_CUT = "its mask reaches the border of the image: what lies beyond is guessed, and sizes may be too small"


def _on_border(chosen: NDArray[np.bool_]) -> float:
    """Share of the pixels along the border."""
    border = np.concatenate([chosen[0], chosen[-1], chosen[:, 0], chosen[:, -1]])
    return float(border.mean())


def _number(mask_id: str, path: Path) -> float:
    try:
        return float(mask_id)
    except ValueError:
        raise ConfigError(f"{mask_id} is no number, and the mask has no colours", path, "use --mask-id N") from None


def _colour(mask_id: str, path: Path) -> tuple[int, int, int]:
    if re.fullmatch(r"#?[0-9a-fA-F]{6}", mask_id):
        red, green, blue = bytes.fromhex(mask_id.removeprefix("#"))
        return red, green, blue
    numbers = [int(word) for word in re.findall(r"\d+", mask_id)]
    if len(numbers) != 3 or not re.fullmatch(r"[\d\s,()\[\]]+", mask_id):
        raise ConfigError(
            f"{mask_id} is no colour, and the mask is in colour", path, "use --mask-id R,G,B or --mask-id '#rrggbb'"
        )
    return numbers[0], numbers[1], numbers[2]


def _colours(values: NDArray[Any]) -> tuple[str, bool]:
    """Some colours of (H, W, 3), but for black, and whether there are several."""
    if values.dtype == np.uint8:  # a table of all colours is a hundred times as fast as sorting
        packed = values[..., 0].astype(np.int32)
        for channel in (1, 2):
            packed = (packed << 8) | values[..., channel]
        known = np.zeros(1 << 24, dtype=bool)
        known[packed] = True
        numbers = np.flatnonzero(known[1:]) + 1
        shown = [f"{n >> 16},{n >> 8 & 255},{n & 255}" for n in numbers[:_LISTED].tolist()]
        return " ".join(shown) + (" ..." if len(numbers) > _LISTED else ""), len(numbers) > 1
    few = values.reshape(-1, 3)[:: 1 + values.size // 300_000]
    found = [row for row in np.unique(few, axis=0).tolist() if any(row)]
    shown = [",".join(f"{value:g}" for value in row) for row in found[:_LISTED]]
    return " ".join(shown) + (" ..." if len(found) > _LISTED else ""), len(found) > 1


def _join(found: NDArray[Any]) -> str:
    return ", ".join(f"{value:g}" for value in found[:_LISTED].tolist()) + (", ..." if len(found) > _LISTED else "")
