"""The colours of parts, in pictures and in files."""

import numpy as np

# Okabe and Ito's colours, told apart with any colour vision; then lighter ones.
PALETTE = np.array(
    [(0, 114, 178), (230, 159, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (213, 94, 0), (240, 228, 66),
     (110, 110, 110), (146, 108, 196), (140, 190, 90), (170, 120, 90), (90, 200, 200)]
)  # fmt: skip
"""(C, 3) red, green and blue of 0 to 255; part k has colour k modulo C."""
