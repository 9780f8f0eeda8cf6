"""Alarms out of the monitor.

outbox   what must be told on a channel, told until it was taken
webhook  one alarm as a signed POST
publish  one alarm as an MQTT message
metrics  the endpoint for Prometheus
"""
