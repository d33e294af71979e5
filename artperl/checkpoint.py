"""Trained estimators on disk: a folder with weights (safetensors), settings (JSON) and the base of references (npz).

Weights are kept in half precision. Nothing in the folder is executed when it is read.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load_file, save_file
from torch import Tensor, nn

from artperl.estimate import Calibration
from artperl.estimator import Estimator
from artperl.networks.agent import Agent
from artperl.networks.boxes import Boxes
from artperl.networks.perception import Perception
from artperl.refine import RefineOptions
from artperl.retrieval import ShapeBase
from artperl.search import EstimatorOptions
from artsim.errors import ConfigError, DatasetError
from artsim.files import write_atomic

WEIGHTS = Path(__file__).parent / "weights"
"""Folder of the estimators that come with the package."""

_FORMAT = 1
_SETTINGS, _TENSORS, _BASE = "estimator.json", "weights.safetensors", "base.npz"


def save_estimator(estimator: Estimator, folder: Path, about: Mapping[str, Any]) -> None:
    """Write an estimator.

    Parameters
    ----------
    estimator : Estimator
    folder : Path
        Made if missing; files in it are replaced one by one.
    about : mapping
        Anything else worth knowing, in JSON's terms: what it was trained on, and how well it does.
    """
    folder.mkdir(parents=True, exist_ok=True)
    networks: dict[str, nn.Module] = {"perception": estimator.perception}
    if estimator.agent is not None:
        networks["agent"] = estimator.agent
    if estimator.boxes is not None:
        networks["boxes"] = estimator.boxes
    tensors = {f"{name}.{key}": t.half() for name, net in networks.items() for key, t in net.state_dict().items()}
    save_tensors(tensors, folder / _TENSORS)
    part = folder / f".{_BASE}"
    estimator.base.save(part)
    part.replace(folder / _BASE)
    settings = {
        "format": _FORMAT,
        "perception": {name: getattr(estimator.perception, name) for name in ("num_rows", "width", "votes")},
        "agent": None if estimator.agent is None else {"width": estimator.agent.width},
        "boxes": None
        if estimator.boxes is None
        else {"num_rows": estimator.boxes.num_rows, "width": estimator.boxes.width},
        "options": asdict(estimator.options),
        "calibration": asdict(estimator.calibration),
        "about": dict(about),
    }
    write_atomic(folder / _SETTINGS, (json.dumps(settings) + "\n").encode())


def load_estimator(name: str | Path, device: torch.device | str = "cpu", **changes: Any) -> Estimator:
    """An estimator by its folder, or one that comes with the package by its name, such as "laptop".

    Parameters
    ----------
    name : str or Path
    device : torch.device or str
        Where it works, such as "cuda".
    **changes
        Of its :class:`~artperl.search.EstimatorOptions`, such as ``seen_from=(-75.0, 75.0)``.

    Raises
    ------
    ConfigError
        When there is no such option.
    DatasetError
        When there is no such estimator, or its files are damaged.
    """
    unknown = ", ".join(changes.keys() - {field.name for field in fields(EstimatorOptions)})
    if unknown:
        raise ConfigError("an estimator has no such option", unknown, "see artperl.search.EstimatorOptions")
    folder = folder_of(name)
    settings = read_settings(folder)
    try:
        tensors = load_file(folder / _TENSORS)
        perception = Perception(**settings["perception"])
        perception.load_state_dict(_under(tensors, "perception."))
        agent = None if settings["agent"] is None else Agent(**settings["agent"])
        if agent is not None:
            agent.load_state_dict(_under(tensors, "agent."))
            agent.to(device)
        boxes = None if settings.get("boxes") is None else Boxes(**settings["boxes"])
        if boxes is not None:
            boxes.load_state_dict(_under(tensors, "boxes."))
        options: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in settings["options"].items()}
        options["refine"] = RefineOptions(**options["refine"])
        return Estimator(
            perception.to(device), ShapeBase.load(folder / _BASE), agent, EstimatorOptions(**(options | changes)),
            Calibration(**settings["calibration"]), boxes,
        )  # fmt: skip
    except (OSError, KeyError, TypeError, RuntimeError, SafetensorError) as error:
        raise DatasetError(f"the estimator does not load: {error}", folder, "train it again") from error


def folder_of(name: str | Path) -> Path:
    """Folder of an estimator. One that comes with the package is not hidden by a folder of that name without any."""
    own = Path(name)
    return WEIGHTS / name if (WEIGHTS / name).is_dir() and not (own / _SETTINGS).is_file() else own


def read_settings(folder: Path) -> dict[str, Any]:
    """Settings of the estimator in a folder.

    Raises
    ------
    DatasetError
        When there is none, or it was written by another version.
    """
    try:
        settings: dict[str, Any] = json.loads((folder / _SETTINGS).read_text())
    except (OSError, ValueError) as error:
        shipped = ", ".join(sorted(path.parent.name for path in WEIGHTS.glob(f"*/{_SETTINGS}"))) or "none"
        raise DatasetError(
            "there is no estimator", folder, f"train one, or use one that comes with the package: {shipped}"
        ) from error
    if settings.get("format") != _FORMAT:
        raise DatasetError(f"format {settings.get('format')} is not {_FORMAT}", folder, "train it again")
    return settings


def save_tensors(tensors: Mapping[str, Tensor], path: Path) -> None:
    """Write tensors so that a stop halfway leaves the old file."""
    part = path.with_name(f".{path.name}")
    save_file({name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}, part)
    part.replace(path)


def _under(tensors: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    """Tensors whose names begin with a prefix, without it."""
    return {name.removeprefix(prefix): tensor for name, tensor in tensors.items() if name.startswith(prefix)}
