"""Train and test a pose estimator in one loop: ``python train.py --help``."""

from artperl.cli import train_main

if __name__ == "__main__":
    train_main()
