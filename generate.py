"""Generate a dataset of labelled partial point clouds: ``python generate.py --help``."""

from artsim.cli import generate_main

if __name__ == "__main__":
    generate_main()
