"""Writing a trained estimator into a folder, in half precision; :mod:`artperl.methods.estimator_files` reads it."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from artperl.core.tensor_files import write_tensors
from artperl.methods.estimator_folders import BASE, FORMAT, SETTINGS, TENSORS
from artperl.methods.protocol import Storable
from artperl.retrieval.shape_base_file import write_shape_base
from artsim.common.files import write_atomic


def save_estimator(estimator: Storable, folder: Path, about: Mapping[str, Any]) -> None:
    """Write an estimator.

    Parameters
    ----------
    estimator : Storable
    folder : Path
        Made if missing; files in it are replaced one by one.
    about : mapping
        Anything else worth knowing, in JSON's terms: what it was trained on, and how well it does.
    """
    folder.mkdir(parents=True, exist_ok=True)
    networks = estimator.networks()
    tensors = {f"{name}.{key}": t.half() for name, net in networks.items() for key, t in net.state_dict().items()}
    write_tensors(tensors, folder / TENSORS)
    write_shape_base(estimator.base, folder / BASE)
    told = {"format": FORMAT, "method": estimator.name, **estimator.settings(), "about": dict(about)}
    write_atomic(folder / SETTINGS, (json.dumps(told) + "\n").encode())


def changed_values(values: Mapping[str, Any], defaults: Mapping[str, Any]) -> dict[str, Any]:
    """The values that differ from their defaults, at every depth: an option that goes leaves no trace in files."""
    return {
        name: changed_values(value, defaults[name]) if isinstance(value, dict) else value
        for name, value in values.items()
        if value != defaults[name]
    }
