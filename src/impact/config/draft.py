"""A config that is being read: its plain data, the settings that changed it, and its problems.

Each step from the source to a `Config` takes a draft and returns a new one; see `impact.config.load.build`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from ..contact.friction import FrictionLaw
from ..contact.frictions import frictions
from ..contact.model import ForceModel, Parameter
from ..contact.models import catalogue
from ..errors import ConfigError, MissingFileError, UsageError
from ..formatting import argument, safe_text, type_of
from .files import (
    as_table,
    key_lines,
    override_text,
    parse_document,
    path_text,
    read_override,
    read_text,
    read_value,
    set_value,
    to_plain_data,
)
from .input_names import InputName, input_values
from .library import STARTER_CONFIG, library
from .quantities import MAX_PROBLEMS, VALUE_FORMS, ConfigProblem, KeyPath
from .tables import MATERIAL_KEYS, SWEEP_DEFAULTS, SWEEP_QUANTITIES, Loss, Noise, expand_laws

# keys of [sweep] that arrange inputs
NO_INPUTS = (("sweep", "zip"), ("sweep", "cases"))
# inputs that a setting of another one replaces
EXCLUDED_BY = {
    "e": ("alpha",),
    "alpha": ("e",),
    "material": ("material1", "material2"),
    "material1": ("material",),
    "material2": ("material",),
}

# the name of the starter config in messages
STARTER = "the starter config"


@dataclass(frozen=True)
class Setting:
    """A value that replaces that of a config."""

    path: KeyPath  # empty for a text that is not PATH=VALUE
    value: object  # any, which is checked with the rest of the config
    shown: str  # the argument that sets it, for messages: `at["e"]` or "--at e=0.6"
    text: str = ""  # PATH=VALUE, as it is stored with a result; empty for that of the path and the value

    @classmethod
    def parse(cls, text: str) -> Setting:
        """Parse an override.

        >>> setting = Setting.parse("sweep.e.linspace=[0,1,11]")
        >>> setting.path, setting.value
        (('sweep', 'e', 'linspace'), [0, 1, 11])
        """
        path, value_text = read_override(text)
        return cls(path, read_value(value_text), argument("overrides", text), text)

    @property
    def override(self) -> str:
        """PATH=VALUE."""
        return self.text or override_text(self.path, to_plain_data(self.value)[0])


# changes of a config: texts PATH=VALUE, or values by path
Overrides = str | Iterable[str | Setting] | Mapping[str, object]


def settings_of(overrides: Overrides) -> list[Setting]:
    """Read changes of a config: texts PATH=VALUE, values by path, or settings.

    >>> [setting.override for setting in settings_of({"sweep.e": [0.5, 1.0], "models": "hertz"})]
    ['sweep.e=[0.5, 1.0]', 'models="hertz"']
    """
    if isinstance(overrides, Mapping):
        return [
            Setting(read_override(f"{path}=")[0], value, argument("overrides", key=path))
            for path, value in overrides.items()
        ]
    items = [overrides] if isinstance(overrides, str) else overrides
    return [item if isinstance(item, Setting) else Setting.parse(item) for item in items]


@dataclass(frozen=True)
class Measurements:
    """Measured points, in SI."""

    file: str  # name of the CSV file as in the config; empty for values in the config
    lines: tuple[int, ...]  # of each point in the file; its number, from 1, for values in the config
    inputs: Mapping[str, tuple[float, ...]]  # those that vary from point to point, by config name
    outputs: Mapping[str, tuple[float, ...]]
    sigma: Mapping[str, tuple[float, ...]]  # standard deviations of the outputs that have some
    # "given": sigma as it is; "scale": times a common factor, which also stands for a sigma that is missing; or
    # "excess": with a variance between specimens added
    noise: Noise
    specimens: tuple[str, ...] = ()  # of each point, for the noise "excess"; empty if each point has its own
    loss: Loss = "linear"


@dataclass(frozen=True)
class Draft:
    """A config that is being read; nothing of it has been checked but its syntax."""

    data: dict[str, Any]
    text: str  # TOML, or a mapping as JSON, without settings
    name: str  # of the source, for messages
    known_models: Mapping[str, ForceModel]
    folder: Path | None = None  # of the files that it names; None if no file may be read
    settings: tuple[Setting, ...] = ()  # in the order in which they are stored
    # the setting of each path that a setting changed, in the order in which they were applied
    origins: Mapping[KeyPath, Setting] = field(default_factory=dict)
    files: tuple[Path, ...] | None = None  # the CSV files whose values are in the data; None before they are read
    # the path of each input that is a column of cases or of measurements, and where its values are
    columns: Mapping[KeyPath, KeyPath] = field(default_factory=dict)
    measurements: Measurements | None = None
    problems: tuple[ConfigProblem, ...] = ()
    lines: tuple[str, ...] = ()  # complete messages about settings and files
    notes: tuple[str, ...] = ()  # on what is left out
    misses_file: bool = False  # a CSV file that it names does not exist
    has_own_scheme: bool = False  # the command chooses the scheme of friction, not the config

    def table(self, name: str) -> dict[str, Any]:
        """Return a table of the config, or an empty one."""
        return as_table(self.data.get(name))

    @property
    def zip_groups(self) -> list[list[str]]:
        """The names of each group of axes that vary together."""
        groups = self.table("sweep").get("zip")
        lists = groups if isinstance(groups, list) else []
        return [listed_names(group) for group in lists if isinstance(group, list)]

    @cached_property
    def exponent(self) -> float | None:
        """The exponent n of [sweep], which the unit of K contains: None if it varies, NaN if it is invalid."""
        n = self.table("sweep").get("n", SWEEP_DEFAULTS["n"])
        is_column = ("sweep", "n") in self.columns or "n" in as_table(self.table("sweep").get("cases"))
        if is_column or isinstance(n, list | dict):
            return None
        return SWEEP_QUANTITIES["n"].read_or_nan(n)

    @cached_property
    def models(self) -> Sequence[ForceModel]:
        """The selected models, without those that are unknown."""
        return expand_laws(self.data.get("models"), self.known_models)[0]

    @cached_property
    def frictions(self) -> Sequence[FrictionLaw]:
        """The selected friction laws, without those that are unknown; none for central impacts."""
        return expand_laws(self.data.get("frictions"), frictions(), "friction law")[0]

    @property
    def laws(self) -> dict[str, Sequence[ForceModel | FrictionLaw]]:
        """The selected laws by the table of their parameters."""
        return {"model": self.models, "friction": self.frictions}

    @property
    def parameters(self) -> Iterator[tuple[InputName, Parameter]]:
        """The parameters of the selected laws."""
        for table, laws in self.laws.items():
            for law in laws:
                yield from ((InputName(table, law.key, parameter.name), parameter) for parameter in law.parameters)

    @property
    def missing_parameters(self) -> Iterator[InputName]:
        """The parameters of the selected laws that have neither a default nor a value."""
        for name, parameter in self.parameters:
            is_required = parameter.default is None and not parameter.optional
            if is_required and str(name) not in self.input_names:
                yield name

    @cached_property
    def input_names(self) -> list[str]:
        """The config names of all inputs, whether or not their values are valid."""
        names = [name for name, _ in input_values(self.data) if name.path not in NO_INPUTS]
        # an unknown key of [sweep], such as "hertz.K", is not the input of that name
        return [str(name) for name in names if InputName.parse(name) == name]

    def with_problems(self, problems: Iterable[ConfigProblem]) -> Draft:
        return replace(self, problems=tuple(dict.fromkeys((*self.problems, *problems))))

    def with_settings(self, overrides: Overrides) -> Draft:
        """Apply settings in order, after library materials of which one of them changes a property."""
        settings = settings_of(overrides)
        if not settings:
            return self
        paths = [setting.path for setting in settings if setting.path[:1] == ("materials",)]
        changed = dict.fromkeys(str(path[1]) for path in paths if len(path) > 2 and path[:2] not in paths)
        added = [name for name in changed if name in library() and name not in self.table("materials")]
        draft = self
        for setting in (*map(_library_setting, added), *settings):
            draft = draft._with_setting(setting)
        data, problems = to_plain_data(draft.data)
        return replace(draft, data=data).with_problems(problems)

    def _with_setting(self, setting: Setting) -> Draft:
        path, data = setting.path, self.data
        if not path:
            line = f"{safe_text(setting.shown)}: expected PATH=VALUE, such as sweep.e=0.5"
            return replace(self, lines=(*self.lines, line))
        is_input = path[0] in ("sweep", "model", "materials", "friction") and len(path) > 2
        data, start = set_value(data, path, setting.value, new_range=is_input and path[-1] in VALUE_FORMS)
        replaced = [start]
        others = EXCLUDED_BY.get(str(path[1]), ()) if path[0] == "sweep" and len(path) > 1 else ()
        if others:
            replaced += [("sweep", other) for other in others]
            sweep = data["sweep"]
            if others == ("material",) and "material" in sweep:
                # the other ball keeps it
                sweep = {**{f"material{ball}": sweep["material"] for ball in "12"}, **sweep}
            data = {**data, "sweep": {key: value for key, value in sweep.items() if key not in others}}
        origins = {
            old: origin
            for old, origin in self.origins.items()
            if not any(old[: len(new)] == new for new in replaced)
        }
        origins[start] = setting
        return replace(self, data=data, origins=origins, settings=(*self.settings, setting))

    def error(self) -> ConfigError:
        """Build the exception with all problems: those of the file by line, then those of the settings."""
        key_line = {} if self.text.lstrip().startswith("{") else key_lines(self.text)
        ranked: list[tuple[tuple[int, int], str]] = []
        for path, message in self.problems:
            for end in range(len(path), 0, -1):
                if path[:end] in self.columns:
                    path = (*self.columns[path[:end]], *path[end:])
                    break
            rank, location = self._locate(path, key_line)
            ranked.append((rank, ": ".join(part for part in (location, path_text(path), message) if part)))
        lines = [line for _, line in sorted(ranked, key=lambda ranked_line: ranked_line[0])]
        if len(lines) > MAX_PROBLEMS:
            lines[MAX_PROBLEMS:] = [f"and {len(lines) - MAX_PROBLEMS} more"]
        kind_of_error = MissingFileError if self.misses_file else ConfigError
        return kind_of_error(*lines, *self.lines)

    def _locate(self, path: KeyPath, key_line: Mapping[KeyPath, int]) -> tuple[tuple[int, int], str]:
        """Find the value at a path: a sort key, by line and then by setting, and the text of its location."""
        for end in range(len(path), 0, -1):
            if path[:end] in self.origins:
                setting = self.origins[path[:end]]
                shared = min(len(path), len(setting.path))
                # a setting that creates a table for one key is not the location of another, missing key
                if path[:shared] == setting.path[:shared]:
                    return (1, list(self.origins).index(path[:end])), safe_text(setting.shown)
                break
            is_replaced = any(path[:start] in self.origins for start in range(end))
            if path[:end] in key_line and not is_replaced:
                # nobody has the lines of the starter config before them
                line = key_line[path[:end]]
                return (0, line), self.name if self.name == STARTER else f"{self.name}:{line}"
        # a parameter of a law without a table is required by the key `models` or `frictions`, and a property of a
        # material of the library by the key that names it
        required_by = {"model": "models", "friction": "frictions"}.get(str(path[0])) if path else None
        if required_by:
            return self._locate((required_by,), key_line)
        keys = [key for key in MATERIAL_KEYS if path[:2] == ("materials", self.table("sweep").get(key))]
        return self._locate(("sweep", keys[0]), key_line) if keys else ((0, 0), self.name)


def _library_setting(name: str, without: Iterable[str] = ()) -> Setting:
    """Define a material by its record in the library, except for some properties."""
    path = ("materials", name)
    properties = {key: value for key, value in library()[name].items() if key not in without}
    text = override_text(path, properties)
    return Setting(path, properties, argument("overrides", text), text)


def open_config(source: str | Path | Mapping[str, object] | None, plugins: Sequence[ForceModel] = ()) -> Draft:
    """Open the config of a TOML file or a mapping, in which names of files are relative to its folder.

    None is the starter config, for which they are relative to the working directory.
    """
    if source is None:
        return replace(open_text(STARTER_CONFIG.read_text(encoding="utf-8"), STARTER, plugins), folder=Path())
    # a dataset is a mapping, too
    if not isinstance(source, Mapping) or hasattr(source, "data_vars"):
        if not isinstance(source, str | Path):
            raise UsageError(f"source: got {type_of(source)}, expected a mapping, or the name of a TOML file")
        path = Path(source)
        return replace(open_text(read_text(path), str(path), plugins), folder=path.parent)
    data, problems = to_plain_data(source)
    text = "" if problems else json.dumps(data, separators=(",", ":"), default=str)
    return Draft(data, text, "config", catalogue(plugins), Path(), problems=tuple(problems))


def reject_law_key(source: object, parameter: str, plugins: Sequence[ForceModel] = ()) -> None:
    """Raise an error if a source is the key of a law and no file; it names the parameter that takes the key."""
    if isinstance(source, str | Path) and str(source) in catalogue(plugins) and not Path(source).exists():
        hint = f"did you mean {argument(parameter, str(source))}?"
        raise MissingFileError(f"{source}: cannot be read: No such file or directory; {hint}")


def open_text(text: str, name: str, plugins: Sequence[ForceModel] = ()) -> Draft:
    """Open a TOML text, or a JSON text, which starts with a brace; no file is read for it."""
    data, problems = to_plain_data(parse_document(text, name))
    return Draft(data, text, name, catalogue(plugins), problems=tuple(problems))


def add_library_materials(draft: Draft) -> Draft:
    """Add a table for each library material that a ball may have and the config does not define."""
    if not isinstance(draft.data.get("materials", {}), dict):
        return draft
    sweep = draft.table("sweep")
    columns = as_table(sweep.get("cases")) | as_table(draft.table("data").get("columns"))
    names = dict.fromkeys(
        name for key in MATERIAL_KEYS for table in (sweep, columns) for name in listed_names(table.get(key))
    )
    properties = [name for name in map(InputName.parse, columns) if name.material]
    names |= {name.material: None for name in properties}
    settings = [
        # a column of cases or of measurements replaces a property
        _library_setting(name, without=[other.key for other in properties if other.material == name])
        for name in names
        if name in library() and name not in draft.table("materials")
    ]
    if not settings:
        return draft
    materials = {str(setting.path[1]): setting.value for setting in settings}
    data = {**draft.data, "materials": {**draft.table("materials"), **materials}}
    return replace(draft, data=data, settings=(*settings, *draft.settings))


def listed_names(value: object) -> list[str]:
    """List the names in a name or a list of names."""
    return [name for name in (value if isinstance(value, list) else [value]) if isinstance(name, str)]
