"""On-line condition monitoring: samples as they come -> turns, diagnosis, trends, alarms, and a page that shows them.

In reading order, where it helps with its block of ISO 13374:
    settings      conf/monitor.yaml -> objects that check themselves; `given` refuses what is wrong before
    intake/       data acquisition and manipulation: samples -> blocks in order -> turns
    analysis/     state detection, health assessment, prognosis: turn -> finding -> trend -> remaining time
    alarms/       the alarm of a quantity: delays, deadband, acknowledge, repaired, shelve, re-alarm (OPC UA Part 9)
    plan          what all machines share, and what comes of a block
    watch         what the turns of one machine come to: trends, remaining time, alarms
    pipeline      one machine: blocks in, what happened out; knows no clock, store or network
    store/        blocks, turns, trends, alarms in one database; whole turns as Parquet beside it
    leases        several processes on one store: which machine is whose
    diagnoser     the models or the twin that the settings name
    fleet         the machines that this process looks after
    engine        the thread that takes blocks, runs the pipelines and commits each batch in one transaction
    physics       what the twin's physics says of the last turns, in a process of its own
    sources/      MQTT, OPC UA, a folder, a data set replayed, the demonstration
    outputs/      MQTT, signed webhook, Prometheus
    web/          the page, its JSON interface, and who may use them (advisory generation)
    service       all of it started and stopped together
    __main__      the command                                       (indexer monitor)

Times are UTC as whole nanoseconds since 1970 inside, as ISO 8601 with zone outside. A turn is accepted once its
samples are in the store; from then on neither a kill nor a restart loses or doubles it.
"""
