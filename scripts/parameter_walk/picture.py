"""The picture of docs/architecture.md: folders on their layers, imports between them, and routes of some parameters."""

from collections.abc import Mapping
from itertools import pairwise

from parameter_walk.code import Code
from parameter_walk.walk import walks

_WIDTH, _ROW, _BOX, _LEFT, _KEY = 900, 92, (112, 44), 40, 26
_SHIFT = 20  # to the right, of every other row, so that arrows pass between boxes
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00")


def picture(code: Code, layers: Mapping[str, int], parameters: Mapping[str, str]) -> str:
    """An SVG: a row for each layer, a box for each folder, a thin line for imports, a coloured one for each route.

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
    for name, (x, y) in places.items():
        w, h = _BOX
        parts.append(
            f'<rect x="{x - w / 2:g}" y="{y - h / 2:g}" width="{w}" height="{h}" rx="6" fill="#f4f4f4" stroke="#555"/>'
        )
        parts.append(f'<text x="{x:g}" y="{y - 6:g}" text-anchor="middle" font-size="14">{name}</text>')
    for level in sorted(set(layers.values())):
        y = next(y for name, (_, y) in places.items() if layers[name] == level)
        parts.append(f'<text x="10" y="{y + 5:g}" font-size="13" fill="#777">{level}</text>')
    keys = height - _KEY * len(parameters)
    for i, ((what, title), colour) in enumerate(zip(parameters.items(), _COLOURS, strict=True)):
        command, route = _route(code, what)
        shift = 18 * (i - (len(parameters) - 1) / 2)
        points = [(places[folder][0] + shift, places[folder][1] + 10) for folder in route if folder in places]
        parts.append(_line(points, colour, 3))
        parts += [f'<circle cx="{x:g}" cy="{y:g}" r="4" fill="{colour}"/>' for x, y in points]
        parts.append(_line([(_LEFT, keys + _KEY * i), (_LEFT + 40, keys + _KEY * i)], colour, 3))
        said = f"{title}, in {command.replace('_', '-')}: {', '.join(route)}"
        parts.append(f'<text x="{_LEFT + 50}" y="{keys + _KEY * i + 5}" font-size="14">{said}</text>')
    return "\n".join([*parts, "</svg>", ""])


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


def _line(points: list[tuple[float, float]], colour: str, width: int) -> str:
    text = " ".join(f"{x:g},{y:g}" for x, y in points)
    return f'<polyline points="{text}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-linejoin="round"/>'
