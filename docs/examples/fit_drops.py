"""Fit three laws to drop tests of a ball, predict a faster drop, and see which law keeps the e asked for."""

from pathlib import Path
from typing import Any

import joblib
import lmfit
import numpy as np
import pandas as pd
import pint

import impact

unit: pint.UnitRegistry[Any] = pint.UnitRegistry()
BALL = {"R1": 2 * unit.cm, "m1": 2.7 * unit.g, "material1": "ball"}
PLATE = {"R2": np.inf, "m2": np.inf, "material2": "plate"}
MATERIALS = {"ball": {"E": 2 * unit.GPa, "nu": 0.4}, "plate": {"E": 200 * unit.GPa, "nu": 0.3}}
# the free parameter of each law, and its bounds
LAWS = {
    "kuwabara-kono-1987": ("A", 1e-8, 1e-3),
    "tsuji-1992": ("e", 0.05, 1.0),
    "gharib-hurmuzlu-2012": ("e", 0.05, 1.0),
}


def fit(law: str, drops: pd.DataFrame) -> dict[str, object]:
    """Fit the parameter of a law to measured restitutions; returns a row of the table."""
    name, least, most = LAWS[law]
    config = {"sweep": {**BALL, **PLATE, "v1": 1.0}, "materials": MATERIALS}
    problem = impact.prepare(config, model=law, at={name: least}, outputs="e_out")

    def residuals(tried: lmfit.Parameters) -> np.ndarray:
        e_out = problem(tried.valuesdict(), v1=drops["v1 [m/s]"])["e_out"]
        return np.asarray((e_out - drops["e_out"]) / drops["sigma"])

    start = {name: {"value": np.sqrt(least * most), "min": least, "max": most}}
    fitted = lmfit.minimize(residuals, lmfit.create_params(**start), method="least_squares")
    values = fitted.params.valuesdict()
    return {"law": law, **values, "chi2": fitted.redchi, "e at 5 m/s": problem(values, v1="5 m/s")["e_out"]}


if __name__ == "__main__":
    drops = pd.read_csv(Path(__file__).parents[1] / "calibrate" / "drops.csv", skipinitialspace=True)
    rows = joblib.Parallel(n_jobs=2)(joblib.delayed(fit)(law, drops) for law in LAWS)
    print(pd.DataFrame(rows).sort_values("chi2").to_string(index=False, float_format="{:.3g}".format))
    asked = impact.sweep(models=list(LAWS)[1:], e=drops["e_out"], v1=np.geomspace(0.1, 3, 4) * unit.m / unit.s)
    ranking = impact.recommend(asked, tol="1 %", sel={"v1": 100 * unit.mm / unit.s})
    print(ranking.to_dataframe()[["model", "share", "max_error"]].to_string(index=False))
