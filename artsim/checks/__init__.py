"""Gates that an object passes before a simulator gets it.

Stable names; the modules of this package are private.
"""

from artsim.checks.validity import Gate, check, check_file

__all__ = ["Gate", "check", "check_file"]
