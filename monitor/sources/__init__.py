"""Where samples come from; each source runs until it is stopped and hands its blocks to the engine.

base     what every source has
mqtt     messages of a broker
opcua    nodes of an OPC UA server
listing  what lies in a watched folder
folder   files that a logger writes
replay   a data set of `indexer generate` or `indexer ingest`, in real time or faster
demo     simulated machines that wear, published to the built-in broker
broker   the built-in broker
"""
