"""report.html: what the twin knows and will see, for people."""

from twin.report.page import page

__all__ = ["page"]
