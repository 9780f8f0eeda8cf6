"""Samples as they arrive -> turns of the table.

blocks      a stretch of samples with its time, rate and unit
payload     bytes of a message -> block, or one sentence that says why not
order       blocks as they arrive -> blocks in their order, and what was wrong with it
states      what is wrong with a sensor, its clock or its connection: never a diagnosis
arrivals    blocks on their way into the engine, and those of machines of another process
unread      what could not be read, until its machine can tell of it
cutter      blocks in order -> turns with their times
"""
