"""What all pages share: one HTML file that needs nothing but a browser, with figures inside, in light and dark."""

import re
from importlib import resources
from math import degrees
from typing import Any

from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup

from twbal.core.palette import PALETTE
from twbal.viz.short_names import short_names

_PROLOGUE = re.compile(r"^.*?(?=<svg )|<metadata>.*?</metadata>", re.DOTALL)
_FIXED_SIZE = re.compile(r' (?:width|height)="[\d.]+pt"')
_WIDTH = re.compile(r'<svg [^>]*?width="([\d.]+)pt"')
_PIXELS_PER_POINT = 1.35  # of every figure, so that their letters are of one size
_NARROWEST = 0.6  # of that, to which a narrow window shrinks a figure; beyond, it scrolls
_ID = re.compile(r'(\bid="|href="#|url\(#)')


def render(template: str, **content: Any) -> str:
    """The page that a template beside this file makes of its content; the same content gives the same text."""
    pages = Environment(
        loader=FunctionLoader(_source), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    pages.filters |= {"degrees": degrees, "number": number, "percent": percent, "short_names": short_names}
    return pages.get_template(template).render(palette=PALETTE, **content)


def inline(svg: str | None, name: str, label: str) -> Markup | None:
    """An SVG as it can stand in the page: to the scale of all figures, in its colours, with ids that no other has.

    None, where there is nothing to draw, stays None.
    """
    if svg is None:
        return None
    width = _WIDTH.search(svg)
    size = ""
    if width:
        pixels = _PIXELS_PER_POINT * float(width[1])
        size = f' style="max-width: {pixels:.0f}px; min-width: {_NARROWEST * pixels:.0f}px"'
    text = _FIXED_SIZE.sub("", _PROLOGUE.sub("", svg))
    text = _ID.sub(rf"\g<1>{name}-", text)
    for colour in PALETTE:
        text = text.replace(colour.light, f"var(--{colour.name})")
    # Safe: drawn by this package, in which every text went through an XML writer.
    return Markup(text.replace("<svg ", f'<svg role="img" aria-label="{label}"{size} ', 1))


def number(value: float | None, form: str) -> str:
    """A figure of a table; a dash where it was not measured."""
    return "–" if value is None else format(value, form)


def percent(share: float | None) -> str:
    """A share in per cent; a dash where it was not measured."""
    return "–" if share is None else f"{100 * share:z.0f}\u00a0%"


def _source(template: str) -> str:
    return resources.files("twbal.viz").joinpath(template).read_text(encoding="utf-8")
