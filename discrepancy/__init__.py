"""Finds which physical effect a model lacks to explain records of a machine, and extends the model by it.

In reading order:
    model      what a model must offer: parameters, effects as hypotheses, windows with their unknown start states
    criteria   the numbers by which a search decides
    jobs       windows to simulate, each from a start state at a place
    grids      grids of start states side by side
    arrow      normal equations of few global and many local parameters, solved by Schur complement
    place      a place in the parameter space, and how well it explains the records
    problem    one set of effects about the records: cost, normal equations, search of the windows' start states
    fit        joint fit of the parameters and of every window's start state (Levenberg–Marquardt)
    linearised what the starts of one more effect promise
    race       where its fit should begin: successive halving
    noise      the size and the colour of measuring noise, read where a machine is quiet
    dispersion how much less a residual tells than white noise: by itself, and by what it has bent
    selection  sets fitted to the end, and the one score by which they are compared
    fits       the fits of a search, each made once
    search     floating selection: add, drop, exchange
    held_out   what a fit predicts of records that it was not fitted to
    form       a free function of one variable, to which laws over it are held, or of two
    intervals  the intervals of all numbers of a fitted place
    estimates  sizes with intervals, and the machine's calibration
    grades     what is said of each effect of the set selected, by one table of rules
    judging    the set before the records held out, effect by effect
    finding    one finding with its probability, and what it competes with
    written    the machine that an answer leaves behind
    explain    the answer: findings with their grades, and what remains
    indexer/   the cam indexing machine as such a model
    records/   measured files of an indexing machine, checked against the nominal one before any fit
    drives/    any drive as such a model, by a Python function of its owner
    subjects/  what the chain needs of a machine beyond its model
    locate/    which cells and lines of the records disagree, at a controlled rate of false alarms
    origin/    the joint at which what remains enters, and what it varies with
    table      what remains as a spline over one variable or two: a table, not a law
    gap        the gap before and after on records never fitted, with intervals
    next_measurement  which measurement would settle what is open
    chain      the stages one after the other; `stages` says which one is under way
    report/    report.html, report.json
    __main__   indexer explain

Units are SI and rad. Residuals are (simulated - measured)/noise, so a level (their rms) of 1 is the noise floor.
Arrays are (window, sample); global parameters g, local ones l, windows w.
"""

from discrepancy.criteria import Criteria
from discrepancy.estimates import Calibration, Estimate, FoundEffect
from discrepancy.explain import Explanation, Remains, explain
from discrepancy.finding import Finding
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
