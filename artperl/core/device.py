"""Where tensors are."""

import torch

from artsim.errors import ConfigError


def find_device(device: torch.device | str) -> torch.device:
    """A device by its name, such as "cuda".

    Raises
    ------
    ConfigError
        When there is none of that name, or torch cannot work on it.
    """
    if str(device).startswith("cuda") and not torch.cuda.is_available():
        raise ConfigError("torch finds no GPU here", "device", "use --device cpu, or a build of torch with CUDA")
    try:
        found = torch.device(device)
        torch.zeros(1, device=found)
    except (RuntimeError, AssertionError, NotImplementedError, TypeError) as error:
        reason = str(error).split("\n", 1)[0][:120]
        raise ConfigError(f"torch cannot work on {device!s:.40} ({reason})", "device", "use cpu or cuda") from error
    return found
