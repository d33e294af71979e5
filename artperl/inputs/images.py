"""Picture files, bounded by their number of pixels before they are decoded."""

import io
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.bounds import MAX_VALUES, guard, read_file
from artsim.errors import ConfigError

FORMATS = ("PNG", "TIFF", "PPM", "JPEG", "BMP", "WEBP", "GIF")
"""Everything else that Pillow opens is neither a depth image nor a mask."""


IN_COLOUR = ("RGB", "RGBA", "P", "PA")
"""Modes of pictures, as Pillow names them, that are no depth images."""


@dataclass(frozen=True)
class Picture:
    """A decoded picture."""

    values: NDArray[Any]
    """(H, W) or (H, W, C). Of a picture with a palette: the indices."""
    mode: str
    """As Pillow names it: "L", "I;16", "RGBA", "P" and so on."""
    format: str
    """One of :data:`FORMATS`."""
    palette: NDArray[np.uint8] | None = None
    """(256, 3) uint8 or None. Colours of the indices."""
    transparent: frozenset[int] = field(default_factory=frozenset)
    """Indices that are transparent."""


def read_picture(path: Path, what: str) -> Picture:
    """Decode a picture.

    Raises
    ------
    ConfigError
        When it is missing, too large, damaged, or of another format.
    """
    return guard(lambda: _read(path, what), path, what, f"save the {what} again, as PNG or .npy")


def read_image(path: Path) -> NDArray[np.uint8]:
    """(H, W, 3) of an image in colour or grey, whatever alpha says.

    Raises
    ------
    ConfigError
        As :func:`read_picture`; or when it is neither.
    """
    picture = read_picture(path, "image")
    values = picture.values
    if picture.palette is not None:
        return picture.palette[np.minimum(values, 255)]
    if picture.mode not in ("L", "LA", *IN_COLOUR):
        raise ConfigError(
            f"a picture of mode {picture.mode} is no image in colour", path,
            "name the image in colour first, as RGB, then the depth image",
        )  # fmt: skip
    return np.ascontiguousarray(values[..., :3] if "RGB" in picture.mode else np.atleast_3d(values)[..., [0, 0, 0]])


def _read(path: Path, what: str) -> Picture:
    from PIL import Image, UnidentifiedImageError

    data = read_file(path, what)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a bomb is refused below, by a limit of our own; odd metadata is not used
        try:
            image = Image.open(io.BytesIO(data), formats=FORMATS)
        except UnidentifiedImageError:
            raise ValueError(f"it is none of {', '.join(FORMATS)}") from None
        with image:
            if image.width * image.height > MAX_VALUES:
                raise ConfigError(
                    f"a {what} of {image.width} x {image.height} pixels is over the limit of {MAX_VALUES:,}", path,
                    "crop it to the object",
                )  # fmt: skip
            name = image.format or ""
            if image.mode not in ("P", "PA"):
                return Picture(np.asarray(image), image.mode, name)
            palette = np.zeros((256, 3), dtype=np.uint8)
            colours = np.asarray(image.getpalette() or [], dtype=np.uint8).reshape(-1, 3)[:256]
            palette[: len(colours)] = colours
            transparent = _transparent(image.info)
            if image.mode == "PA":
                both = np.asarray(image)
                return Picture(np.where(both[..., 1] > 0, both[..., 0], 256), "P", name, palette, frozenset({256}))
            return Picture(np.asarray(image), "P", name, palette, transparent)


def _transparent(info: Mapping[Any, Any]) -> frozenset[int]:
    alpha = info.get("transparency")
    if isinstance(alpha, int):
        return frozenset({alpha})
    return (
        frozenset(index for index, value in enumerate(alpha) if value == 0) if isinstance(alpha, bytes) else frozenset()
    )
