"""Figure 1 as one PNG: three yards of columns side by side, the farthest columns drawn first."""

import math
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from farside.dem.lab.picture import mixed, ramp
from farside.missions.figure1.example import (
    Block,
    Figure1,
    Panel,
    blocks,
    greatest_value,
)
from farside.places import Cell

_SMOOTH = 2  # supersampling: drawn so many times larger, then reduced
_CELL = 58 * _SMOOTH
_WIDTH, _HEIGHT = 880 * _SMOOTH, 700 * _SMOOTH
_TURN, _TILT = math.radians(-20), math.radians(48)
_INK, _PAPER, _SOFT = "#1f2430", "#ffffff", "#6b7280"
_SIDES = (((0, 0), (1, 0)), ((1, 0), (1, 1)), ((1, 1), (0, 1)), ((0, 1), (0, 0)))
_SHADE = (0.14, 0.30, 0.14, 0.30)  # of the sides in that order: how much darker than the top

Point = tuple[float, float]


def write_png(figure: Figure1, path: Path) -> None:
    """Draw all panels in the same view and on the same scale.

    Raises:
        OSError: if the file cannot be written.
    """
    head, foot = 110 * _SMOOTH, 110 * _SMOOTH
    sheet = Image.new("RGB", (_WIDTH * len(figure.panels), _HEIGHT + head + foot), _PAPER)
    for number, panel in enumerate(figure.panels):
        sheet.paste(_yard(figure, panel), (number * _WIDTH, head))
        _write(sheet, ((number + 0.5) * _WIDTH, head * 0.55), f"Goal {panel.goal}", 40)
    _legend(sheet, greatest_value(figure))
    small = (sheet.width // _SMOOTH, sheet.height // _SMOOTH)
    sheet.resize(small, Image.Resampling.LANCZOS).save(path)


def _yard(figure: Figure1, panel: Panel) -> Image.Image:
    picture = Image.new("RGB", (_WIDTH, _HEIGHT), _PAPER)
    drawing = ImageDraw.Draw(picture)
    rows = figure.chart.rows
    middle = len(rows[0]) / 2, len(rows) / 2
    for block in sorted(blocks(figure, panel), key=lambda block: -_away(block.cell)):
        _draw(drawing, block, middle)
    _pin(picture, figure.chart.cells[f"at:{panel.goal}"], middle, panel.goal)
    return picture


def _away(cell: Cell) -> float:
    """The distance of a cell from the viewer, who looks from the south."""
    return cell.east * math.sin(_TURN) + cell.north * math.cos(_TURN)


def _project(east: float, north: float, up: float, middle: Point) -> Point:
    x, y = east - middle[0], north - middle[1]
    across = x * math.cos(_TURN) - y * math.sin(_TURN)
    away = x * math.sin(_TURN) + y * math.cos(_TURN)
    rise = away * math.sin(_TILT) + up * math.cos(_TILT)
    return _WIDTH / 2 + across * _CELL, _HEIGHT * 0.6 - rise * _CELL


def _draw(drawing: ImageDraw.ImageDraw, block: Block, middle: Point) -> None:
    """Paint the sides of a block that face the viewer, then its top."""
    east, north = block.cell

    def corner(offset: tuple[int, int], up: float) -> Point:
        return _project(east + offset[0], north + offset[1], up, middle)

    def paint(face: list[Point], shade: float) -> None:
        drawing.polygon(face, fill=mixed(block.colour, "#000000", shade))
        edge = mixed(block.colour, "#000000", 0.45)
        drawing.line([*face, face[0]], fill=edge, width=_SMOOTH, joint="curve")

    for (start, end), shade in zip(_SIDES, _SHADE, strict=True):
        # Corners run anticlockwise, so a side that faces the viewer runs from left to right.
        if corner(start, 0)[0] < corner(end, 0)[0] and block.height:
            rising = [corner(end, block.height), corner(start, block.height)]
            paint([corner(start, 0), corner(end, 0), *rising], shade)
    paint([corner(start, block.height) for start, _ in _SIDES], 0.0)


def _pin(picture: Image.Image, cell: Cell, middle: Point, name: str) -> None:
    """Mark the goal, which has no column and may be hidden behind others."""
    foot = _project(cell.east + 0.5, cell.north + 0.5, 0, middle)
    head = _project(cell.east + 0.5, cell.north + 0.5, 4, middle)
    radius = 0.5 * _CELL
    drawing = ImageDraw.Draw(picture)
    drawing.line([foot, head], fill=_INK, width=2 * _SMOOTH)
    drawing.circle(head, radius, fill=_PAPER, outline=_INK, width=2 * _SMOOTH)
    _write(picture, head, name, 24)


def _legend(sheet: Image.Image, greatest: float) -> None:
    drawing = ImageDraw.Draw(sheet)
    width, height = 600 * _SMOOTH, 14 * _SMOOTH
    left, top = (sheet.width - width) / 2, sheet.height - 80 * _SMOOTH
    for x in range(width):
        drawing.line([(left + x, top), (left + x, top + height)], fill=ramp(x / width))
    below = top + 36 * _SMOOTH
    _write(sheet, (left, below), "0", 20)
    _write(sheet, (left + width, below), f"{greatest:.0f}", 20)
    words = "policy value: least cost from a place to the goal"
    _write(sheet, (sheet.width / 2, below), words, 20, _SOFT)


def _write(picture: Image.Image, middle: Point, words: str, size: int, colour: str = _INK) -> None:
    font = ImageFont.load_default(size * _SMOOTH)
    ImageDraw.Draw(picture).text(middle, words, fill=colour, font=font, anchor="mm")
