"""report.html: what the twin knows and will see, for people.

figures  its pictures, as SVG text
page     report.html of a twin
answer   answer.html of a diagnosis
"""

from twin.report.page import page

__all__ = ["page"]
