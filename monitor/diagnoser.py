"""Who diagnoses: the models or the twin that the settings name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from classifier.model import load_model
from indexer_env.errors import refuse
from monitor.alarms import Limits
from monitor.analysis.classifier import ClassifierDiagnoser
from monitor.analysis.finding import Diagnoser
from monitor.analysis.twin import TwinDiagnoser, limits_of
from monitor.plan import CHANGE
from monitor.settings import Settings
from twin.twin import Twin


def diagnoser_of(settings: Settings) -> tuple[Diagnoser, Settings]:
    """Whoever diagnoses, and the settings with the limits that belong to him.

    Raises
    ------
    IndexerError
        A model or twin that cannot be used, or no limit of what it tells.
    """
    if settings.twin is None:
        diagnoser = ClassifierDiagnoser([load_model(path) for path in settings.models])
        _check_limits("limits", settings.plan.limits, diagnoser)
        if diagnoser.needs_radius and settings.plan.sensor_radius is None:
            remedy = "give sensor_radius=NUMBER"
            rule = "the accelerometers' distance from the table's axis in m, as the model was taught at a known one"
            raise refuse("monitor", "sensor_radius", rule, None, remedy)
        stations = settings.plan.stations or diagnoser.stations
        return diagnoser, replace(settings, plan=replace(settings.plan, stations=stations))
    diagnoser = TwinDiagnoser(Twin.load(settings.twin), settings.load_torque, settings.motor_speeds)
    unknown = {name: limits for name, limits in settings.plan.limits.items() if name == CHANGE}
    limits = limits_of(diagnoser.twin, settings.twin_limits, settings.deadband) | unknown
    _check_limits("twin_limits", limits, diagnoser)
    stations = diagnoser.twin.machine.stations
    if settings.plan.stations not in (None, stations):
        rule = f"{stations}, as the twin's machine has it, or left out"
        raise refuse("monitor", "stations", rule, settings.plan.stations)
    return diagnoser, replace(settings, plan=replace(settings.plan, limits=limits, stations=stations))


def _check_limits(key: str, limits: Mapping[str, Limits], diagnoser: Diagnoser) -> None:
    """Whether anything is watched; `key`: where limits can be given."""
    if not set(limits) & set(diagnoser.quantities):
        told = f"limits of what the model or twin tells ({', '.join(diagnoser.quantities)}), of one of them at least"
        raise refuse("monitor", key, told, None, "else nothing is watched")
