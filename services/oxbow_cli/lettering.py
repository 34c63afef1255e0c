"""Fonts for pictures: names of sites and vehicles may be in any script."""

from __future__ import annotations

import logging
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

from matplotlib import font_manager, rc_context, rcParams

__all__ = ["lettering"]

_FALLBACK_FONTS = (
    "Noto Sans",
    "Noto Sans CJK SC",
    "Noto Sans CJK JP",
    "Noto Sans Arabic",
    "Noto Sans Devanagari",
    "Droid Sans Fallback",
    "WenQuanYi Zen Hei",
    "Microsoft YaHei",
    "Hiragino Sans",
    "Arial Unicode MS",
)
_MISSING_GLYPH = re.compile(r"Glyph (\d+) .* missing from ")
_log = logging.getLogger(__name__)


@contextmanager
def lettering() -> Iterator[None]:
    """Within this context, text is drawn in fonts that have its characters; a note names those without any."""
    installed = set(font_manager.get_font_names())
    families = [*rcParams["font.sans-serif"][:1], *(name for name in _FALLBACK_FONTS if name in installed)]
    with warnings.catch_warnings(record=True) as caught, rc_context({"font.family": families}):
        warnings.simplefilter("always")
        yield
    missing = set()
    for warning in caught:
        if match := _MISSING_GLYPH.match(str(warning.message)):
            missing.add(chr(int(match[1])))
        else:
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
    if missing:
        _log.warning("note: no installed font has %s: drawn as boxes", "".join(sorted(missing)))
