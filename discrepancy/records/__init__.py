"""Measured files of an indexing machine -> records that can be explained, or one sentence that says why not.

In reading order:
    conditions  what was known when each record was taken: a table beside the files, the command line
    reading     the files and their conditions -> records, with the once-per-turn pulse where there is one
    quality     dead and clipped sensors, low rates, too few turns
    period      how long a cam turn takes by the record itself
    offset      the sensor's constant offset, which a table that indexes shows
    start       the cam angle at the first sample: stated, by the pulse, or by comparison
    likeness    whether a record is of the nominal machine, or more like one of another motion
    matching    speed, cam angle, level and likeness of a record against the nominal machine
    speed       the motor speed by pulses, period and phase against the one stated
    rates       records of one sampling rate, and the noise of each
    division    which part of each record is held out where no whole one is
    experiments records -> experiments with a checked operating point, to fit and to hold out
    machine     the nominal machine and how well its parameters are known, from one YAML file
"""
