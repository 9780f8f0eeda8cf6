"""Plain values that every reader of JSON takes."""

from __future__ import annotations

import math
from typing import Any


def finite(value: Any) -> Any:
    """Plain values with None for what is not finite: JSON has no NaN and no infinity."""
    if isinstance(value, dict):
        return {key: finite(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
