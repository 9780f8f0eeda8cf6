"""Methods, severities, novelty and robustness side by side, each over several seeds of data and training.

Read in this order:

    recipes     the data sets, as command lines of `datagen`
    methods/    the paper's network and what it is compared with
    measure     what is measured of the probabilities that a method gives
    study       what a study is, and what one seed of it is given
    trained     a data set as a network on the paper's features sees it
    baselines   which method names the faults best
    benchmark   the same on the benchmark set, split in three ways
    severity    whether severities are right and their intervals hold, and whether they follow wear
    novelty     which score refuses a fault or a machine that the training never had
    robustness  what is left on other machines, operating points and sensors
    studies     these by their names
    beside      which methods differ from one of them by more than the scatter of the seeds
    draw        pictures that several studies share
    leaderboard results of the benchmark as one page
    __main__    the command                                                      (indexer compare)

scikit-learn is needed (gradient-boosted trees), which the extra [sklearn] installs.
"""
