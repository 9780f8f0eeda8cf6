"""From labelled records to a diagnosis: the paper's network on power spectra, and what surrounds it.

Read in this order:

    codes          classes <-> binary codes of the outputs; the nearest code wins
    features       records -> PSD features; scaling fitted on the calibration subset alone
    network        one hidden layer, logistic, tanh or linear nodes, a whole stack of networks at once
    trainers/      the ten training rules of the paper, one file each; base.py holds the loop, early stopping
                   and the leaving of networks
    dataset        a data set of `datagen` -> records, labels, calibration / control / validation
    evaluate       mean square error [%], misclassified share [%], confusion
    train          features + network + trainer -> classifier and its scores
    model          a trained classifier; its folder of safetensors + YAML
    diagnose       one measured record -> class, outputs, distance, margin       (python -m
                   classifier.diagnose)
    pictures       accelerations, PSDs, training curve, confusion, diagnosis
    __main__       the training command                                          (python -m classifier)

Units: records in the data set's unit (rad/s² or m/s²), time in s, frequency in Hz, PSD in unit²/Hz; errors of
the network are mean squares, and in per cent only where the name ends in ``_percent``. All numbers of a
network are float64. Index order: networks, then rows (records), then features, nodes or bits. Classes are
counted in the order of the `CodeBook`, while class labels are the numbers of the data set.

Nothing is imported here: ``import classifier`` loads no tensor library.
"""
