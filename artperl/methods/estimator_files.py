"""Trained estimators on disk: a folder with weights (safetensors), settings (JSON) and the base of references (npz).

Weights are kept in half precision. Nothing in the folder is executed when it is read.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast, overload

import torch
from torch import Tensor, nn

from artperl.boxes.network import Boxes
from artperl.core.confidence import Calibration, PartCalibration
from artperl.core.device import find_device
from artperl.core.tensor_files import MAX_BYTES, read_tensors
from artperl.core.threads import single_precision
from artperl.fitting.options import EstimatorOptions
from artperl.methods import STORED_METHODS, method_of
from artperl.methods.estimator_folders import (
    AGAIN,
    BASE,
    SETTINGS,
    TENSORS,
    WEIGHTS,
    folder_of,
    read_settings,
)  # fmt: skip
from artperl.methods.full import Estimator
from artperl.methods.protocol import Stored, Untrained
from artperl.perception.network import Perception
from artperl.retrieval.box_embedding import EMBEDDED
from artperl.retrieval.shape_base_file import read_shape_base
from artsim.common.files import read_bounded
from artsim.common.json_records import from_json_values
from artsim.common.names import printable
from artsim.errors import ConfigError, DatasetError
from artsim.model.objects import MAX_PARTS

if TYPE_CHECKING:
    from artperl.methods.artperl import ArtPERL

_GONE = {"occluded_parts"}
"""Options that files of former versions may name: they are passed over."""


@overload
def load_estimator(
    name: str | Path, method: Literal["full"] = "full", device: torch.device | str = "cpu", **changes: Any
) -> Estimator: ...


@overload
def load_estimator(
    name: str | Path, method: Literal["artperl"], device: torch.device | str = "cpu", **changes: Any
) -> ArtPERL: ...


@overload
def load_estimator(
    name: str | Path, method: str, device: torch.device | str = "cpu", **changes: Any
) -> Estimator | Stored | Untrained: ...


@single_precision()
def load_estimator(
    name: str | Path, method: str = "full", device: torch.device | str = "cpu", **changes: Any
) -> Estimator | Stored | Untrained:
    """An estimator by its folder, or one that comes with the package by its name, such as "laptop".

    Parameters
    ----------
    name : str or Path
        For a method that needs no training, a category.
    method : str
        full, which comes with the package; artperl (the paper's), which does for the categories of ArtImage; ancsh,
        omad or sporeagent, which you train yourself: a folder of your own; or one that you add to
        :data:`artperl.methods.METHODS`.
    device : torch.device or str
        Where it works, such as "cuda".
    **changes
        Of its options, such as ``seen_from=(-75.0, 75.0)``, degrees, where the camera is known to be in front of the
        object. :class:`artperl.fitting.options.EstimatorOptions` has them all.

    Raises
    ------
    ConfigError
        When there is no such option, or no such device.
    DatasetError
        When there is no such estimator, or its files are damaged.
    """
    kind, device = method_of(method), find_device(device)
    if method in STORED_METHODS and kind is not Estimator:
        return _load_stored(cast(type[Stored], kind), name, device, changes)
    if kind is not Estimator:
        return cast(type[Untrained], kind).of_category(str(name))
    unknown = ", ".join(changes.keys() - {field.name for field in fields(EstimatorOptions)})
    if unknown:
        raise ConfigError("an estimator has no such option", unknown, "see artperl.fitting.options.EstimatorOptions")
    folder = folder_of(name)
    settings = read_settings(folder)
    _check_method(settings, method, folder)
    try:
        sizes = _Sizes(
            from_json_values(_PerceptionSize, settings.get("perception")),
            None if settings.get("boxes") is None else from_json_values(_BoxesSize, settings["boxes"]),
        )
        told = settings.get("options")
        known = {name: told[name] for name in told if name not in _GONE} if isinstance(told, dict) else told
        options = replace(from_json_values(EstimatorOptions, known), **changes)
        calibration = from_json_values(Calibration, settings.get("calibration"))
        part_calibration = from_json_values(PartCalibration, settings.get("part_calibration"))
    except ValueError as error:
        raise DatasetError(f"{SETTINGS} is damaged: {error}", folder, AGAIN) from error
    tensors, _ = read_tensors(folder / TENSORS, "the file of weights", AGAIN)
    for key, shape in sizes.largest.items():  # a forged width takes no memory before it is that of the weights
        if key not in tensors or tensors[key].shape != shape:
            raise DatasetError(f"the estimator does not load: {key} is not of shape {shape}", folder, AGAIN)
    networks = sizes.networks()
    _check_fit(networks, tensors, folder)
    for key, network in networks.items():
        network.load_state_dict(_under(tensors, f"{key}."))
        network.to(device)
    base = read_shape_base(folder / BASE)
    if base.embeddings is not None and base.embeddings.shape[1] != EMBEDDED * base.shapes.trees.num_rows:
        raise DatasetError("its embeddings are not of its objects", folder / BASE, AGAIN)
    perception, boxes = networks["perception"], networks.get("boxes")
    assert isinstance(perception, Perception)
    assert isinstance(boxes, Boxes | None)
    return Estimator(perception, base, options, calibration, boxes, part_calibration)


def _load_stored(
    kind: type[Stored], name: str | Path, device: torch.device | str, changes: Mapping[str, Any]
) -> Stored:
    """A method of :data:`artperl.methods.STORED_METHODS`, from a folder, or one that comes with the package."""
    folder = folder_of(name, kind.name)
    if changes:
        raise ConfigError(f"the method {kind.name} has no such option", ", ".join(changes), "leave it out")
    if not (folder / SETTINGS).exists():
        category = str(name) if folder_of(name).parent == WEIGHTS else "laptop"
        raise DatasetError(
            f"there is no estimator of the method {kind.name}", name,
            f"train it: artperl train --category {category} --method {kind.name} --preset long",
        )  # fmt: skip
    settings = read_settings(folder)
    _check_method(settings, kind.name, folder)
    base, (tensors, _) = read_shape_base(folder / BASE), read_tensors(folder / TENSORS, "the file of weights", AGAIN)
    try:
        with torch.device("meta"):  # a forged size takes no memory before it is that of the weights
            networks = kind.of_settings(settings, base).networks()
        _check_fit(networks, tensors, folder)
        method = kind.of_settings(settings, base)
    except ValueError as error:
        raise DatasetError(f"{SETTINGS} is damaged: {error}", folder, AGAIN) from error
    for key, network in method.networks().items():
        network.load_state_dict(_under(tensors, f"{key}."))
    return method.to(device)


def _check_method(settings: Mapping[str, Any], method: str, folder: Path) -> None:
    """Refuse the estimator of another method.

    Raises
    ------
    DatasetError
    """
    found = settings.get("method", "full")
    if found != method:
        raise DatasetError(
            f"this is an estimator of the method {found!r:.20}, not {method}", folder, f"ask for --method {found!s:.20}"
        )


def stored_method(name: str | Path) -> str:
    """Name of the method that an estimator's folder holds; see :func:`load_estimator`.

    Raises
    ------
    DatasetError
        When there is no such estimator, or it is of no known method.
    """
    folder = folder_of(name)
    found = read_settings(folder).get("method", "full")
    if found not in STORED_METHODS:
        raise DatasetError(f"this is an estimator of an unknown method, {found!r:.40}", folder, AGAIN)
    return str(found)


_MAX_ROWS, _MAX_WIDTH = MAX_PARTS, 2048


def _check_size(value: int, most: int, what: str) -> None:
    if not 1 <= value <= most:
        raise ValueError(f"{what} is {value}, not 1 to {most}")


@dataclass(frozen=True)
class _PerceptionSize:
    num_rows: int
    width: int = 48
    votes: bool = False

    def __post_init__(self) -> None:
        _check_size(self.num_rows, _MAX_ROWS, "num_rows")
        _check_size(self.width, _MAX_WIDTH, "width")


@dataclass(frozen=True)
class _BoxesSize:
    num_rows: int
    width: int = 80

    def __post_init__(self) -> None:
        _check_size(self.num_rows, _MAX_ROWS, "num_rows")
        _check_size(self.width, _MAX_WIDTH, "width")


@dataclass(frozen=True)
class _Sizes:
    """Sizes of an estimator's networks."""

    perception: _PerceptionSize
    boxes: _BoxesSize | None

    @property
    def largest(self) -> dict[str, tuple[int, int]]:
        """Shape of a tensor of each network that is among its largest, by its name."""
        shapes = {"perception.backbone.whole.0.weight": (8 * self.perception.width, 8 * self.perception.width)}
        if self.boxes is not None:
            shapes["boxes.among.0.weight"] = self.boxes.width, 6 * self.boxes.width
        return shapes

    def networks(self) -> dict[str, nn.Module]:
        """New networks of these sizes, by name."""
        networks: dict[str, nn.Module] = {"perception": Perception(**asdict(self.perception))}
        if self.boxes is not None:
            networks["boxes"] = Boxes(**asdict(self.boxes))
        return networks


def _check_fit(networks: Mapping[str, nn.Module], tensors: Mapping[str, Tensor], folder: Path) -> None:
    """Refuse tensors that are not exactly those of the networks, or are not finite.

    Raises
    ------
    DatasetError
    """
    wanted = {f"{key}.{name}": t.shape for key, net in networks.items() for name, t in net.state_dict().items()}
    problem = None
    if wanted.keys() != tensors.keys():
        problem = f"{printable(min(wanted.keys() ^ tensors.keys()))} is in only one of {SETTINGS} and {TENSORS}"
    else:
        for name, tensor in tensors.items():
            if tensor.shape != wanted[name] or not tensor.dtype.is_floating_point:
                problem = f"{name} is {tensor.dtype} of shape {tuple(tensor.shape)}, not {tuple(wanted[name])}"
            elif not bool(torch.isfinite(tensor).all()):
                problem = f"{name} is not finite"
    if problem is not None:
        raise DatasetError(f"the estimator does not load: {problem}", folder, AGAIN)


def weights_sha256(folder: Path) -> str:
    """Digest of the weights of the estimator in a folder, by which its children name it.

    Raises
    ------
    DatasetError
        When there are none.
    """
    return hashlib.sha256(read_bounded(folder / TENSORS, MAX_BYTES, "weights", DatasetError)).hexdigest()


def _under(tensors: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    """Tensors whose names begin with a prefix, without it."""
    return {name.removeprefix(prefix): tensor for name, tensor in tensors.items() if name.startswith(prefix)}
