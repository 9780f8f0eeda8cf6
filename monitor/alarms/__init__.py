"""Alarms of quantities, as OPC UA Part 9 (Alarms and Conditions, version 1.05) names their parts.

limits     from which size on a quantity is an alert, an alarm, a danger
condition  the state machine of one alarm
"""

from monitor.alarms.condition import Condition, Event, Rules
from monitor.alarms.limits import LEVELS, Limits, limits_of_key

__all__ = ["LEVELS", "Condition", "Event", "Limits", "Rules", "limits_of_key"]
