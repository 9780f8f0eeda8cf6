"""Simulated drives whose truth is known: made by a plant of their own, which no model of `discrepancy.drives` shares.

In reading order:
    plant      one or two masses under control, by Moreau's time-stepping
    motions    references that a drive is asked to follow
    gallery    five drives, each with an effect hidden
    laws       what is hidden, and disturbances that no library has, by their size
    sizes      trial runs that make a size what is said of it
    draw       a case of the messy challenge: a drive of random size, with all that acts in it
    score      what was said of a case, what of it is right, and the table of rates
    run        a case through the search
    kept       cases judged, in a file
    __main__   python -m indexer_experiments.challenge.drives
"""
