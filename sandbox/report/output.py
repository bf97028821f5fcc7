"""Text as commands print it, and JSON as they write it."""

import io
import json
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from sandbox.errors import SandboxError, shown

if TYPE_CHECKING:  # slow to import
    from rich.console import Console

DEFAULT_WIDTH: Final = 80  # columns of text for a script


def console(**options: Any) -> "Console":
    """Return a Rich console that prints [red] and :smile: verbatim. options: others of Rich."""
    from rich.console import Console  # noqa: PLC0415

    return Console(highlight=False, markup=False, emoji=False, **options)


def text_of(show: "Callable[[Console], object]", width: int) -> str:
    """Return what a function prints on a console so many columns wide. Raises SandboxError for another width."""
    if not isinstance(width, int) or width < 1:
        raise SandboxError(f"width must be a whole number of at least 1, got {shown(width)}")
    text = io.StringIO()
    show(console(file=text, width=width, color_system=None, force_terminal=False, force_jupyter=False))
    return "".join(f"{line.rstrip()}\n" for line in text.getvalue().splitlines())


def json_text(value: object) -> str:
    """Return a value as JSON, as every file has it: a number that is not finite, which JSON does not have, is null."""
    return json.dumps(_finite(value), indent=2, allow_nan=False) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
