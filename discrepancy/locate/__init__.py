"""Where simulation and measurement disagree: which cells of the records, at a controlled rate of false alarms.

In reading order:
    null       residuals as they would be if nothing were missing, by linear theory
    lines      lines at any frequency that stand out of every record
    statistics what is computed of residuals: levels of cells, prominence of lines
    result     cells, lines and map, with what the test says of each
    sentences  the result in words
    where      the test over all cells and lines
"""

from discrepancy.locate.result import Cell, Map, Spot, Where
from discrepancy.locate.where import locate

__all__ = ["Cell", "Map", "Spot", "Where", "locate"]
