"""Any drive as a model: a Python function of one's own, records of it, and standard effects that may be missing.

In reading order:
    user_code    Python of the user's, and what it raises
    stated_effects  effects that such a file states, asks for or brings
    description  what a user's file says: `force` or `rates`, parameters, channels, effects
    channel_checks  what the channels of a record must agree in
    channels     measured files -> channels of a record by their roles
    units        units as files write them
    smoothing    differentiation, low-pass and noise: one choice for all channels
    scales       what a drive's records are measured by
    band         the band in which all records are compared
    track        a record as the equations see it
    effects/     the standard effects of drives
    library      effects as hypotheses, sized by the record itself
    sessions     parameters of which each record has its own value
    windows      which samples are fitted, which are held out
    both_forms   what the two forms have in common
    inverse_library  effects that the inverse form can have, sized by what is left
    inverse      the model of `force(q, v, a, u, t, p)`
    differing    parameters that seem to differ from record to record
    compiled_rates  a user's `rates` for the integrator
    readings     what acts between a command and a force, and between a motion and its reading
    course       a record in that form, and what its motion says of every state
    forward_library  the effects that it can have
    forward      the model of `rates(x, u, t, p)`
    forces       what the standard effects do at one of its joints, rates with them, one Runge-Kutta step
    advance      its integrator: landing on events, with true sticking
    unplaced     equations that ask where a position is of which the speed alone is measured
    motions      motions that could be asked of a drive next
    subject      what locating and reporting need of a drive
    forward_subject  the same of the model of `rates`
    second_look  machine.yaml of a drive, read again as what is known
    door         all of it from the command's configuration

The unit of force F and of position Q are the user's own; rates are per second. Arrays are (n,) over a record's samples.
"""

from discrepancy.drives.effects.base import DriveEffect, Size

__all__ = ["DriveEffect", "Size"]
