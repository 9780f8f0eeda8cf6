"""Where what a model has left comes from: the joint at which something is missing, and what it varies with.

In reading order:
    residue   residuals from which everything that a fit may move is projected out, their noise white
    choose    sums of few causes, by their evidence

The causes of a machine are its own: `indexer.causes`.
"""

from discrepancy.origin.choose import MARGIN, Form, Origin, Place, likeliest, origin_of
from discrepancy.origin.residue import Laid, Residue

__all__ = ["MARGIN", "Form", "Laid", "Origin", "Place", "Residue", "likeliest", "origin_of"]
