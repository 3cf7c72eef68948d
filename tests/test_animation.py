"""An animation shows where both balls are, and how far the force has come, in each frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Circle
from PIL import Image

import impact
from impact.plots import motions
from impact.plots.draw import get_plot_data
from impact.plots.kinds import Choice
from impact.plots.layout import Picture
from impact.plots.motions import FRAMES, animation_data
from impact.plots.style import encoded

from .conftest import Run
from .fork_server import ForkServer


@pytest.fixture(scope="module")
def single() -> impact.Impact:
    return impact.run(model="gharib-hurmuzlu-2012", at={"e": 0.5, "m2": 8.0})


def test_a_frame_shows_the_surfaces_and_the_force_of_its_time(single: impact.Impact) -> None:
    history = single.history
    assert history is not None
    frames = animation_data([history], Choice()).panels[0].curves[0].x
    figure = impact.plot(single, kind="animation")
    assert isinstance(figure, Picture)
    assert figure.show_frame is not None
    scene, force, loop = figure.axes
    balls = [patch for patch in scene.patches if isinstance(patch, Circle)]
    # equal densities
    assert balls[1].radius == pytest.approx(2.0 * balls[0].radius)
    contact_time = float(history["t"][-1])
    for index in (0, FRAMES // 2, FRAMES - 1):
        figure.show_frame(index)
        time = frames[index]
        surfaces = balls[0].center[0] + balls[0].radius, balls[1].center[0] - balls[1].radius
        if time < 0.0:
            # ball 1 comes with 1 m/s to the place of contact, ball 2 rests
            assert surfaces == pytest.approx((time, 0.0), abs=1e-12)
        elif time < contact_time:
            # surfaces overlap by the indentation
            assert surfaces[0] - surfaces[1] == pytest.approx(np.interp(time, history["t"], history["delta"]))
        else:
            # they separate with the relative velocity of the rebound
            gap = surfaces[1] - surfaces[0] + float(history["delta"][-1])
            assert gap == pytest.approx(single.values["e_out"] * (time - contact_time), rel=1e-6)
        drawn = history["t"].values[history["t"].values <= max(time, 0.0)]
        np.testing.assert_array_equal(force.lines[0].get_xdata(), drawn)
        assert len(loop.lines[0].get_xdata()) == len(drawn)


def test_a_wall_is_nearly_plane() -> None:
    figure = impact.plot(impact.run(at={"e": 0.5, "m2": float("inf")}), kind="animation")
    ball, wall = (patch for patch in figure.axes[0].patches if isinstance(patch, Circle))
    assert wall.radius >= 50.0 * ball.radius


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["gif", "png"])
def test_the_command_writes_an_animation_of_a_history(
    single: impact.Impact, forked: ForkServer, tmp_path: Path, suffix: str
) -> None:
    assert single.history is not None
    impact.save(single.history, tmp_path / "h.h5")
    words = ("--kind", "animation", "-o", f"a.{suffix}", "--width", "40mm")
    # few frames, which show as much
    few = "from impact.plots import motions; motions.FRAMES = 4"
    done = forked("plot", "h.h5", *words, cwd=tmp_path, code=few)
    assert done.returncode == 0, done.stderr
    with Image.open(tmp_path / f"a.{suffix}") as picture:
        assert getattr(picture, "n_frames", 1) == (4 if suffix == "gif" else 1)


def test_a_style_with_a_layout_engine_leaves_frames_the_layout_of_the_picture(
    single: impact.Impact, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(motions, "FRAMES", 3)
    style = tmp_path / "tight.mplstyle"
    style.write_text("figure.autolayout: True\n", encoding="utf-8")
    gifs = [encoded(impact.plot(single, kind="animation", style=s), "gif", s) for s in (None, style)]
    assert gifs[0] == gifs[1]


@pytest.mark.slow
def test_only_an_animation_is_a_gif(single: impact.Impact, cli: Run, tmp_path: Path) -> None:
    assert single.history is not None
    impact.save(single.history, tmp_path / "h.h5")
    done = cli("plot", "h.h5", "--kind", "loop", "-o", "a.gif", cwd=tmp_path)
    message = "a.gif: a .gif is an animation, expected --kind animation\n"
    assert (done.returncode, done.stderr) == (2, message)
    assert not (tmp_path / "a.gif").exists()


def test_the_table_has_the_displacement_of_each_ball(single: impact.Impact) -> None:
    assert single.history is not None
    columns = list(animation_data([single.history], Choice()).wide_table())
    assert columns[1:3] == [f"x gharib-hurmuzlu-2012 ball{ball} [m]" for ball in (1, 2)]


def test_a_ball_may_have_a_mass_by_its_density() -> None:
    ball = {"R1": 0.01, "R2": 0.02, "K": 1e6, "v1": 1.0, "n": 1.5, "material": "soft"}
    soft = {"soft": {"E": 1e9, "nu": 0.3, "rho": 1000.0}}
    shot = impact.run({"models": "hertz", "sweep": ball, "materials": soft})
    assert shot.history is not None
    balls = [patch for patch in impact.plot(shot, kind="animation").axes[0].patches if isinstance(patch, Circle)]
    assert balls[1].radius == pytest.approx(2.0 * balls[0].radius)
    tau = get_plot_data(shot.history, "impulse", Choice()).panels[0].curves[0].x
    mass = 1000.0 * 4.0 / 3.0 * np.pi * 0.01**3 * 8.0 / 9.0
    assert tau[-1] == pytest.approx(2.0 * mass)


@pytest.mark.parametrize(("mass", "ratio"), [(0.125, 0.5), (1.0, 1.0), (8.0, 2.0)])
def test_both_balls_are_within_the_picture_in_every_frame(mass: float, ratio: float) -> None:
    figure = impact.plot(impact.run(at={"e": 0.5, "m2": mass}), kind="animation")
    assert isinstance(figure, Picture)
    assert figure.show_frame is not None
    scene = figure.axes[0]
    balls = [patch for patch in scene.patches if isinstance(patch, Circle)]
    assert balls[1].radius == pytest.approx(ratio * balls[0].radius)
    for index in range(figure.frame_count):
        figure.show_frame(index)
        for ball in balls:
            (x, _), radius = ball.center, ball.radius
            assert scene.get_xlim()[0] < x - radius < x + radius < scene.get_xlim()[1]
            assert scene.get_ylim()[1] > radius
