"""Processors that this one can stand in for: the variables by which libraries choose code for older instructions.

``python -m tests.processors "with SSE4" make check`` runs a command as on another processor. It prints which processors
there are where none is named.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping

from numpy._core._multiarray_umath import __cpu_features__

NO_AVX512 = "X86_V4 AVX512_ICL AVX512_SPR"
PROCESSORS: dict[str, dict[str, str]] = {
    "with AVX-512": {
        "OPENBLAS_CORETYPE": "SkylakeX",
        "NUMBA_CPU_NAME": "skylake-avx512",
        "ATEN_CPU_CAPABILITY": "avx512",
    },
    "with AVX2": {
        "OPENBLAS_CORETYPE": "Haswell",
        "NPY_DISABLE_CPU_FEATURES": NO_AVX512,
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX512F,-AVX512VL",
        "NUMBA_CPU_NAME": "haswell",
        "ATEN_CPU_CAPABILITY": "avx2",
        "ONEDNN_MAX_CPU_ISA": "AVX2",
        "MKL_ENABLE_INSTRUCTIONS": "AVX2",
    },
    "with SSE4": {
        "OPENBLAS_CORETYPE": "Nehalem",
        "NPY_DISABLE_CPU_FEATURES": f"X86_V3 {NO_AVX512}",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX,-AVX2,-FMA,-FMA4,-AVX512F,-AVX512VL",
        "NUMBA_CPU_NAME": "nehalem",
        "ATEN_CPU_CAPABILITY": "default",
        "ONEDNN_MAX_CPU_ISA": "SSE41",
        "MKL_ENABLE_INSTRUCTIONS": "SSE4_2",
    },
}
"""What each kind of processor makes of BLAS, NumPy, the C library, numba and torch, the newest kind first."""
for _variables in PROCESSORS.values():
    _variables["NUMBA_CPU_FEATURES"] = ""  # those of the processor that is named, and none of this one's

NEEDS = {"with AVX-512": "X86_V4", "with AVX2": "X86_V3", "with SSE4": "X86_V2"}
"""The level of x86-64, by NumPy's name, whose instructions the code of each kind consists of."""
EMBREE = {"with AVX-512": "avx512", "with AVX2": "avx2", "with SSE4": "sse4.2"}
"""The code that Embree chooses on each kind."""


def can_run(name: str, features: Mapping[str, bool] = __cpu_features__) -> bool:
    """Whether a processor with these features, by NumPy's names, has the instructions of a kind of processor.

    NumPy leaves out what ``NPY_DISABLE_CPU_FEATURES`` names: with AVX-512 there, nothing runs AVX-512.
    """
    return bool(features.get(NEEDS[name]))


def left_out(name: str) -> str:
    """Why the code of a kind of processor is not run here."""
    return f"{name}: not run, since this processor has no {NEEDS[name]} (or NPY_DISABLE_CPU_FEATURES names it)"


def main() -> None:
    """Run a command as a kind of processor runs it."""
    known = ", ".join(f'"{name}"' for name in PROCESSORS if can_run(name))
    if len(sys.argv) < 3 or sys.argv[1] not in PROCESSORS:
        sys.exit(f"usage: python -m tests.processors NAME COMMAND...\nthis processor can be one {known}")
    name, *command = sys.argv[1:]
    if not can_run(name):
        sys.exit(f"{left_out(name)}. Fix: choose one of {known}")
    sys.exit(subprocess.run(command, env=os.environ | PROCESSORS[name]).returncode)


if __name__ == "__main__":
    main()
