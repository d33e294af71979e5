"""Pictures of objects, datasets and scenes.

Stable names; the modules of this package are private. Matplotlib and rerun are imported when first used.
"""

from typing import TYPE_CHECKING

from artsim.common.lazy import lazy_names

if TYPE_CHECKING:
    from artsim.drawing.contact_sheet import write_contact_sheet
    from artsim.drawing.gallery import draw_gallery
    from artsim.drawing.scene_overview import write_overview

__all__ = ["draw_gallery", "write_contact_sheet", "write_overview"]

_HOMES = {"write_contact_sheet": "contact_sheet", "draw_gallery": "gallery", "write_overview": "scene_overview"}
__getattr__, __dir__ = lazy_names(__name__, _HOMES)
