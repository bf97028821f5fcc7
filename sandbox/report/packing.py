"""Arrays as text, for the scripts of a page."""

import base64
from typing import Any

from numpy.typing import NDArray


def packed(values: NDArray[Any]) -> str:
    """Return an array's bytes in base64."""
    return base64.b64encode(values.tobytes()).decode()
