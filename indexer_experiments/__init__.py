"""Experiments over several seeds: what was asked of the other packages, and how it was answered.

Read in this order:

    recipes     data sets as command lines of `datagen`, made once and kept
    study/      the paper's claims, worked through one by one                    (indexer study)
    compare/    other methods, severities, novelty and robustness, measured      (indexer compare)
    challenge/  effects hidden in a machine, searched for, the answers scored    (indexer challenge)

Nothing else imports this package, and it may import all others. Nothing is imported here.
"""
