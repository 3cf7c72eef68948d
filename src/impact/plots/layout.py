"""The figure of a picture: title, panels and legend, laid out by matplotlib at any size."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text

from ..errors import UsageError
from ..formatting import argument
from .style import DRAWING, SOFT, encoded, tint

# space between the parts of a picture, and at its edges
GAP_INCHES = 0.05
# height up to which a picture grows for its legend
MAX_HEIGHT_INCHES = 9.5
# fraction of the height of a single row of panels that the label of its vertical axis may take
LABEL_SHARE_OF_ROW = 0.7
# a longer word is broken
MAX_WORD_INCHES = 2.4
MAX_LAYOUT_PASSES = 4
# fraction of the length of an axis that its label may take: the layout may make the axis a little shorter
LABEL_SHARE_OF_AXIS = 0.93
# largest fraction of a picture of fixed height that its legend takes
LEGEND_SHARE = 0.5
# a legend with more entries, or of a larger part of the height of a picture, has smaller letters
MANY_ENTRIES, LEGEND_PART = 16, 0.2
# space between columns, in letters
COLUMN_SPACING = 1.2
# conditions of more lines have smaller letters, and the last are left out
MAX_LINES = 3
# labels of axes and names of panels of more lines have smaller letters
MAX_LABEL_LINES = 2
# least height of a panel in a picture whose height the user chose
MIN_PANEL_MM = 12.0


class Picture(Figure):
    """A figure with a title, conditions below it and a legend at the bottom, which fit it at any size."""

    def __init__(self, width: float, title: str = "", conditions: str = "") -> None:
        super().__init__((width, width), layout=Layout())
        FigureCanvasAgg(self)
        styles: tuple[dict[str, Any], ...] = (
            {"fontweight": "bold", "fontsize": "large"},
            {"fontsize": "small", "color": tint(SOFT)},
        )
        texts = zip((title, conditions), styles, strict=True)
        self.header = [self.text(0.0, 1.0, text, va="top", **style) for text, style in texts if text]
        self.title = self.header[0] if title else None
        self.entries: list[tuple[Artist, str]] = []
        self.has_small_legend = False
        # whether names follow each other in rows, without columns
        self.has_legend_rows = False
        # part of the height; each entry that is left out counts as another height
        self.legend_share = 0.0
        self.shared: tuple[Text, ...] = ()
        # of panels whose names are too long for them, also in smaller letters
        self.short_names: dict[Text, Sequence[str]] = {}
        # the axes without colour bars, and the height [in] that suits them
        self.panels: list[Axes] = []
        self.body = 0.0
        self.has_chosen_height = False
        # whether the layout found room for the axes
        self.is_laid_out = True
        # of an animation, which can show each frame
        self.show_frame: Callable[[int], None] | None = None
        self.frame_count = 0
        # a later change of the size makes the legend again, in the present style
        self.style = dict(matplotlib.rcParams.find_all(r"^(legend|font|text\.color)"))
        # texts that were broken into lines: original text and present text
        self.fitted: dict[Text, tuple[str, str]] = {}

    def _repr_png_(self) -> tuple[bytes, dict[str, str]]:
        # a notebook shows it even if no backend of matplotlib is selected; `alt` is the text for screen readers
        panels = [f"{axes.get_ylabel()} over {axes.get_xlabel()}" for axes in self.axes if axes.get_ylabel()]
        words = [*(text.get_text() for text in self.header), *panels]
        # a screen reader would read the signs of mathtext
        plain = re.sub(r"\\(?:mathrm|dot)\b|[$\\{}]", "", "; ".join(words))
        return encoded(self, "png"), {"alt": " ".join(plain.split())}

    def set_size_inches(self, w: Any, h: Any = None, forward: bool = True) -> None:
        before = self.get_figwidth()
        super().set_size_inches(w, h, forward)
        # matplotlib also calls this method when the resolution changes
        if self.get_figwidth() != before and self.entries:
            with DRAWING:
                self.place_legend(self.entries)

    def draw(self, renderer: RendererBase) -> None:
        with DRAWING:
            super().draw(renderer)

    def savefig(self, *args: Any, **kwargs: Any) -> None:
        with DRAWING:
            super().savefig(*args, **kwargs)

    def add_legend(self, body: float, height: float | None, entries: Sequence[tuple[Artist, str]]) -> None:
        """Add the legend, and choose the height [in] for panels of the height `body` if the user chose none."""
        self.body, self.has_chosen_height = body, height is not None
        width, shown = self.get_figwidth(), list(entries)
        legend, above = self.place_legend(shown), GAP_INCHES + self.place_header()
        if legend > LEGEND_PART * (height or above + body + legend):
            self.has_small_legend = True
            legend = self.place_legend(shown)
        if height is None and self.has_legend_rows:
            height = max(above + body + legend, min(legend / LEGEND_PART, MAX_HEIGHT_INCHES))
        elif height is None:
            most = min(legend, MAX_HEIGHT_INCHES / 2.0)
            height = above + max(body, most) + most
        while legend > LEGEND_SHARE * height and len(shown) > 1:
            # show the entries that fit, and the number of the others
            shown = shown[: max(1, int(0.9 * len(shown)))]
            more = (Line2D([], [], linestyle=""), f"and {len(entries) - len(shown)} more")
            legend = self.place_legend([*shown, more])
        self.set_size_inches(width, height)
        self.legend_share = self.legend_height() / self.get_figheight() + len(entries) - len(shown)

    def check_panels(self) -> None:
        """Raise a UsageError where the height that the user chose leaves no room for the panels."""
        if not self.has_chosen_height:
            return
        chosen, rows = self.get_figheight(), self._row_heights()
        if self.is_laid_out and min(rows) >= MIN_PANEL_MM:
            return
        # everything but the panels has the same height in any picture of this width
        enough = GAP_INCHES + self.place_header() + self.body + self.legend_height()
        self.set_size_inches(self.get_figwidth(), enough)
        rows = self._row_heights()
        # 1 mm for each row, because numbers at the ends of axes need more or less room
        least = math.ceil(enough * 25.4 + sum(rows) * (MIN_PANEL_MM / min(rows) - 1.0)) + len(rows)
        raise UsageError(
            f"{argument('height')}: got {chosen * 25.4:.0f}mm, expected at least {least}mm at this width, so that "
            f"panels have {MIN_PANEL_MM:.0f} mm"
        )

    def _row_heights(self) -> list[float]:
        """Measure the rows of panels [mm], after the layout."""
        self.draw_without_rendering()
        boxes = [axes.get_position(original=True) for axes in self.panels]
        rows = {round(box.y0, 2): box.height for box in boxes}
        return [height * self.get_figheight() * 25.4 for height in rows.values()]

    def place_legend(self, entries: Sequence[tuple[Artist, str]]) -> float:
        """Put the legend at the bottom in as many columns as fit; returns its height [in]."""
        for legend in list(self.legends):
            legend.remove()
        self.entries = list(entries)
        self.has_small_legend |= len(entries) > MANY_ENTRIES
        if entries:
            with matplotlib.rc_context(self.style):
                if self.has_legend_rows:
                    self._place_rows()
                else:
                    self._place_columns()
        return self.legend_height()

    def _place_columns(self) -> None:
        max_width = self.bbox.width - GAP_INCHES * self.dpi
        columns = max(1, int(max_width / self._legend(1).get_window_extent(self.renderer).width))
        # columns of short names are narrower than a single column: another one may fit
        for number in range(min(columns + 1, len(self.entries)), 0, -1):
            self.legends[0].remove()
            if self._legend(number).get_window_extent(self.renderer).width <= max_width:
                break

    def _place_rows(self) -> None:
        """Put the entries one after the other, in as many rows as it takes; each row is a legend."""
        legend = self._legend(1)
        size = float(legend.get_texts()[0].get_fontsize()) * self.dpi / 72.0
        between = (legend.handlelength + legend.handletextpad + COLUMN_SPACING) * size
        widths = [text.get_window_extent(self.renderer).width + between for text in legend.get_texts()]
        legend.remove()
        rows: list[list[tuple[Artist, str]]] = []
        left = 0.0
        for entry, width in zip(self.entries, widths, strict=True):
            if width > left:
                rows.append([])
                left = self.bbox.width
            rows[-1].append(entry)
            left -= width
        bottom = GAP_INCHES
        for row in reversed(rows):
            # in inches from the lower left corner, at any resolution
            place = {"bbox_to_anchor": (GAP_INCHES, bottom), "bbox_transform": self.dpi_scale_trans}
            legend = self._legend(len(row), row, loc="lower left", borderaxespad=0.0, borderpad=0.1, **place)
            bottom += float(legend.get_window_extent(self.renderer).height / self.dpi)
        # from the first row to the last
        self.legends.reverse()

    @property
    def renderer(self) -> RendererBase:
        """Get the renderer that measures text at the present resolution; a text would keep the one used before."""
        return self._get_renderer()  # type: ignore[attr-defined, no-any-return]

    def legend_height(self) -> float:
        """Measure the legend [in]."""
        if not self.legends:
            return 0.0
        boxes = [legend.get_window_extent(self.renderer) for legend in self.legends]
        height = max(box.y1 for box in boxes) if self.has_legend_rows else boxes[0].height
        return float(height / self.dpi) + GAP_INCHES

    def _legend(self, columns: int, entries: Sequence[tuple[Artist, str]] = (), **place: Any) -> Legend:
        """Add a legend in a number of columns; names wider than the figure are broken into lines."""
        style: dict[str, Any] = {"fontsize": "x-small", "labelspacing": 0.3} if self.has_small_legend else {}
        handles, names = zip(*(entries or self.entries), strict=True)
        style |= {"loc": "lower center", "ncols": columns, "borderaxespad": 0.3, "columnspacing": COLUMN_SPACING}
        legend = self.legend(handles, names, **(style | place))
        max_width = self.bbox.width - 4.5 * float(legend.get_texts()[0].get_fontsize()) * self.dpi / 72.0
        for text in legend.get_texts():
            self.fit(text, max_width)
        return legend

    def share_labels(self, x_label: str, y_label: str) -> None:
        """Write labels shared by the axes of all panels."""
        size = matplotlib.rcParams["axes.labelsize"]
        below = self.text(0.5, 0.0, x_label, ha="center", va="bottom", fontsize=size)
        left = self.text(0.0, 0.5, y_label, ha="left", va="center", rotation="vertical", fontsize=size)
        self.shared = below, left

    def place_header(self) -> float:
        """Put the title and the conditions at the top, in lines that fit; returns their height [in]."""
        gap = GAP_INCHES * self.dpi
        down = self.bbox.height - gap
        for text in self.header:
            self.fit(text, self.bbox.width - 2.0 * gap)
            if text.get_text().count("\n") >= MAX_LINES:
                text.set_fontsize("x-small")
                self.fit(text, self.bbox.width - 2.0 * gap)
                if text is not self.title:
                    self._shorten(text, self.bbox.width - 2.0 * gap)
            text.set_position((gap / self.bbox.width, down / self.bbox.height))
            down -= text.get_window_extent(self.renderer).height + gap
        return float((self.bbox.height - down) / self.dpi)

    def _shorten(self, conditions: Text, max_width: float) -> None:
        """Leave out the conditions beyond MAX_LINES lines, and say how many they are."""
        whole, _ = self.fitted[conditions]
        parts = whole.split(", ")
        # those of the first lines, of which the end may have no room for the number of the others
        shown = "\n".join(conditions.get_text().split("\n")[:MAX_LINES])
        for count in range(min(len(parts) - 1, len(re.findall(r",\s|,$", shown))), 0, -1):
            if conditions.get_text().count("\n") < MAX_LINES:
                break
            conditions.set_text(f"{', '.join(parts[:count])}, and {len(parts) - count} more")
            self.fit(conditions, max_width)
        self.fitted[conditions] = whole, conditions.get_text()

    def place_around(self) -> tuple[float, float, float]:
        """Place the texts around the panels; returns the fractions that they take left, below, above."""
        width, height = self.bbox.width, self.bbox.height
        gap, above = GAP_INCHES * self.dpi, self.place_header() * self.dpi
        left, below = 0.0, self.legend_height() * self.dpi
        if self.shared:
            x_label, y_label = self.shared
            self.fit(x_label, width)
            x_label.set_y((below + gap) / height)
            below += gap + x_label.get_window_extent(self.renderer).height
            self.fit(y_label, height - above - below)
            y_label.set_position((gap / width, 0.5 * (height - above + below) / height))
            left = gap + y_label.get_window_extent(self.renderer).width
        return left / width, below / height, above / height

    def fit_labels(self, height: float, *, may_shrink: bool) -> list[str]:
        """Break the labels and names of all panels to the length of their axis; returns their texts.

        All labels of horizontal axes, all of vertical axes and all names of panels have one size each, a smaller
        one if any of them does not fit. Before the first layout the lengths are not those of the picture: nothing
        may shrink.
        """
        # in a single row of panels of a height [px] a vertical label may be longer than its axis
        rows = len({round(axes.get_position().y0, 1) for axes in self.axes})
        least = LABEL_SHARE_OF_ROW * height if rows == 1 else 0.0
        # the longest line of each text [px]
        panel_names, x_labels, y_labels = dict[Text, float](), dict[Text, float](), dict[Text, float]()
        for axes in self.axes:
            box = axes.get_window_extent()
            titles = [text for text in axes.get_children() if isinstance(text, Text) and text not in axes.texts]
            panel_names |= dict.fromkeys(titles, box.width)
            x_labels[axes.xaxis.label] = LABEL_SHARE_OF_AXIS * box.width
            y_labels[axes.yaxis.label] = max(LABEL_SHARE_OF_AXIS * box.height, least)
        for lengths in (panel_names, x_labels, y_labels):
            fits = [self.fit(text, length) for text, length in lengths.items()]
            if may_shrink and not all(fits):
                for text, length in lengths.items():
                    text.set_fontsize("x-small")
                    for name in (text.get_text(), *self.short_names.get(text, ())):
                        text.set_text(name)
                        if self.fit(text, length):
                            break
        return [text.get_text() for text in (*panel_names, *x_labels, *y_labels)]

    def fit(self, text: Text, max_width: float) -> bool:
        """Break a text at spaces into lines up to `max_width` [px], and longer words at hyphens or anywhere.

        Returns whether it has at most MAX_LABEL_LINES lines, none of them longer.
        """
        whole, shown = self.fitted.get(text, ("", ""))
        if not shown or text.get_text() != shown:
            whole = text.get_text()

        def length(line: str) -> float:
            text.set_text(line)
            box = text.get_window_extent(renderer)
            return float(box.height if text.get_rotation() == 90.0 else box.width)

        lines, renderer = [""], self.renderer
        if length(whole) <= max_width:
            return True
        for word in whole.split(" "):
            parts, space = [word], " "
            if "$" not in word and length(word) > max_width:
                parts = re.findall(r"[^-]*-|[^-]+", word)
            for part in parts:
                longer = f"{lines[-1]}{space}{part}" if lines[-1] else part
                space = ""
                if length(longer) <= max_width:
                    lines[-1] = longer
                    continue
                letters = len(part)
                if "$" not in part and length(part) > max(max_width, MAX_WORD_INCHES * self.dpi):
                    letters = max(1, int(len(part) * max_width / length(part)))
                lines += [part[start : start + letters] for start in range(0, len(part), letters)]
        lines = list(filter(None, lines))
        fits = len(lines) <= MAX_LABEL_LINES and all(length(line) <= max_width for line in lines)
        text.set_text("\n".join(lines))
        self.fitted[text] = whole, text.get_text()
        return fits


class Layout(ConstrainedLayoutEngine):
    """Constrained layout below the title of a picture, with every label broken to the length of its axis.

    The last digits of the solver's positions differ between processes: positions are rounded, so that a picture
    has the same bytes in every process.
    """

    def execute(self, fig: Figure) -> None:
        assert isinstance(fig, Picture)
        fig.fitted = {text: texts for text, texts in fig.fitted.items() if text.figure is not None}
        left, below, above = fig.place_around()
        # texts that are higher than the picture leave panels no room, which is no error of the solver
        self.set(rect=(left, below, 1.0 - left, max(1.0 - above - below, 0.0)))
        # axes become shorter where a label gets another line, which may change the lines again
        before: list[str] = []
        for _ in range(MAX_LAYOUT_PASSES):
            labels = fig.fit_labels((1.0 - above - below) * fig.bbox.height, may_shrink=bool(before))
            if labels == before:
                break
            with warnings.catch_warnings(record=True) as caught:
                # it warns where labels leave no space for the axes; the picture is drawn anyway
                warnings.simplefilter("always")
                super().execute(fig)
            fig.is_laid_out = not any("constrained_layout not applied" in str(each.message) for each in caught)
            before = labels
        for axes in fig.axes:
            axes.set_position(np.round(axes.get_position(original=True).bounds, 3))
            # setting a position takes the axes out of the layout
            axes.set_in_layout(True)
