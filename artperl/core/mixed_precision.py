"""Networks that learn in half the bits, where that is faster."""

import torch


def autocast(device: torch.device, wanted: bool = True) -> torch.autocast:
    """Matrix products in bfloat16, where they are wanted and the processor has them."""
    known = device.type != "cpu" or torch.ops.mkldnn._is_mkldnn_bf16_supported()
    # Weights that are kept in bfloat16 would outlive the steps that change them.
    return torch.autocast(device.type, torch.bfloat16, enabled=wanted and known, cache_enabled=False)
