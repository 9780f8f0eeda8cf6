"""The twin of one's own machine: from its drawing and some healthy records to the diagnosis of its faults.

In reading order:
    settings     what a twin is made with
    faults       the fault table: which effect each fault is, its sizes, the shop's units
    posterior    the joint law of machine, effects, loads and gain at a fitted place
    freed        what was found when a twin was made, to be fitted anew
    calibrate    drawing and healthy records -> machine, extended, and draws of what is open
    bench        the healthy records, as a twin is made of them
    turns        a turn as the networks see it: what it differs by from the healthy machine, by cam angle
    remains      what healthy records leave: a fixed part, and noise that follows speed and load
    components   a turn along its principal components
    data         simulated turns with faults: the campaign `own` of `datagen`
    network      layers on the modes of a turn, and the paper's network
    learn        how they are trained
    nuisance     the machine's own parameters as the posterior leaves them open
    synthesis    what a turn with faults of some sizes would look like, beside a measured one
    work         what such a fit leaves, many turns at once
    descend      Levenberg and Marquardt's method on them
    refine       the sizes that fit a turn, from what the networks estimate
    growth       how wide such a fit may miss
    weigh        what such a fit is worth: names, intervals, novelty
    judge        thresholds of the networks alone: alarm, intervals of sizes
    teach        the stage in which all this is learned
    detection    the smallest size of each fault that will be seen
    diagnosis    what the networks say of a turn, as objects
    gate         what a record must be to be compared with a twin
    corrected    a record with what it says itself of its speed, start and sign
    measured     how large physics measures a fault that its own search does not find
    physics      faults as hypotheses of `discrepancy`, from the twin's machine
    folder       the files of a twin
    workplace    the folder in which a twin is being made
    check        the check on healthy turns held out
    moved        has the machine moved since its last healthy records?
    quantities   what the report calls what was fitted
    advice       what to record next, and why
    first_look   what is left of each healthy file, before anything is simulated
    card         what twin.yaml says of calibration and networks
    make         the stages one after the other                          (indexer twin)
    twin         a twin as it is stored in its folder: `Twin.load`, `diagnose_turn`, `explain`
    found        a fault of an answer, from what networks or physics say of it
    answer       one answer of networks and physics
    update       new healthy records of a twin                           (indexer twin-update)
    diagnose     records -> answer                                       (indexer twin-diagnose)
    report/      report.html
    __main__     the command that makes a twin

Units are SI and rad. Sizes of faults are shares of the largest, and in the shop's units where people read them. Arrays
are (turn, station, cell); a cell is a part of the cam turn, counted from cam angle 0. The networks' inputs x are in
units of the noise of a cell at the turn's operating point.

    from discrepancy.records.conditions import Conditions
    from twin.twin import Twin
    twin = Twin.load("twin")
    twin.diagnose_turn(signal, Conditions(motor_speed=157.1, load_torque=2.0))    # tenths of a second
    twin.explain([(signal, conditions)])                                          # physics, seconds

Nothing is imported here: ``import twin`` loads no tensor library.
"""
