"""Simulated drives whose truth is known: made by a plant of their own, which no model of `discrepancy.drives` shares.

In reading order:
    plant      one or two masses under control, by Moreau's time-stepping
    motions    references that a drive is asked to follow
    gallery    five drives, each with an effect hidden
    draw       a case of the messy challenge: a drive of random size, what is hidden, and what no library has
    run        the cases through the search, and the table of rates
    __main__   python -m indexer_experiments.challenge.drives
"""
