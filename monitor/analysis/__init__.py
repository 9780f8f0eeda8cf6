"""A turn -> what is wrong, how far, how it moves, how long still.

finding     what one turn shows: the protocol of whoever diagnoses
classifier  a trained classifier as such
twin        a twin as such, and limits from what it can see
baseline    what is usual for a machine in a mode, and a gain that jumps
running     times of turns -> time for which a machine has run
trend       turn by turn -> one value with its interval, and a history of bounded length
remaining   a history and a limit -> remaining time with its interval
"""
