"""What a trained classifier says beyond the class: the parts that are stored with it (`classifier.parts`).

    need         records that hang together, and the error of a part that has too few
    spectrum     scaled features -> compressed and whitened ones, on which severities and novelty are judged
    conformal    intervals that hold a stated share of new records
    confidence   probabilities of classes and faults, by a temperature
    regression   kernel ridge regression in closed form, and its errors on machines left out
    severity     backlash in degrees, crack and looseness, each with its interval
    remaining    turns left until the machine fails, with an interval for a new life
    novelty      whether a record is like those of the training at all, by its spectrum
    range        the same by its level and octaves, which few records are enough for
    logistic     logistic regression, the linear method beside the network in `leaveout` and `compare`
    decimate     records at a lower rate and of unit size, for what sees the record itself
    convolution  what a convolutional network names by the record itself, fitted on request

Each part learns on the calibration subset and is tuned on the control subset alone; the validation subset is never
looked at, so it may judge them.
"""
