"""Train and test a pose estimator in one loop: ``python train.py --help``."""

import sys
from pathlib import Path

if __name__ == "__main__":  # worker processes import this file, too, and want none of it
    try:
        from artperl.commands.verbs import train_main
    except ModuleNotFoundError as missing:  # a clone in which nothing has been installed yet
        fix = f"pip install -e '{Path(__file__).resolve().parent}[train]'"
        print(f"error: {missing.name} is not installed. Fix: {fix}", file=sys.stderr)
        sys.exit(2)
    train_main()
