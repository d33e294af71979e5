"""A process that torchrun starts: ``one_of_several.py OUT OPTIONS [die]``; see ``test_ranks.py``.

It dies once with each number of processes.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from pathlib import Path

from artperl.training.options import changed, preset_of
from artperl.training.run import Training

if __name__ == "__main__":
    out, changes = Path(sys.argv[1]), json.loads(sys.argv[2])
    rank = os.environ.get("RANK", "0")

    def die(group: str, figures: dict[str, float], step: int) -> None:
        """Once, as a process that a machine's owner kills, after the step that follows the first validation."""
        died = out.parent / f"died_of_{os.environ.get('WORLD_SIZE', '1')}"
        if sys.argv[3:] and group == "perception" and step == 2 and not died.exists():
            died.write_text(rank)
            os.kill(os.getpid(), signal.SIGKILL)

    training = Training(
        changed(preset_of(changes.get("method", "full"), "quick"), changes), out, 1, progress=False, report=die
    )
    figures = training.run()
    (out.parent / f"{rank}.json").write_text(json.dumps(figures))
    training.context.ranks.close()
