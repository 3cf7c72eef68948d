"""Names of inputs: keys of [sweep], properties of materials, and parameters of models and friction laws."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from ..contact.frictions import frictions
from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..errors import did_you_mean
from .files import as_table
from .quantities import KeyPath, Quantity
from .tables import MATERIAL_KEYS, MATERIAL_QUANTITIES, SWEEP_QUANTITIES, law_quantities, laws_of

# keys of the inputs in [sweep]
SWEEP_INPUTS = (*SWEEP_QUANTITIES, *MATERIAL_KEYS)


@dataclass(frozen=True)
class InputName:
    """The name of an input, which is also the name of its coordinate in a result.

    >>> InputName.parse("v1"), InputName.parse("materials.steel.E").owner, InputName.parse("model.bilinear.K").path
    (InputName(table='sweep', owner='', key='v1'), 'steel', ('model', 'bilinear', 'K'))
    """

    table: str  # "sweep", "materials", "model" or "friction"
    owner: str  # the material, or the key of the law; empty in [sweep]
    key: str

    @classmethod
    def parse(cls, text: object) -> InputName:
        """Read a config name; "model." before the key of a model may be omitted."""
        # the key of a model has no dot, the name of a material may have one
        owner, _, key = str(text).removeprefix("model.").rpartition(".")
        for table in ("materials", "friction"):
            if owner.startswith(f"{table}.") and owner != f"{table}.":
                return cls(table, owner.removeprefix(f"{table}."), key)
        return cls("model", owner, key) if owner else cls("sweep", "", str(text))

    def __str__(self) -> str:
        prefix = f"{self.table}." if self.table in ("materials", "friction") else ""
        return f"{prefix}{self.owner}.{self.key}" if self.owner else self.key

    @property
    def path(self) -> tuple[str, ...]:
        """Path from the top of a config."""
        return (self.table, self.owner, self.key) if self.owner else (self.table, self.key)

    @property
    def config_key(self) -> str:
        """The path as text, for example "model.bilinear.K"."""
        return ".".join(self.path)

    @property
    def material(self) -> str:
        """The material of which it is a property; otherwise empty."""
        return self.owner if self.table == "materials" else ""

    @property
    def model(self) -> str:
        """The key of the model of which it is a parameter; empty for an input of all models."""
        return self.owner if self.table == "model" else ""

    @property
    def friction(self) -> str:
        """The key of the friction law of which it is a parameter; otherwise empty."""
        return self.owner if self.table == "friction" else ""

    def applies_to(self, model: str, friction: str = "") -> bool:
        """Check whether a model, or its pair, may depend on it: it is not a parameter of another law."""
        law = frictions().get(self.friction)
        # friction in a cone changes the normal motion, which is that of the model
        is_of_all = law is not None and law.kind == "cone"
        return self.model in ("", model) and (is_of_all or self.friction in ("", friction))

    def quantity(self, models: Mapping[str, ForceModel]) -> Quantity | None:
        """Find its quantity, or None for the name of a material; KeyError for an unknown input."""
        if self.table in ("model", "friction"):
            return law_quantities(laws_of(self.table, models)[self.owner])[self.key]
        if self.table == "materials":
            return MATERIAL_QUANTITIES[self.key]
        return None if self.key in MATERIAL_KEYS else SWEEP_QUANTITIES[self.key]

    @property
    def unit(self) -> str:
        """Its unit; "1" of a name and of a parameter of a model that is not built in."""
        try:
            quantity = self.quantity(catalogue())
        except KeyError:
            return "1"
        return "1" if quantity is None else quantity.unit

    @property
    def words(self) -> tuple[str, ...]:
        """The words that its numbers stand for; empty if it is a number."""
        law = frictions().get(self.friction)
        return next((p.choices for p in law.parameters if p.name == self.key), ()) if law else ()

    def word(self, value: float | str) -> float | str:
        """Find the word that a number stands for, of a parameter that is a word; otherwise return the value.

        >>> InputName.parse("friction.coulomb-1785.limit").word(1.0), InputName.parse("v1").word(1.0)
        ('positive', 1.0)
        """
        return self.words[int(value)] if value in range(len(self.words)) else value

    def unknown_message(self, models: Mapping[str, ForceModel]) -> str:
        """Describe an input that does not exist, with the nearest name."""
        keys: Iterable[str] = MATERIAL_QUANTITIES if self.table == "materials" else SWEEP_INPUTS
        if self.table in ("model", "friction"):
            laws = laws_of(self.table, models)
            if self.owner not in laws:
                return f"no such input; {did_you_mean(self.owner, list(laws))}"
            keys = law_quantities(laws[self.owner])
        return f"no such input; {did_you_mean(str(self), [str(replace(self, key=key)) for key in keys])}"


def with_words(inputs: Mapping[str, float | str]) -> dict[str, float | str]:
    """Put the words of parameters in place of the numbers that stand for them; inputs are by config name."""
    return {name: InputName.parse(name).word(value) for name, value in inputs.items()}


def is_foreign(names: Iterable[str], model: str, friction: str = "") -> bool:
    """Check whether inputs that vary together are parameters of other laws only, of a model or a pair."""
    applies = [InputName.parse(name).applies_to(model, friction) for name in names]
    return bool(applies) and not any(applies)


def is_input(name: object) -> bool:
    """Check whether a coordinate of a result is an input, unlike metadata of models and numbers of cases."""
    return name in SWEEP_INPUTS or "." in str(name)


def paths_with(data: Mapping[str, Any], keys: Iterable[str]) -> list[KeyPath]:
    """List the paths of the inputs whose value is a table with one of some keys, such as `{ fit = ... }`."""
    return [name.path for name, value in input_values(data) if not as_table(value).keys().isdisjoint(keys)]


def input_values(data: Mapping[str, Any]) -> Iterator[tuple[InputName, Any]]:
    """Yield the name and the value of every key of [sweep], of a material, of [model.KEY] and [friction.KEY]."""
    for key, value in as_table(data.get("sweep")).items():
        yield InputName("sweep", "", key), value
    for table in ("materials", "model", "friction"):
        for owner, values in as_table(data.get(table)).items():
            for key, value in as_table(values).items():
                yield InputName(table, owner, key), value
