"""report.html (placeholder until figures)."""

from __future__ import annotations

from typing import Any


def page(about: dict[str, Any], machine: Any, remains: Any) -> str:
    return "<html></html>"
