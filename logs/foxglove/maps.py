"""The yard as a grid, as voxels and as a scene of its named places; and where its places are."""

import msgspec
from foxglove.messages import (
    Grid,
    PackedElementField,
    PackedElementFieldNumericType,
    Vector2,
    Vector3,
    VoxelGrid,
)

from farside.logs.foxglove.names import YARD, PictureTopic
from farside.logs.foxglove.shapes import Parts, Rgb, colour, entity, scene, stamp, standing, text
from farside.messages import Tokens
from farside.node import Record
from farside.places import (
    PLACE,
    ROCK,
    SHADOW,
    WALL,
    Cell,
    cell_named,
    is_place_token,
    place_name,
)

_GREY = {WALL: 70, ROCK: 125, PLACE: 225, SHADOW: 175}
_DOCK = (90, 150, 215)
_NAMED = (205, 215, 190)
_INK: Rgb = (0.1, 0.1, 0.1)
_FIELDS = [
    PackedElementField(name=name, offset=offset, type=PackedElementFieldNumericType.Uint8)
    for offset, name in enumerate(("red", "green", "blue", "alpha"))
]
_CELL_BYTE = len(_FIELDS)


class Drawing(msgspec.Struct, frozen=True):
    """A `farside.topics.Yard` as it is drawn, which does without the names of all its places.

    Raises:
        ValueError: if it is no drawing of cells.
    """

    rows: tuple[str, ...]
    cell_m: float

    def __post_init__(self) -> None:
        if len(set(map(len, self.rows))) != 1 or not set("".join(self.rows)) <= _CELLS.keys():
            raise ValueError("expected rows of one length, of cells that can be drawn")


class Places:
    """Where the places of a yard are.

    Attributes:
        cell_m: side of a cell, 1 m before a map is known.
        named: the cells of the places that have a name of their own.
    """

    def __init__(self) -> None:
        self.cell_m = 1.0
        self.named: dict[str, Cell] = {}

    def learn(self, drawing: Drawing) -> None:
        """Take in the map."""
        self.cell_m = drawing.cell_m
        self.named = {
            name: Cell(east, north)
            for north, row in enumerate(reversed(drawing.rows))
            for east, name in enumerate(row)
            if "A" <= name <= "Z"
        }

    def cell(self, sign: Tokens) -> Cell | None:
        """The cell that a Sign speaks of; `None` if it names no known place."""
        for token in filter(is_place_token, sign):
            name = place_name(token)
            return cell_named(name) or self.named.get(name)
        return None

    def centre_m(self, cell: Cell) -> tuple[float, float]:
        """The centre of a cell, in metres east and north of the chart's south-west corner."""
        return (cell.east + 0.5) * self.cell_m, (cell.north + 0.5) * self.cell_m


def yard_pictures(
    t_ns: int, drawing: Drawing, grid: PictureTopic, floor: PictureTopic, places: PictureTopic
) -> list[Record]:
    """The three pictures of a map, each on its topic."""
    # South first, as Foxglove counts from a grid's origin.
    cells = b"".join(map(_rgba, "".join(reversed(drawing.rows))))
    columns, cell_m = len(drawing.rows[0]), drawing.cell_m
    flat = Grid(
        timestamp=stamp(t_ns),
        frame_id=YARD,
        pose=standing(0.0, 0.0),
        column_count=columns,
        cell_size=Vector2(x=cell_m, y=cell_m),
        row_stride=columns * _CELL_BYTE,
        cell_stride=_CELL_BYTE,
        fields=_FIELDS,
        data=cells,
    )
    # One layer just below the ground: no voxel of it is empty, which viewers differ on.
    height_m = 0.05 * cell_m
    layer = VoxelGrid(
        timestamp=stamp(t_ns),
        frame_id=YARD,
        pose=standing(0.0, 0.0, -height_m),
        row_count=len(drawing.rows),
        column_count=columns,
        cell_size=Vector3(x=cell_m, y=cell_m, z=height_m),
        slice_stride=len(cells),
        row_stride=columns * _CELL_BYTE,
        cell_stride=_CELL_BYTE,
        fields=_FIELDS,
        data=cells,
    )
    where = Places()
    where.learn(drawing)
    names = [
        text(name, standing(*where.centre_m(cell), 0.1 * cell_m), 0.5 * cell_m, colour(_INK))
        for name, cell in where.named.items()
    ]
    return [
        Record(grid.name, t_ns, t_ns, flat.encode()),
        Record(floor.name, t_ns, t_ns, layer.encode()),
        Record(places.name, t_ns, t_ns, scene(entity(t_ns, "places", Parts(texts=names)))),
    ]


def _rgba(character: str) -> bytes:
    return _CELLS[character]


def _cell(red: int, green: int, blue: int) -> bytes:
    return bytes((red, green, blue, 255))


_CELLS = {chr(letter): _cell(*_NAMED) for letter in range(ord("A"), ord("Z") + 1)}
_CELLS |= {character: _cell(grey, grey, grey) for character, grey in _GREY.items()}
_CELLS["D"] = _cell(*_DOCK)
