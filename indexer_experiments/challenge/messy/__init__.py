"""The messy challenge: machines of any size, records as they come, and disturbances that no effect describes.

In reading order:
    machines      nominal machines of random size and proportions, and the true ones near them
    disturbances  what acts besides the library, by joint and kind, in a half to tune on and one to judge by
    reading       what disturbances of base and sensor do to a reading
    draw          what is in case k: machine, records, noise, disturbances, effects; their sizes are still open
    pieces        cam turns of a record, resumed one by one, and their derivatives
    leftover      how much of anything is left once the machine is fitted, from the truth on
    sought        the size at which something leaves what was drawn for it
    sizes         a case with its sizes: all leave what was drawn for them
    records       its measured files, with what is stated of them, right or wrong
    answer        what an answer consists of, whatever method gave it
    method        the method under test, its answer made neutral: all that is known here of `discrepancy`
    judging       whether machine.yaml is better than the nominal machine, on a record that no method gets
    case          one case from its draw to its row
    score         the table of what must be shown
"""
