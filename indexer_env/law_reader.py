"""Laws from what stands beside a quantity in YAML, or one sentence that says why it is none."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Any

from indexer_env.build import check_typed, field_of
from indexer_env.checks import check_number, did_you_mean
from indexer_env.errors import refuse
from indexer_env.laws import LAWS, Around, Choice, Fixed, Law, LogUniform, Normal, Sobol, Uniform


def is_law(given: object) -> bool:
    """Whether this is a law other than a plain value: ``{NAME: ...}`` with NAME in LAWS."""
    return isinstance(given, Mapping) and len(given) == 1 and next(iter(given)) in LAWS


def make_law(owner: str, name: str, given: object) -> Law:
    """The law of what stands beside a quantity in YAML.

    Raises
    ------
    ParameterError
        No law of this name, or parameters that break its rule; the sentence begins with ``owner.name``.
    """
    if not isinstance(given, Mapping):
        return Fixed(given)
    if not is_law(given):
        forms = ", ".join(law.form for law in LAWS.values())
        hint = did_you_mean(next(iter(given)), LAWS) if len(given) == 1 else "keep one law"
        raise refuse(owner, name, f"a value or one of {forms}", dict(given), hint)
    ((key, values),) = given.items()
    law = LAWS[key]
    if law is Around and not isinstance(values, list | tuple):
        check_number(owner, name, values, low=0.0, unit="-", remedy="{around: 0.1} stands for ±10 %")
        return Around(float(values))
    if not isinstance(values, list | tuple) or not values:
        raise refuse(owner, name, law.form, dict(given))
    if law is Choice:
        return Choice(tuple(_entry(owner, name, entry) for entry in values))
    for value in values:
        check_number(owner, name, value)
    rule, fits = _RULES[law]
    if len(values) != 2 or not fits(*values):
        raise refuse(owner, name, f"{law.form} with {rule}", dict(given))
    first, second = float(values[0]), float(values[1])
    return Around(second, first) if law is Around else law(first, second)  # type: ignore[call-arg]


_RULES: dict[type[Law], tuple[str, Callable[[float, float], bool]]] = {
    Uniform: ("low <= high", lambda low, high: low <= high),
    Sobol: ("low <= high", lambda low, high: low <= high),
    LogUniform: ("0 < low <= high", lambda low, high: 0.0 < low <= high),
    Normal: ("sd >= 0", lambda mean, sd: sd >= 0.0),
    Around: ("[nominal, share >= 0]", lambda nominal, share: share >= 0.0),
}


def law_of_field(owner: str, key: str, given: object, fields: Collection[str]) -> tuple[str, Law]:
    """The SI field of a key of YAML and its law in SI units: ``backlash_deg: {uniform: [0, 20]}`` is `backlash` in rad.

    Raises
    ------
    ParameterError
        As `make_law`, no such field, or text in degrees.
    """
    name, factor = field_of(owner, key, fields)
    law = make_law(owner, key, given)
    if name == key:
        return name, law
    for value in law.extremes:
        check_typed(owner, name, key, value)
    return name, law.scaled(factor)


def _entry(owner: str, name: str, given: object) -> Any:
    law = make_law(owner, name, given)
    if isinstance(law, Sobol) or isinstance(given, list | tuple):
        raise refuse(owner, name, "a choice of values and laws other than sobol", given)
    return law.value if isinstance(law, Fixed) else law
