"""Experiments over several seeds: what was asked of the other packages, and how it was answered.

Read in this order:

    recipes     data sets, with what a network is to say of their records
    tables      shares with their intervals, tables in Markdown
    study/      the paper's claims, worked through one by one                    (indexer study)
    compare/    other methods, severities, novelty and robustness, measured      (indexer compare)
    challenge/  effects hidden in a machine, searched for, the answers scored    (indexer challenge)

Numbers over seeds, their means with intervals and the tables of these are `classifier.results`, which the commands of
`classifier` need, too. Nothing else imports this package, and it may import all others. Nothing is imported here.
"""
