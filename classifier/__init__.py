"""From labelled records to a diagnosis: the paper's network on power spectra, and what surrounds it.

Read in this order:

    codes          classes <-> binary codes of the outputs; the nearest code wins
    features       records -> features of the spectrum (PSD, FFT); scaling fitted on the calibration subset alone
    feature_choice which features suit simulated and which suit measured records, where none are given
    network        one hidden layer, logistic, tanh or linear nodes, a whole stack of networks at once
    trainers/      the ten training rules of the paper, one file each; base.py holds the loop, early stopping
                   and the end of each network's training
    indexing       the table's indexing in a record: how often in a turn, and in which sense
    conditions     under what records were taken: radius, speed, machine; what a sensor may clip; indexing and sign
    dataset        a data set of `datagen` -> records, labels, calibration / control / validation
    benchmark      the benchmark set: frozen items, three splits, one line to load it
    evaluate       mean square error [%], misclassified share [%], confusion, macro F1, AUROC, reliability
    train          features + network + trainer -> classifier and its scores
    parts          what a classifier can say beyond its outputs, stored with it
    tasks/         these parts: probabilities, severities with intervals, range, novelty, a network on the record
    model          a trained classifier; its folder of safetensors + YAML
    diagnose/      measured records, turn by turn -> class, severity, bands; as a whole or as samples come
                   (indexer diagnose)
    export/        a model as one ONNX file                                      (indexer export)
    results        numbers over several seeds, their means with intervals, their tables
    groups         what records were measured with and when; data sets without a group
    leaveout_methods  the methods that `leaveout` sets side by side
    leaveout       each sensor, machine or day left out in turn                  (indexer leaveout)
    transfer       a model trained further on records of another machine         (indexer transfer)
    estimators     the network and its features as scikit-learn's estimators (extra [sklearn])
    style          the one style of all pictures
    pictures       accelerations, PSDs, training curve, confusion, reliability, diagnosis
    job            a training as its configuration asks for it
    runs           trainings as a table, one row each; all runs of a sweep together
    curves         errors and scores for TensorBoard
    tune           settings sought by trials                                     (indexer tune)
    __main__       the training command                                          (indexer train)

Units: records in the data set's unit (rad/s² or m/s²), time in s, frequency in Hz, PSD in unit²/Hz; errors of
the network are mean squares, and in per cent only where the name ends in ``_percent``. All numbers of a
network are float64. Index order: networks, then rows (records), then features, nodes or bits. Classes are
counted in the order of the `CodeBook`, while class labels are the numbers of the data set.

Nothing is imported here: ``import classifier`` loads no tensor library.
"""
