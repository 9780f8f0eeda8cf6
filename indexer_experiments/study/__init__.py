"""The paper's claims, worked through again one by one (indexer study).

Read in this order:

    verdicts   intervals over data sets, lines with the range that the paper allows, the rule for every verdict
    settings   data and choices under which a claim is judged: the most likely one first, then what it hangs on
    trials     many trainings of one kind on one data set, a row for each network
    lab        size, seeds and folder of a study: what a claim works with
    measured   records that stand for measured ones
    claims/    one claim each: what the paper says, how it is worked out, judged and drawn
    work       each claim done once; its results, picture and finding in a folder of its own
    report     one page with every figure beside the paper's words
    __main__   the command

Units are those of `classifier`; errors are shares, and in per cent where it is written. A row of a results table is
one network on one data set, or what the claim says it is.
"""
