"""Digests of what figures depend on: the weights that come along, and the objects that families make."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from artperl.methods.estimator_folders import WEIGHTS

REPRODUCED = Path(__file__).parent / "reproduced.json"


def weights_digest(folder: str | Path) -> str:
    """Of networks, references and settings, by folder or name; not of what the settings tell about their training."""
    digest = hashlib.sha256()
    for path in sorted((WEIGHTS / folder).iterdir()):
        content = path.read_bytes()
        if path.suffix == ".json":
            settings = {name: value for name, value in json.loads(content).items() if name not in ("about", "format")}
            content = json.dumps(settings, sort_keys=True).encode()
        digest.update(hashlib.sha256(content).digest())
    return digest.hexdigest()[:12]


def family_digest(name: str) -> str:
    """Of trees and boxes of a family's objects, or of "all" families, as every processor makes them."""
    digests: dict[str, str] = json.loads(REPRODUCED.read_text(encoding="utf-8"))["families"]
    return hashlib.sha256(json.dumps(digests).encode()).hexdigest()[:12] if name == "all" else digests[name]
