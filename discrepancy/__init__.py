"""Finds which physical effect a model lacks to explain records of a machine, and extends the model by it.

In reading order:
    model      what a model must offer: parameters, effects as hypotheses, windows with their unknown start states
    arrow      normal equations of few global and many local parameters, solved by Schur complement
    problem    one hypothesis about the records: cost, normal equations, search of the windows' start states
    fit        joint fit of the parameters and of every window's start state
    scan       where the fit of an effect should begin: all starts of the library around the calibrated base model
    escape     out of a local minimum by moving an effect's parameters with the windows searched anew
    blackbox   the control: what a model without physics predicts
    starts     which starts are fitted: what promises most, and what the linearisation overlooks
    candidates the hypotheses that compete, and how far each is fitted
    held_out   what a place predicts of records that it was not fitted to
    naming     which effect is missing, none, or which ones cannot be told apart
    findings   probabilities, intervals and the machine's calibration as an explanation states them
    hindsight  earlier rounds in the light of later ones: effects taken back, or told apart after all
    explain    name, add and look again until no gap is left
    indexer/   the cam indexing machine as such a model
    emps       a measured drive as such a model
    records/   measured files of an indexing machine, checked against the nominal one before any fit
    subjects/  what the chain needs of a machine beyond its model
    locate/    which cells and lines of the records disagree, at a controlled rate of false alarms
    gap        the gap before and after on records never fitted, with intervals
    next_measurement  which measurement would tell ambiguous effects apart
    chain      the stages one after the other; `stages` says which one is under way
    report/    report.html, report.json
    __main__   indexer explain

Units are SI and rad. Residuals are (simulated - measured)/noise, so a level (their rms) of 1 is the noise floor.
Arrays are (window, sample); global parameters g, local ones l, windows w.
"""

from discrepancy.criteria import Criteria
from discrepancy.estimates import Calibration, Estimate, FoundEffect
from discrepancy.explain import Explanation, Finding, Remains, explain
from discrepancy.model import NONE, Hypothesis, Model, Parameter, together

__all__ = [
    "NONE",
    "Calibration",
    "Criteria",
    "Estimate",
    "Explanation",
    "Finding",
    "FoundEffect",
    "Hypothesis",
    "Model",
    "Parameter",
    "Remains",
    "explain",
    "together",
]
