"""A folder or a file has one writer."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from artsim.runs.lock import file_lock


def test_a_locked_file_has_one_writer(tmp_path: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from artsim.runs.lock import file_lock; path = Path(sys.argv[1])\n"
        "with path.open('a+b') as file, file_lock(file, path): pass"
    )
    path = tmp_path / "lines.jsonl"
    with path.open("a+b") as file, file_lock(file, path):
        child = subprocess.run([sys.executable, "-c", program, path], capture_output=True, text=True, check=False)
        assert "another program writes to it" in child.stderr
    subprocess.run([sys.executable, "-c", program, path], check=True)
