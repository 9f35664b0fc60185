"""The picture of docs/architecture.md: folders on their layers, imports between them, and routes of some parameters."""

import math
from collections.abc import Mapping
from itertools import pairwise

from parameter_walk.code import Code
from parameter_walk.walk import walks

_WIDTH, _ROW, _BOX, _LEFT, _KEY = 900, 92, (112, 44), 40, 26
_SHIFT = 20  # to the right, of every other row, so that arrows pass between boxes
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00")
_ARROW_AT = 0.62  # of a way between two stops

_Point = tuple[float, float]


def picture(code: Code, layers: Mapping[str, int], parameters: Mapping[str, str]) -> str:
    """An SVG: a row for each layer, a box for each folder, a thin line for imports, a coloured one for each route.

    An arrow on a coloured line says which way the parameter goes there. Words are drawn last, with a white edge, so
    that no line runs through them.

    Args:
        code: the package.
        layers: by folder.
        parameters: what is followed, and what it is called; the route is that through most modules.
    """
    places = _places(layers)
    height = _ROW * (max(layers.values()) + 1) + _KEY * len(parameters) + 30
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" font-family="sans-serif">']
    parts.append(f'<rect width="{_WIDTH}" height="{height}" fill="white"/>')
    parts += [_line([places[a], places[b]], "#bbb", 1) for a, b in sorted(_imports(code, layers))]
    w, h = _BOX
    parts += [
        f'<rect x="{x - w / 2:g}" y="{y - h / 2:g}" width="{w}" height="{h}" rx="6" fill="#f4f4f4" stroke="#555"/>'
        for x, y in places.values()
    ]
    words = [_text(x, y - 6, name, 'text-anchor="middle" font-size="14"') for name, (x, y) in places.items()]
    for level in sorted(set(layers.values())):
        y = next(y for name, (_, y) in places.items() if layers[name] == level)
        words.append(_text(10, y + 5, str(level), 'font-size="13" fill="#777"'))
    keys = height - _KEY * len(parameters)
    for i, ((what, title), colour) in enumerate(zip(parameters.items(), _COLOURS, strict=True)):
        command, route = _route(code, what)
        shift = 18 * (i - (len(parameters) - 1) / 2)
        points = [(places[folder][0] + shift, places[folder][1] + 10) for folder in route if folder in places]
        begin, end = (_LEFT, keys + _KEY * i), (_LEFT + 40, keys + _KEY * i)
        parts += [*_way(points, colour), _line([begin, end], colour, 3), _arrow(begin, end, colour)]
        said = f"{title}, in {command.replace('_', '-')}: {', '.join(route)}"
        words.append(_text(_LEFT + 50, keys + _KEY * i + 5, said, 'font-size="14"'))
    return "\n".join([*parts, *words, "</svg>", ""])


def _places(layers: Mapping[str, int]) -> dict[str, tuple[float, float]]:
    """Middle of each folder's box; the highest layer is at the top."""
    found, top = {}, max(layers.values())
    for level in sorted(set(layers.values())):
        row = [name for name in layers if layers[name] == level]
        for i, name in enumerate(row):
            x = _LEFT + (_WIDTH - _LEFT - _SHIFT) * (i + 0.5) / len(row)
            found[name] = (x + _SHIFT * (level % 2) * (len(row) > 1), _ROW * (top - level + 0.5))
    return found


def _imports(code: Code, layers: Mapping[str, int]) -> set[tuple[str, str]]:
    """Folders that import each other, and no lower one on the way."""
    found = {
        (module.split("/")[0], place.split("/")[0])
        for module, names in code.imports.items()
        for place in names.values()
        if module.split("/")[0] in layers and place.split("/")[0] in layers
    }
    apart = {(a, b) for a, b in found if a != b}
    return {(a, b) for a, b in apart if not any((a, c) in apart and (c, b) in apart for c in layers)}


def _route(code: Code, what: str) -> tuple[str, list[str]]:
    """Command through which a parameter visits most modules, and the folders on its way."""
    command, walk = next(iter(walks(code, what).items()))
    folders = [stop.module.split("/")[0] for stop in walk.stops]
    return command, [folders[0], *(after for before, after in pairwise(folders) if after != before)]


def _line(points: list[_Point], colour: str, width: int) -> str:
    text = " ".join(f"{x:g},{y:g}" for x, y in points)
    return f'<polyline points="{text}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-linejoin="round"/>'


def _way(points: list[_Point], colour: str) -> list[str]:
    """A route with a dot at each stop, and an arrow for each way between two stops."""
    dots = [f'<circle cx="{x:g}" cy="{y:g}" r="4" fill="{colour}"/>' for x, y in dict.fromkeys(points)]
    return [_line(points, colour, 3), *dots, *(_arrow(*ends, colour) for ends in dict.fromkeys(pairwise(points)))]


def _arrow(begin: _Point, end: _Point, colour: str) -> str:
    """An arrowhead beyond the middle of a line, so that those of both ways stand apart."""
    along, across = end[0] - begin[0], end[1] - begin[1]
    x, y = begin[0] + _ARROW_AT * along, begin[1] + _ARROW_AT * across
    turn = math.degrees(math.atan2(across, along))
    return f'<path d="M-6,-6 L8,0 L-6,6 Z" fill="{colour}" transform="translate({x:.1f},{y:.1f}) rotate({turn:.1f})"/>'


def _text(x: float, y: float, words: str, style: str) -> str:
    """Words with a white edge that hides the lines behind them."""
    edge = 'stroke="white" stroke-width="4" stroke-linejoin="round" paint-order="stroke"'
    return f'<text x="{x:g}" y="{y:g}" {style} {edge}>{words}</text>'
