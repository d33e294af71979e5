"""What an estimate takes of torch: one thread, and single precision, whatever the program around it has set."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch


@contextmanager
def single_precision() -> Iterator[None]:
    """New tensors are of the precision that networks are trained in; also a decorator."""
    before = torch.get_default_dtype()
    torch.set_default_dtype(torch.float32)
    try:
        yield
    finally:
        torch.set_default_dtype(before)


@contextmanager
def steady_torch() -> Iterator[None]:
    """Torch works on one thread, in single precision.

    An estimate is thousands of small operations. A second thread hardly helps with them, and where another process has
    its core, all wait for it: four times as long.
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with single_precision():
            yield
    finally:
        torch.set_num_threads(threads)
