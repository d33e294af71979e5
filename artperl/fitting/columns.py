"""Where each parameter stands in a step of the refinement."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Columns:
    """Where each parameter of a step stands, for trees of P rows.

    The first are a turn about the middle of the cloud (3), radians, and a motion (3), metres.

    Steps of rigid references end after the states; steps whose axes stay end after the shifts.
    """

    num_rows: int
    """P."""

    @property
    def state(self) -> slice:
        """States of the joints (P)."""
        return slice(6, 6 + self.num_rows)

    @property
    def log_scale(self) -> slice:
        """Logarithm of the reference's scale along each axis (3)."""
        return slice(6 + self.num_rows, 9 + self.num_rows)

    @property
    def stretch(self) -> slice:
        """Logarithm of each part's own scale (3 P)."""
        return slice(9 + self.num_rows, 9 + 4 * self.num_rows)

    @property
    def shift(self) -> slice:
        """Shifts of the joints' anchors (3 P)."""
        return slice(9 + 4 * self.num_rows, 9 + 7 * self.num_rows)

    @property
    def lean(self) -> slice:
        """Rotation vectors of the joints' axes (3 P)."""
        return slice(9 + 7 * self.num_rows, 9 + 10 * self.num_rows)
