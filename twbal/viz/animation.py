"""A film as an animated GIF, which a browser and a README show without a player."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from twbal.core.files import write_atomically
from twbal.core.palette import INK

_COLOURS = 64
_MARGIN, _SIZE = 8, 13  # of captions [pixels]


def write_film(path: Path, frames: Sequence[NDArray[np.uint8]], seconds: float, captions: Sequence[str]) -> None:
    """Write frames as a GIF that runs for ever.

    Args:
        path: of the file.
        frames: (height, width, 3) each.
        seconds: that a frame is shown [s]; GIF knows hundredths.
        captions: a line for each frame.

    Raises:
        DataError: the file cannot be written.
    """
    pictures = [_captioned(frame, caption) for frame, caption in zip(frames, captions, strict=True)]
    side_by_side = np.concatenate([np.asarray(pictures[i]) for i in (0, len(pictures) // 2, -1)], axis=1)
    palette = Image.fromarray(side_by_side).quantize(_COLOURS)
    reduced = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    whole = io.BytesIO()
    duration = max(10 * round(100 * seconds), 20)
    reduced[0].save(whole, "GIF", save_all=True, append_images=reduced[1:], duration=duration, loop=0)
    write_atomically(path, whole.getvalue())


def _captioned(frame: NDArray[np.uint8], caption: str) -> Image.Image:
    picture = Image.fromarray(frame)
    draw = ImageDraw.Draw(picture)
    draw.text((_MARGIN, _MARGIN), caption, fill=INK.light, font=ImageFont.load_default(_SIZE))
    return picture
