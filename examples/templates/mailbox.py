"""Mailboxes: a box on a post, with a door that drops down and sometimes a flag that turns up.

What varies: sizes, the height of the post, and whether there is a flag.
"""

from artsim.families.details import knob
from artsim.making.assembly import Assembly, revolute
from artsim.making.draws import Draws
from artsim.making.solids import box, tray

GAP = 0.002


def build(draws: Draws) -> Assembly:
    depth, width = draws.length("depth", (0.4, 0.6)), draws.length("width", (0.15, 0.25))
    height = draws.length("box_height", (0.15, 0.3))
    post = draws.length("post_height", (0.6, 1.2))
    front = -depth / 2
    body = tray((front, -width / 2, post), (depth / 2, width / 2, post + height), 0.004, axis=0, side=-1)
    body += box(0.04, 0.04, (0, post + 0.002))
    mailbox = Assembly("body", body, density=2700.0)

    door = box((front - 0.012, front - GAP), width / 2, (post, post + height), fillet=0.004)
    door += knob((front - 0.012, 0, post + 0.8 * height), (-1, 0, 0), 0.015, 0.01)
    hinge = revolute("body", (0, -1, 0), (front - 0.012, 0, post), 0.0, draws.angle("door_angle", (1.2, 1.57)))
    mailbox.add("door", door, hinge)

    if draws.chance("flag", 0.6):
        side = width / 2 + GAP
        low = post + 0.5 * height
        flag = box((-0.02, 0.1), (side, side + 0.004), (low, low + 0.03))
        turn = revolute("body", (0, -1, 0), (-0.01, side, low + 0.015), 0.0, 1.57)
        mailbox.add("flag", flag, turn)
    return mailbox
