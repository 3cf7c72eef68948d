"""`impact conform`: a correct engine passes every check, a wrong one fails the check that names its fault."""

from __future__ import annotations

import importlib.util
import json
import math
import os
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import impact
from impact.conformance.adapters import FACTS, open_adapter
from impact.conformance.checks import checks_of
from impact.conformance.registry import ENGINES
from impact.conformance.suite import QUESTION_KEYS, read_suite
from impact.errors import ResultError, UsageError
from impact.results.board import CHECKS

from .conftest import ROOT, Run

EXAMPLES = ROOT / "docs" / "conform"
Values = dict[str, Any]
Engine = Callable[[Values], Values]
COLLISIONS = [trial.question for trial in read_suite().values()]


def load_rigid() -> Engine:
    """The correct engine of the page."""
    spec = importlib.util.spec_from_file_location("rigid", EXAMPLES / "rigid.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.collide  # type: ignore[no-any-return]


rigid = load_rigid()


def failed(board: impact.Board) -> set[str]:
    """The names of the checks that failed."""
    return {check["check"] for engine in board.engines for check in engine["checks"] if check["status"] == "fail"}


# ---- ten wrong engines


def sign_of_a_spin(c: Values) -> Values:
    """The spin of ball 1 turns the other way."""
    answer = rigid(c)
    return answer | {"omega1": 2 * c["omega1"] - answer["omega1"]}


def half_of_mu(c: Values) -> Values:
    return rigid(c | {"mu": c["mu"] / 2})


def friction_without_bound(c: Values) -> Values:
    return rigid(c | {"mu": 1e9})


def e_lost_at_an_angle(c: Values) -> Values:
    return rigid(c | {"e": c["e"] * (1 - 0.1 * min(abs(c["u1"] - c["u2"]), 1.0))})


def energy_gained(c: Values) -> Values:
    """The energy after the impact is 1 % above that before."""
    return rigid(c | {"e": math.sqrt(1.01), "mu": 0.0})


def momentum_of_one_ball(c: Values) -> Values:
    answer = rigid(c)
    return answer | ({} if c["m2"] is None else {"v2": c["v2"], "u2": c["u2"]})


def threshold_in_a_frame(c: Values) -> Values:
    """A slow ball 1 does not bounce, however fast ball 2 is."""
    return rigid(c | ({"e": 0.0} if abs(c["v1"]) < 0.05 else {}))


def length_in_mm(c: Values) -> Values:
    """Friction is that of a contact of 50 mm, whatever the radius is."""
    return rigid(c | {"mu": c["mu"] * min(1.0, 1000 * c["R1"] / 50)})


class Stateful:
    """What was left of an impact warms the next one."""

    def __init__(self) -> None:
        self.last = 0.0

    def __call__(self, c: Values) -> Values:
        answer = rigid(c)
        answer["omega1"] += 1e-15 * self.last
        self.last = answer["u1"]
        return answer


def not_a_number(c: Values) -> Values:
    """The angle of an impact along the normal."""
    return rigid(c) | ({"u1": math.nan} if c["u1"] == c["u2"] else {})


WRONG: dict[str, tuple[Engine, set[str]]] = {
    # the check that names the fault, and those that follow from it
    "spin": (sign_of_a_spin, {"spin", "angular_momentum", "friction", "energy", "exchange"}),
    "friction": (half_of_mu, {"friction"}),
    "friction_bound": (friction_without_bound, {"friction_bound", "friction"}),
    "restitution": (e_lost_at_an_angle, {"restitution"}),
    "energy": (energy_gained, {"energy", "restitution", "friction"}),
    "momentum": (
        momentum_of_one_ball,
        {"momentum", "angular_momentum", "energy", "separates", "restitution", "friction", "spin", "exchange"},
    ),
    "frame": (threshold_in_a_frame, {"frame", "restitution", "exchange"}),
    "scale": (length_in_mm, {"scale", "friction"}),
    "repeat": (Stateful(), {"repeat"}),
    "finite": (not_a_number, {"finite"}),
}


def test_a_correct_engine_of_thirty_lines_passes_every_check() -> None:
    board = impact.conform(adapter=rigid)
    assert board.passed, str(board)
    # no empty line for failures that there are not
    assert str(board) == str(board).rstrip()
    assert len((EXAMPLES / "rigid.py").read_text(encoding="utf-8").splitlines()) <= 30
    checks = board.as_dict()["checks"]
    assert {check["status"] for check in checks} == {"pass"}
    # rounding: far below each tolerance
    equal = [check for check in checks if check["check"] in ("momentum", "angular_momentum", "spin", "friction")]
    assert max(abs(check["asked"] - check["delivered"]) for check in equal) < 1e-13


@pytest.mark.parametrize("fault", WRONG)
def test_a_wrong_engine_fails_the_check_that_names_its_fault(fault: str) -> None:
    engine, allowed = WRONG[fault]
    names = failed(impact.conform(adapter=engine))
    assert fault in names
    if fault != "finite":
        # nothing can be said of numbers that are none
        assert names <= allowed


def test_the_worst_collision_of_a_check_is_one_that_delivers_no_number() -> None:
    board = impact.conform(adapter=not_a_number, only=["stick-10-equal", "normal-e50-middle-equal"])
    row = next(line.split() for line in str(board).splitlines() if line.startswith("momentum "))
    assert row[4:7] == ["normal-e50-middle-equal", "0", "–"]


def test_every_check_has_a_wrong_engine_that_fails_it() -> None:
    """Of the checks without an engine above: mirror, exchange, step and separates."""

    def one_sided(c: Values) -> Values:
        return rigid(c | {"mu": c["mu"] if c["u1"] > c["u2"] else 0.9 * c["mu"]})

    def heavy_first(c: Values) -> Values:
        return rigid(c | {"mu": c["mu"] * (1.0 if c["m2"] is None or c["m1"] <= c["m2"] else 0.9)})

    def step_grows(c: Values) -> Values:
        return rigid(c | {"e": c["e"] + 1e-9 / c["dt"]})

    def ghost(c: Values) -> Values:
        return c

    for name, engine in (
        ("mirror", one_sided),
        ("exchange", heavy_first),
        ("step", step_grows),
        ("separates", ghost),
    ):
        assert name in failed(impact.conform(adapter=engine)), name


def test_the_numbers_of_a_check_are_those_of_its_formula() -> None:
    """An added spin, and an answer that pulls, of a collision with a slip, in the scales of docs/conform.md."""
    d = 0.25
    c: Values = read_suite()["frame-mirrored"].question
    speed = abs(c["v1"] - c["v2"]) + abs(c["u1"] - c["u2"] + c["R1"] * c["omega1"] + c["R2"] * c["omega2"])
    of_balls = [tuple(abs(c[name + ball]) for name in ("m", "R", "inertia", "v", "u", "omega")) for ball in "12"]
    scale = sum(inertia * omega + m * R * (v + u) for m, R, inertia, v, u, omega in of_balls)
    m = 1 / (1 / c["m1"] + 1 / c["m2"])
    added = {
        "angular_momentum": c["inertia1"] * d / scale,
        "spin": c["inertia1"] * d / c["R1"] / (m * speed),
        "mirror": c["R1"] * d / speed,
    }
    for engine, asked, delivered in (
        (lambda c: rigid(c) | {"omega1": rigid(c)["omega1"] + d * (c["id"] == "frame-mirrored")}, {}, added),
        # the impulse of balls that pull has no friction, which keeps all slip
        (lambda c: rigid(c | {"e": -1.5, "mu": 0.0}), {"friction": -1.0}, {"friction": -1.0}),
    ):
        checks = impact.conform(adapter=engine, only="frame-mirrored").as_dict()["checks"]
        values = {check["check"]: check for check in checks}
        assert {name: values[name]["asked"] for name in asked} == pytest.approx(asked)
        assert {name: values[name]["delivered"] for name in delivered} == pytest.approx(delivered, rel=1e-9)


# ---- the set


def test_the_set_is_what_its_specification_says() -> None:
    trials = read_suite("conformance-1")
    groups = Counter(name.partition("-")[0] for name in trials)
    assert groups.keys() == {"normal", "slide", "stick", "spin", "frame", "scale", "rest", "step"}
    normal = [trial.question for name, trial in trials.items() if name.startswith("normal")]
    assert {question["e"] for question in normal} == {0.9, 0.5, 0.1}
    assert len({question["v1"] for question in normal}) == 3
    assert {question["m2"] for question in normal} == {1.0, 10.0, None}
    slides = [trial.question for name, trial in trials.items() if name.startswith("slide")]
    angles = {(c["mu"], round(math.degrees(math.atan2(c["u1"], c["v1"])))) for c in slides}  # type: ignore[arg-type]
    assert angles == {(mu, angle) for mu in (0.1, 0.3, 0.5) for angle in (45, 60, 75, 85)}
    small, large = (trials[f"scale-{size}-stick"].question["R1"] for size in ("1mm", "1m"))
    assert (small, large) == (1e-3, 1.0)
    assert all(
        question["v1"] == question["v2"] for question in COLLISIONS if str(question["id"]).startswith("rest")
    )


def test_a_collision_is_the_mapping_of_the_protocol() -> None:
    for question in COLLISIONS:
        assert tuple(question) == QUESTION_KEYS
        assert json.loads(json.dumps(question)) == question
    assert {check for trial in read_suite().values() for check in checks_of(trial)} == {
        *("finite", "momentum", "angular_momentum", "energy", "separates", "restitution", "friction"),
        *("friction_bound", "spin", "frame", "mirror", "exchange", "scale", "repeat", "step"),
    }


def test_a_released_set_never_changes() -> None:
    """Its collisions have these numbers in all versions of the program."""
    import hashlib

    text = json.dumps([[f"{v:.9g}" if isinstance(v, float) else v for v in c.values()] for c in COLLISIONS])
    assert hashlib.sha256(text.encode()).hexdigest().startswith("931cdc9a")


# ---- what adapters state


def test_tolerances_follow_from_what_the_first_answer_states() -> None:
    def tolerances(**facts: str) -> Values:
        board = impact.conform(adapter=lambda c: rigid(c) | facts, only="slide-mu10-60-equal")
        return {check["check"]: check["tolerance"] for check in board.as_dict()["checks"]}

    rigid_engine, compliant = tolerances(), tolerances(kind="compliant")
    assert (rigid_engine["momentum"], rigid_engine["restitution"], rigid_engine["repeat"]) == (1e-9, 1e-6, 0.0)
    assert (compliant["energy"], compliant["friction"]) == (1e-9, 0.02)
    assert tolerances(precision="float32")["momentum"] == 1e-5
    # single precision widens a tolerance, and narrows none
    assert tolerances(precision="float32", kind="compliant")["friction"] == 0.02


def test_a_tolerance_is_an_option_by_name_or_for_all() -> None:
    only = "slide-mu10-60-equal"
    assert failed(impact.conform(adapter=half_of_mu, only=only, tol={"friction": 0.5})) == set()
    assert failed(impact.conform(adapter=half_of_mu, only=only, tol={"friction": 0.5, "all": 0.0}))
    with pytest.raises(UsageError, match=r'tol\["frction"\]: .* did you mean "friction"\?'):
        impact.conform(adapter=rigid, tol={"frction": 1.0})
    # with which no number would fail
    with pytest.raises(UsageError, match="got inf, expected a number >= 0"):
        impact.conform(adapter=rigid, tol=math.inf)


def test_an_engine_with_a_friction_law_of_the_catalogue_is_judged_by_it() -> None:
    """A spring that reverses the slip: its own beta passes, that of rigid balls does not."""
    from impact.conformance.conform import betas_of_law
    from impact.conformance.suite import Question

    law: Values = {"law": "cundall-strack-1979", "parameters": {"kt_over_kn": 2 / 7}}
    only = ["stick-10-equal", "slide-mu30-75-wall", "spin-both"]
    questions: list[Question] = [read_suite()[name].question for name in only]
    betas = betas_of_law(questions, "cundall-strack-1979", "anagnostopoulos-1988", law["parameters"])
    assert betas["stick-10-equal"] > 0.5

    def spring(c: Values) -> Values:
        """Rigid balls with the P that gives this beta."""
        wall, answer = c["m2"] is None, rigid(c)
        shares = [1 / c["m1"] + c["R1"] ** 2 / c["inertia1"]]
        shares += [] if wall else [1 / c["m2"] + c["R2"] ** 2 / c["inertia2"]]
        g0 = c["u1"] + c["R1"] * c["omega1"] - c["u2"] + (0.0 if wall else c["R2"] * c["omega2"])
        P = g0 * (1 + betas[c["id"]]) / sum(shares)
        answer |= {"u1": c["u1"] - P / c["m1"], "omega1": c["omega1"] - c["R1"] * P / c["inertia1"]}
        if not wall:
            answer |= {"u2": c["u2"] + P / c["m2"], "omega2": c["omega2"] - c["R2"] * P / c["inertia2"]}
        return answer

    named = impact.conform(adapter=lambda c: spring(c) | law, only=only, tol={"friction_bound": 0.5})
    assert named.passed, str(named)
    assert "friction" in failed(impact.conform(adapter=spring, only=only))


@pytest.mark.parametrize("e", [0.5, 1.0])
def test_a_stiffness_in_si_is_beside_that_of_a_spring_and_dashpot_of_the_contact_time(e: float) -> None:
    from impact.conformance.conform import betas_of_law

    c: Values = {**read_suite()["spin-shell"].question, "e": e, "mu": 1e5}
    m = 1 / (1 / c["m1"] + 1 / c["m2"])
    m_t = 1 / (1 / m + c["R1"] ** 2 / c["inertia1"] + c["R2"] ** 2 / c["inertia2"])
    k_t = 0.1 * m * (math.pi**2 + math.log(e) ** 2) / c["contact_time"] ** 2
    names = "cundall-strack-1979", "anagnostopoulos-1988"
    chosen = {"k_t": k_t}, {"kt_over_kn": 0.1}
    beta, of_ratio = (betas_of_law([c], *names, parameters)[c["id"]] for parameters in chosen)
    assert beta == pytest.approx(of_ratio, rel=1e-9)
    if e == 1.0:
        # a spring that sticks to the end
        assert beta == pytest.approx(-math.cos(math.sqrt(k_t / m_t) * c["contact_time"]), rel=1e-6)


@pytest.mark.parametrize("model", ["hertz", "tsuji-1992-no-tension"])
def test_an_engine_may_name_a_contact_force_of_hertz(model: str) -> None:
    """Where a spring slides all the time, as here, its beta is that of rigid balls."""
    law = {"law": "lammps-mindlin-force", "parameters": {"kt_over_kn": 0.3, "xt": 0.0}}
    e = {"hertz": 1.0, "tsuji-1992-no-tension": 0.9018}[model]

    def answer(collision: Any) -> Any:
        return rigid(collision | {"e": e}) | law | {"model": model}

    board = impact.conform(adapter=answer, only="slide-mu10-85-equal", tol={"friction": 1e-4})
    assert "friction" not in failed(board)


def test_rigid_balls_have_the_beta_of_coulomb_with_a_contact_force_that_does_not_pull() -> None:
    """As docs/conform.md says: the default one pulls, and its friction is mu |F|."""
    only, law = "slide-mu30-75-wall", {"law": "coulomb-1785"}
    assert failed(impact.conform(adapter=lambda c: rigid(c) | law, only=only)) == {"friction"}
    assert impact.conform(adapter=lambda c: rigid(c) | law | {"model": "exact-hysteresis"}, only=only).passed


def test_what_an_engine_cannot_do_is_counted_and_not_failed() -> None:
    def no_walls(c: Values) -> Values:
        return {"id": c["id"], "error": "no walls"} if c["m2"] is None else rigid(c)

    board = impact.conform(adapter=no_walls)
    data = board.as_dict()
    assert board.passed
    assert data["summary"]["failed"] == 0
    of_walls = [check for check in data["checks"] if check["status"] == "not_supported"]
    assert {check["id"] for check in of_walls} == {c["id"] for c in COLLISIONS if c["m2"] is None}
    assert data["summary"]["not_supported"] == len(of_walls)
    assert all(math.isnan(check["delivered"]) for check in of_walls)


def test_what_follows_from_a_collision_that_cannot_be_done_is_not_judged() -> None:
    def no_spin(c: Values) -> Values:
        return {"id": c["id"], "error": "no spin"} if c["id"] == "spin-both" else rigid(c)

    board = impact.conform(adapter=no_spin, only=["frame-fast"])
    statuses = {check["check"]: check["status"] for check in board.as_dict()["checks"]}
    assert (statuses["frame"], statuses["spin"]) == ("not_supported", "pass")


def test_engines_of_one_name_are_numbered_and_have_the_version_that_they_state() -> None:
    stated = [lambda c: rigid(c) | {"engine": "rigid", "version": "2.0"}] * 3
    board = impact.conform(adapter=stated, only="normal-e50-middle-equal")
    names = [(engine["engine"], engine["version"]) for engine in board.engines]
    assert names == [("rigid", "2.0"), ("rigid #2", "2.0"), ("rigid #3", "2.0")]


def test_collisions_are_asked_again_in_reverse_so_that_another_one_comes_before_each() -> None:
    asked = []

    def engine(c: Values) -> Values:
        asked.append(c["id"])
        return rigid(c)

    ids = ["normal-e50-middle-equal", "stick-10-equal", "spin-both"]
    impact.conform(adapter=engine, only=ids)
    assert asked == [*ids, *ids[::-1]]


# ---- programs


def program(folder: Path, text: str) -> str:
    """The command line of an adapter in Python."""
    path = folder / "program.py"
    path.write_text(f"import json, sys, time\n{text}\n", encoding="utf-8")
    return f"python3 {path}"


ANSWER = f"""
sys.path.insert(0, {str(EXAMPLES)!r})
from rigid import collide
def answer(line):
    return json.dumps(collide(json.loads(line)))
"""
BAD_PROGRAMS = {
    "sys.exit(3)": "the adapter ended with exit code 3",
    "raise KeyError('no m3')": "the adapter ended with exit code 1: KeyError: 'no m3'",
    "input(); sys.exit(0)": "collision normal-e90-slow-equal: the adapter ended with exit code 0",
    "time.sleep(60)": "collision normal-e90-slow-equal: no answer after 1 s (--timeout)",
    "while True: print('x' * 1000, end='')": "a line of more than 64 KiB",
    "print('hello', flush=True); time.sleep(60)": 'got "hello", expected one line of JSON on stdout',
    "print('[1]', flush=True); time.sleep(60)": "got [1], expected an object of JSON",
    "print('{}', flush=True); time.sleep(60)": "got an answer to None",
    "print('{\"id\": \"normal-e90-slow-equal\", \"v1\": \"fast\"}', flush=True); input()": "v1: got 'fast'",
    "print('{\"id\": \"normal-e90-slow-equal\", \"v1\": 0}', flush=True); input()": "the answer has no v2",
    ANSWER + "for line in sys.stdin: print(answer(line)); print(answer(line), flush=True)":
        "got an answer to 'normal-e90-slow-equal'",
    ANSWER + "for line in sys.stdin: print(answer(line)[:-1] + ', \"kind\": \"soft\"}', flush=True)":
        "kind: got 'soft', expected impulse or compliant",
    ANSWER + "for line in sys.stdin: print(answer(line)[:-1] + ', \"law\": \"colomb\"}', flush=True)":
        'law: no friction law "colomb"',
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("text", BAD_PROGRAMS)
def test_a_program_that_does_not_speak_the_protocol_is_refused_in_one_line(
    text: str, cli: Run, tmp_path: Path
) -> None:
    done = cli("conform", "--adapter", program(tmp_path, text), "--timeout", "1")
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert done.stderr.startswith("--adapter: ")
    assert BAD_PROGRAMS[text] in done.stderr


@pytest.mark.parametrize(
    ("changes", "message"),
    [({"v1": True}, "v1: got True, expected a number"), ({"id": None}, "got an answer to None")],
)
def test_an_answer_of_a_function_that_is_none_is_refused(changes: Values, message: str) -> None:
    def engine(c: Values) -> Values:
        return {key: value for key, value in (rigid(c) | changes).items() if value is not None}

    with pytest.raises(UsageError, match=message):
        impact.conform(adapter=engine)


def test_what_a_program_prints_before_it_ends_is_read() -> None:
    """However fast it ends, so that the message does not depend on who is first."""
    with open_adapter(["echo", "hello"], 5.0) as ask:
        time.sleep(0.5)
        with pytest.raises(UsageError, match='got "hello", expected one line of JSON on stdout'):
            ask(COLLISIONS[0])
        with pytest.raises(UsageError, match="the adapter ended with exit code 0"):
            ask(COLLISIONS[1])


def test_words_that_have_no_effect_are_refused(cli: Run) -> None:
    for words, message in (
        (["--adapter", " "], "--adapter: got ' ', expected FILE.py:FUNCTION or \"PROGRAM ARGUMENTS\"\n"),
        (["--adapter", "rigid.py:collide", "--program", "absent"], "--program: set without an engine"),
    ):
        done = cli("conform", *words)
        assert done.returncode == 2
        assert done.stderr.startswith(message)


def test_a_number_that_c_prints_as_nan_is_judged(cli: Run, tmp_path: Path) -> None:
    text = (
        ANSWER
        + """
for line in sys.stdin:
    print(json.dumps(json.loads(answer(line)) | {"v1": 7.5}).replace("7.5", "-nan"), flush=True)
"""
    )
    done = cli("conform", "--adapter", program(tmp_path, text), "--only", "stick-10-equal", "--json")
    statuses = {check["check"]: check for check in json.loads(done.stdout)["checks"]}
    assert (done.returncode, statuses["finite"]["status"]) == (1, "fail")
    assert statuses["momentum"]["delivered"] is None


@pytest.mark.parametrize("value", [math.inf, -math.inf, 1e308, -1e308, 1e200, math.nan])
@pytest.mark.parametrize("key", ["v1", "u2", "omega1"])
def test_a_number_of_any_size_is_judged(key: str, value: float) -> None:
    names = failed(impact.conform(adapter=lambda c: rigid(c) | {key: value}, only=["spin-both", "frame-mirrored"]))
    assert ("finite" in names) == (not math.isfinite(value))
    assert "angular_momentum" in names or key == "v1"
    assert "energy" in names


def test_open_mpi_of_an_adapter_starts_no_daemon(tmp_path: Path) -> None:
    """The daemon would start a new session, in which it outlives the adapter."""
    text = "import os\nprint(os.environ['OMPI_MCA_ess_singleton_isolated'], flush=True)\ninput()"
    with open_adapter(program(tmp_path, text), 5.0) as ask:
        assert ask(COLLISIONS[0]) == 1


@pytest.mark.slow
def test_no_process_is_left(tmp_path: Path) -> None:
    """Neither of the adapter nor of what it started."""
    text = "import subprocess\nchild = subprocess.Popen(['sleep', '600'])\n"
    text += f"open({str(tmp_path / 'pid')!r}, 'w').write(str(child.pid))\ntime.sleep(600)"
    with pytest.raises(UsageError, match="no answer after 1 s"):
        impact.conform(adapter=program(tmp_path, text), timeout=1)
    pid = int((tmp_path / "pid").read_text(encoding="utf-8"))
    state = Path(f"/proc/{pid}/stat")
    deadline = time.monotonic() + 10
    while state.exists() and state.read_text(encoding="utf-8").split()[2] != "Z":
        assert time.monotonic() < deadline, "it was not killed"


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")
def test_the_example_in_c_passes_every_check(cli: Run, tmp_path: Path) -> None:
    adapter = tmp_path / "rigid"
    subprocess.run(["gcc", "-Wall", "-Werror", "-o", adapter, EXAMPLES / "rigid.c", "-lm"], check=True)
    done = cli("conform", "--adapter", str(adapter), "--json")
    data = json.loads(done.stdout)
    assert (done.returncode, data["summary"]["failed"], data["engine"]) == (0, 0, "rigid")


# ---- the command, the page and the board


def test_the_command_judges_a_python_function_of_a_file(cli: Run) -> None:
    done = cli("conform", "--adapter", f"{EXAMPLES / 'rigid.py'}:collide", "--json")
    data = json.loads(done.stdout)
    assert done.returncode == 0, done.stderr
    assert list(data) == ["engine", "version", "set", "kind", "checks", "summary"]
    assert (data["engine"], data["set"], data["kind"]) == ("rigid.py:collide", "conformance-1", "impulse")
    assert list(data["checks"][0]) == ["id", "check", "asked", "delivered", "tolerance", "status"]
    assert list(data["summary"]) == ["passed", "failed", "not_supported"]
    assert data["summary"]["passed"] == len(data["checks"])
    assert data == impact.conform(adapter=f"{EXAMPLES / 'rigid.py'}:collide").as_dict()


BAD_COMMANDS = {
    (): "expected the name of an engine",
    ("pymonk",): 'no adapter of an engine "pymonk"; did you mean "pymunk"?',
    ("--adapter", "no_such_program"): 'no executable program "no_such_program"',
    ("--adapter", str(EXAMPLES / "rigid.c")): f'no executable program "{EXAMPLES / "rigid.c"}"',
    ("--adapter", "nowhere.py:collide"): "nowhere.py: does not exist",
    ("--adapter", f"{EXAMPLES / 'rigid.py'}:colide"): "has no attribute 'colide'",
    ("--adapter", f"{EXAMPLES / 'rigid.py'}:collide", "--only", "slide"): 'no collision "slide"',
    ("--adapter", f"{EXAMPLES / 'rigid.py'}:collide", "--suite", "conformance-9"): 'no set "conformance-9"',
    ("--adapter", f"{EXAMPLES / 'rigid.py'}:collide", "-o", "page.pdf"): "expected a name that ends in .html",
    ("--list", "--program", "no_such_python"): 'no program "no_such_python"',
    ("pymunk", "--list"): "--list: got more than this option, expected it alone",
    ("pymunk", "--program", "no_such_python"): 'no program "no_such_python"',
    ("yade", "--program", "no_such_yade"): 'no program "no_such_yade"',
    (
        "yade",
        "--program",
        sys.executable,
    ): f"YADE is not installed as {sys.executable}; on Debian: apt-get install",
    ("liggghts", "--program", "no_such_liggghts"): 'no program "no_such_liggghts"',
    ("pymunk", "--program", "echo"): "pymunk is not installed in ",
    ("pymunk", "--timeout", "0"): "--timeout: got 0, expected a number of seconds > 0",
}


@pytest.mark.parametrize("words", BAD_COMMANDS)
def test_a_wrong_command_is_refused_in_one_line(words: tuple[str, ...], cli: Run) -> None:
    done = cli("conform", *words)
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1), done.stderr
    assert BAD_COMMANDS[words] in done.stderr


@pytest.mark.slow
def test_an_engine_that_is_not_installed_is_named_with_how_to_get_it(cli: Run) -> None:
    done = cli("conform", "--list", "--json")
    listed = {row["engine"]: row["version"] for row in json.loads(done.stdout)["engines"]}
    assert listed.keys() == ENGINES.keys()
    for name in (name for name, version in listed.items() if version is None):
        done = cli("conform", name)
        assert done.returncode == 2
        assert ENGINES[name].program.install in done.stderr


@pytest.mark.slow
def test_a_board_is_stored_and_compared(cli: Run, tmp_path: Path) -> None:
    def release(version: str, engine: Engine) -> Engine:
        return lambda c: engine(c) | {"engine": "mine", "version": version}

    def other(c: Values) -> Values:
        return rigid(c) | {"engine": "other"}

    older, newer = tmp_path / "older.h5", tmp_path / "newer.h5"
    board = impact.conform(adapter=[release("1.0", rigid), other], output=older)
    impact.conform(adapter=[release("1.1", half_of_mu), other], output=newer)
    loaded = impact.load(older)
    assert loaded.identical(board.dataset)
    assert dict(loaded.sizes) == {"engine": 2, "check": len(board.engines[0]["checks"])}
    assert impact.describe(loaded).as_dict() == board.as_dict()
    with pytest.raises(UsageError, match=r"impact\.report writes the page of a board"):
        impact.explore(loaded)
    assert impact.compare(older, older).equal
    verdict = impact.compare(newer, older)
    assert not verdict.equal
    assert {variable.name for variable in verdict.differing} == {"check_status", "delivered"}
    assert {variable.at["engine"] for variable in verdict.differing} == {"mine"}
    assert "the version of mine is 1.1, in BASELINE 1.0" in verdict.notes
    drawn = cli("compare", str(newer), str(older), "--plot", str(tmp_path / "differences.png"))
    assert (drawn.returncode, drawn.stderr) == (1, f"{tmp_path / 'differences.png'}: where the differences lie\n")
    assert set(verdict.worst_along) == {"engine", "check"}
    # the other engine states no version
    assert "version               1.0        –\n" in str(board)
    assert "engine_version  1.0, – " in cli("info", str(older)).stdout
    for command in ("plot", "recommend", "rerun"):
        assert "this is a board" in cli(command, str(older)).stderr
    blessed = cli("bless", str(newer), str(older), "--reason", "new")
    expected = "expected the result of a sweep; impact compare takes two boards as they are"
    assert (blessed.returncode, blessed.stderr) == (2, f"{newer}: this is a board, {expected}\n")
    with pytest.raises(UsageError, match="exists"):
        impact.conform(adapter=rigid, output=older)


def test_boards_of_other_engines_or_collisions_are_compared_where_they_meet(tmp_path: Path) -> None:
    few = impact.conform(adapter=rigid, only=["stick-10-equal", "spin-both"])
    all_checks = impact.conform(adapter=rigid)
    verdict = impact.compare(few.dataset, all_checks.dataset)
    assert not verdict.equal
    assert "in BASELINE only" in str(verdict)
    assert impact.compare(few.dataset, all_checks.dataset, subset=True).equal
    renamed = impact.conform(adapter=lambda c: rigid(c) | {"engine": "b"}, only=["spin-both"])
    assert "no engine in common" in str(impact.compare(renamed.dataset, few.dataset))


def test_boards_of_two_sets_are_not_equal() -> None:
    board = impact.conform(adapter=rigid, only="stick-10-equal").dataset
    verdict = impact.compare(board, board.assign_attrs(suite="conformance-2"))
    assert not verdict.equal
    assert [fault.text for fault in verdict.faults] == ["suite is conformance-1, in BASELINE conformance-2"]


def test_a_damaged_board_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "board.h5"
    impact.conform(adapter=rigid, only="spin-both", output=path)
    content = bytearray(path.read_bytes())
    content[-100] ^= 1
    path.write_bytes(content)
    with pytest.raises(ResultError, match="damaged"):
        impact.load(path)


def test_a_page_has_the_checks_of_each_engine_and_escapes_their_names(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    impact.conform(adapter=lambda c: half_of_mu(c) | {"engine": "<b>mine"}, output=page)
    text = page.read_text(encoding="utf-8")
    assert "&lt;b&gt;mine" in text
    assert "<b>" not in text
    assert "friction failed at slide-mu10-45-equal" in text
    assert "<script" not in text
    board = impact.conform(adapter=half_of_mu)
    assert "friction_bound" in impact.report(board.dataset)
    assert "friction_bound" in board._repr_html_()
    assert len(board.to_dataframe()) == len(board.as_dict()["checks"])


@pytest.mark.peers
@pytest.mark.parametrize("name", ENGINES)
def test_an_engine_answers_every_collision(name: str) -> None:
    """What it delivers is on the board; here, it answers, finite and the same again."""
    venv = os.environ.get("PEERS_VENV")
    python = str(Path(venv, "bin", "python").absolute()) if venv and ENGINES[name].is_package else None
    try:
        board = impact.conform(name, program=python)
    except UsageError as error:
        pytest.skip(str(error))
    print(board)
    assert not failed(board) & {"finite", "repeat", "separates"}


def test_the_page_has_the_examples_and_names_every_check() -> None:
    page = (ROOT / "docs" / "conform.md").read_text(encoding="utf-8")
    for name in ("rigid.py", "rigid.c"):
        assert (EXAMPLES / name).read_text(encoding="utf-8") in page
    assert f"the same {len(COLLISIONS)} impacts" in page
    named = {*CHECKS, *QUESTION_KEYS, *FACTS}
    assert [name for name in named if f"`{name}`" not in page] == []


def test_the_page_of_the_board_is_that_of_the_stored_board() -> None:
    sys.path.insert(0, str(ROOT / "scripts"))
    import conform_board

    board = impact.load(EXAMPLES / "board.h5")
    assert (EXAMPLES / "board.md").read_text(encoding="utf-8") == conform_board.page(board), "run `make conform`"
    assert {str(name).partition(",")[0] for name in board["engine"].values} == set(ENGINES)
    fresh = impact.conform(adapter=rigid).dataset
    assert fresh["check"].values.tolist() == board["check"].values.tolist()


def test_a_tolerance_between_two_boards_is_a_number() -> None:
    board = impact.load(EXAMPLES / "board.h5")
    with pytest.raises(UsageError, match=r'^tol="abc": expected a number >= 0, such as 1e-5$'):
        impact.compare(board, board, tol="abc")
