"""A law and an impact, as a version of a code simulates them."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

from ..config.load import Config
from ..contact.impacts import Impacts
from ..contact.model import ForceModel
from ..contact.models import find
from ..engine.plugins import Plugins
from ..errors import UsageError, did_you_mean
from ..formatting import number
from ..inverse.solve import placeholder, solve_input, unknown_of
from ..inverse.timestep import FixedStepLaw, fixed_step_law
from ..results.single_impact import ConfigSource, open_source, single_point
from ..text import safe_text
from .code import Code, Collision

# phases over which the mean, the least and the largest restitution are taken
PHASES = 400
# steps before the contact, and contact times that a script runs
STEPS_BEFORE, CONTACTS_RUN = 3, 2.5
# a ball whose radius is not known and does not matter is larger than its peak indentation by this factor
RADIUS_PER_PEAK = 100.0


@dataclass(frozen=True)
class ExportProblem:
    """A law and an impact that are written for a version of a code.

    Parameters
    ----------
    code, version : the code and its release
    law : the law, the impact and the contact time of the continuous law
    e_continuous, peak : restitution [-] and peak indentation [m] of the continuous law
    config : the config of the impact
    solved : the parameter that was solved for, with the wanted e; "" for none
    first : names of axes of the source that are at their first value
    missing : the default law of the newest release, if none was asked for and this one has another; else ""
    """

    code: Code
    version: str
    law: FixedStepLaw
    e_continuous: float
    peak: float
    config: Config
    solved: str
    first: tuple[str, ...]
    missing: str

    @property
    def model(self) -> ForceModel:
        return self.law.model

    @property
    def wanted(self) -> float:
        """The e that is asked for, or that of the continuous law where none can be asked for."""
        return self.law.e if self.law.has_e else self.e_continuous

    def collision(self, dt: float, phase: float) -> Collision:
        """The collision whose contact begins at a phase of a step dt [s]."""
        values = input_values(self.law.impact)
        for name in ("R1", "R2"):
            if math.isnan(values[name]):
                values[name] = RADIUS_PER_PEAK * self.peak
        names = self.config.scalars
        material1, material2 = (
            str(names.get(f"material{ball}", names.get("material", ""))) for ball in ("1", "2")
        )
        return Collision(
            model=self.model,
            version=self.version,
            values=values,
            materials=(material1, material2),
            has_own_K="K" in names or f"{self.model.key}.K" in names,
            dt=dt,
            gap=(STEPS_BEFORE - phase) * dt * values["v0"],
            steps=STEPS_BEFORE + math.ceil(CONTACTS_RUN * self.law.contact_time / dt),
        )


def input_values(impact: Impacts) -> dict[str, float]:
    """All inputs and derived quantities of one impact, by name, in SI."""
    names = [field.name for field in fields(impact) if field.name != "parameters"]
    names += ["m", "R_eff", "E_eff", "v0", *impact.parameters]
    return {name: float(impact.quantity(name)[0]) for name in names}


def law_of_code(code: Code, model: str, version: str) -> str:
    """The key of a code's law for a key of the catalogue, in a version of the code.

    Parameters
    ----------
    code : the code
    model : one of its laws, or a law of the catalogue that it has under a name of its own
    version : of the code

    Raises
    ------
    UsageError : the code, or this version of it, has no such law

    >>> from impact.exporters.codes import find_code
    >>> law_of_code(find_code("lammps"), "tsuji-1992", "20250722")
    'lammps-coeff-restitution-hertz'
    """
    keys = list(code.laws)
    key = model
    if key not in keys:
        wanted = find(key)
        same = [k for k in keys if (find(k).same_as or k) == (wanted.same_as or wanted.key)]
        if not same:
            raise UsageError(f'{code.title} has no law "{safe_text(key)}"; {did_you_mean(key, keys)}')
        key = same[0]
    return code.entry(key, version)


def first_law(code: Code, models: Sequence[str], version: str) -> str:
    """The law of a code for the first of some models that a version of it has.

    Raises
    ------
    UsageError : the code, or this version of it, has none of them

    >>> from impact.exporters.codes import find_code
    >>> lammps = find_code("lammps")
    >>> [first_law(lammps, tuple(lammps.laws), version) for version in ("20250722", "20210929")]
    ['lammps-coeff-restitution-hertz', 'lammps-tsuji-without-root']
    """
    laws = {find(key).same_as or key for key in code.laws}
    common = [key for key in models if (find(key).same_as or key) in laws]
    if not common:
        shown = ", ".join(models[:3]) + (f" and {len(models) - 3} more" if len(models) > 3 else "")
        raise UsageError(f"{code.title} has none of the laws {safe_text(shown)}; --model names one of its own")
    for key in common:
        with contextlib.suppress(UsageError):
            return law_of_code(code, key, version)
    return law_of_code(code, common[0], version)


def prepare_export(
    code: Code,
    model: str | None,
    version: str,
    source: ConfigSource,
    at: Mapping[str, float | str],
    overrides: Sequence[str],
) -> ExportProblem:
    """The law and the impact to write; where e is given for a law without it, its damping is solved for.

    Raises
    ------
    UsageError : the code has no such law, or no damping gives the e
    ConfigError : an input is not allowed
    """
    plugins, laws, missing = Plugins(()), tuple(code.laws), ""
    point_source = open_source(source, overrides, plugins)
    if model is not None:
        key = law_of_code(code, model, version)
    elif models := point_source.models:
        key = first_law(code, models, version)
    else:
        key, newest = (first_law(code, laws, release) for release in (version, code.newest))
        missing = "" if key == newest else newest
    law = find(key)
    at, solved = dict(at), ""
    if "e" in at and "e" not in law.quantities:
        if key not in code.damping:
            raise UsageError(f"--at e: {key} has no e, and no parameter that sets it")
        parameter = code.damping[key]
        solved = f"{key}.{parameter}"
        if solved in at:
            raise UsageError(f"--at: got e and {solved}, expected one of the two")
        at |= placeholder(law, unknown_of(law, parameter))
    config, first = single_point(point_source, key, at)
    if solved:
        wanted = float(config.scalars["e"])
        result = solve_input(config, plugins, unknown_of(law, parameter), {"e_out": wanted})
        if not result.roots:
            least, most = map(number, result.attainable)
            raise UsageError(f"--at e={number(wanted)}: {key} delivers {least} to {most} at any {parameter}")
        config = replace(config, scalars={**config.scalars, solved: result.roots[0].value})
    fixed, collision = fixed_step_law(config, PHASES, code.scheme)
    return ExportProblem(
        code=code,
        version=version,
        law=fixed,
        e_continuous=collision["e_out"],
        peak=collision["peak_indentation"],
        config=config,
        solved=solved,
        first=first,
        missing=missing,
    )
