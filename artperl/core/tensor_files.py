"""Tensors on disk: whole files only, each with a digest of what it holds."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path

import torch
from safetensors.torch import load, save
from torch import Tensor

from artsim.common.files import read_bounded, write_atomic
from artsim.errors import DatasetError

MAX_BYTES = 4_000_000_000
_MAX_HEADER = 4_000_000
_DIGEST = "sha256"


def write_tensors(tensors: Mapping[str, Tensor], path: Path) -> str:
    """Write tensors so that the file is whole, or as before, whenever the process or the machine stops.

    Returns
    -------
    str
        Their digest, which the file holds, too.

    Raises
    ------
    ConfigError
        When the folder cannot be written to, or the disk is full.
    """
    kept = {name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}
    digest = tensors_sha256(kept)
    write_atomic(path, save(kept, {_DIGEST: digest}))
    return digest


def read_tensors(path: Path, what: str, fix: str) -> tuple[dict[str, Tensor], str]:
    """Tensors of a file and their digest.

    Parameters
    ----------
    path : Path
    what : str
        What the file holds, for messages.
    fix : str
        What to do about a file that is damaged.

    Raises
    ------
    DatasetError
        When the file is missing, too large, no safetensors file, or does not hold what was written.
    """
    try:
        data = read_bounded(path, MAX_BYTES, what, DatasetError)
    except DatasetError as error:
        raise DatasetError(error.what, path, fix) from error
    length = int.from_bytes(data[:8], "little")
    if length > _MAX_HEADER:
        raise DatasetError(f"{what} is damaged (its header cannot be so large)", path, fix)
    try:
        tensors = load(data)
        told = json.loads(data[8 : 8 + length]).get("__metadata__", {}).get(_DIGEST)
    except Exception as error:  # safetensors raises what its parser and torch stumble on in bytes that are not theirs
        raise DatasetError(f"{what} is damaged ({error})", path, fix) from error
    digest = tensors_sha256(tensors)
    if told != digest:
        raise DatasetError(f"{what} is damaged (its checksum differs)", path, fix)
    return tensors, digest


def tensors_sha256(tensors: Mapping[str, Tensor]) -> str:
    """Hex digest of tensors on the processor: of names, types, shapes and values."""
    digest = hashlib.sha256()
    for name in sorted(tensors):
        tensor = tensors[name]
        digest.update(f"{name}\0{tensor.dtype}\0{tuple(tensor.shape)}\0".encode())
        digest.update(tensor.contiguous().reshape(-1).view(torch.uint8).numpy().data)
    return digest.hexdigest()
