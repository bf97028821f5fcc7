"""Where the toolbar's widgets are: rows of groups, which fold away where there is no room for them."""

from collections.abc import Sequence
from typing import Final

from pygame import Rect

WIDE: Final = 4  # width of a widget that can be made wider, in heights of the toolbar
MAX_WIDENED: Final = 3  # to how many times its width
BETWEEN: Final = 2  # px between two widgets
NOWHERE: Final = Rect(0, 0, 0, 0)  # of a widget that is folded away
Widths = Sequence[Sequence[float]]  # of widgets by group, in heights of the toolbar; a group's first is its name


def open_groups(groups: Widths, by_hand: Sequence[bool | None], side: int, room: int) -> frozenset[int]:
    """Return the groups that are unfolded: those unfolded by hand, and as many others as one row has room for.

    by_hand: for each group, whether it was unfolded or folded by hand; None if neither. side: height of the toolbar,
    px; room: width of a row, px.
    """
    opened = {number for number, chosen in enumerate(by_hand) if chosen}
    left = room - (len(groups) - 1) * _between_groups(side) - sum(round(group[0] * side) for group in groups)
    for number, group in enumerate(groups):
        more = BETWEEN + _length([round(share * side) for share in group[1:]])
        if by_hand[number] is None and more <= left:
            opened.add(number)
            left -= more
    return frozenset(opened)


def tool_places(groups: Widths, opened: frozenset[int], corner: tuple[int, int], side: int, room: int) -> list[Rect]:
    """Return the place of each widget, px: each group is in the first row with room for it.

    Wide widgets fill what the others leave of a row. corner: upper left of the first row.
    """
    rows: list[list[Rect]] = [[]]
    placed: list[list[Rect]] = []  # by group
    for number, group in enumerate(groups):
        widths = [round(share * side) for share in (group if number in opened else group[:1])]
        fits = (k for k, row in enumerate(rows) if _end(row, side) + _length(widths) <= room)
        k = next(fits, len(rows) if rows[-1] else len(rows) - 1)
        placed.append([])
        x = 0
        for number_in_group, width in enumerate(widths):
            if k == len(rows):
                rows.append([])
            if not number_in_group:
                x = _end(rows[k], side)
            elif x + width > room:
                k, x = len(rows), 0
                rows.append([])
            place = Rect(x, k * (side + BETWEEN), width, side)
            rows[k].append(place)
            placed[-1].append(place)
            x += width + BETWEEN
    for row in rows:
        _fill(row, room)
        for place in row:
            place.move_ip(corner)
    return [
        place
        for group, places in zip(groups, placed, strict=True)
        for place in [*places, *[NOWHERE] * (len(group) - len(places))]
    ]


def _between_groups(side: int) -> int:
    return BETWEEN + side // 3


def _end(row: Sequence[Rect], side: int) -> int:
    """Return where a row's next group begins, px."""
    return row[-1].right + _between_groups(side) if row else 0


def _length(widths: Sequence[int]) -> int:
    """Return the width of a group, px."""
    return sum(widths) + BETWEEN * (len(widths) - 1)


def _fill(row: Sequence[Rect], room: int) -> None:
    """Widen the wide widgets of a row so that it ends at the right."""
    wide = [place for place in row if place.width > WIDE * place.height]
    spare, shift = (room - row[-1].right) if row else 0, 0
    for place in row:
        place.x += shift
        if any(place is one for one in wide):
            more = max(0, min(spare // len(wide), (MAX_WIDENED - 1) * place.width))
            place.width += more
            shift += more
