"""Configuration of the documentation site, which `make site` builds; it also writes the reference pages."""

from __future__ import annotations

import ast
import inspect
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import FunctionType
from typing import Any

import impact
from impact.cli.main import COMMANDS, load_command
from impact.config.tables import (
    FIXED_STEP_DEFAULTS,
    OBLIQUE_DEFAULTS,
    SWEEP_DEFAULTS,
    Data,
    Design,
    MaterialTable,
    Sweep,
    quantities_of,
)
from impact.contact.frictions import frictions
from impact.contact.models import catalogue

# the pages of laws are text of the same functions as the catalogue
sys.path.insert(0, str(Path(__file__).parents[1] / "scripts"))
from law_pages import law_pages

project = "impact"
author = "impact contributors"
version = release = impact.__version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton"]
# `make test-faults` runs the notebooks; the site shows their stored outputs
nb_execution_mode = "off"
html_theme = "furo"
html_title = "impact"
html_show_copyright = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = [("catalogue.js", {"defer": "defer"})]
# headings are targets of links, as on GitHub
myst_heading_anchors = 4
# it is a part of the page of the package
exclude_patterns = ["types.md"]
napoleon_google_docstring = False
default_role = "literal"
autodoc_typehints = "none"
autodoc_member_order = "bysource"
copybutton_prompt_text = "$ "
# a command over several lines
copybutton_line_continuation_character = "\\"
# outputs of commands are no shell language
suppress_warnings = ["misc.highlighting_failure"]

# types and limits of JSON Schema in words
WORDS = {
    "boolean": "`true` or `false`",
    "integer": "a whole number",
    "null": "nothing",
    "number": "a number",
    "string": "a text",
}
LIMITS = {"minimum": ">=", "exclusiveMinimum": ">", "maximum": "<=", "exclusiveMaximum": "<"}
REFERENCE = Path(__file__).parent / "reference"
# pages of the repository that are part of the site, and links to them and from them
COPIED = {"CHANGELOG.md": "changelog.md", "SECURITY.md": "security.md"}
MOVED = {f"](../{old})": f"](reference/{new})" for old, new in COPIED.items()}
MOVED_COPIES = {f"]({old})": f"]({new})" for old, new in COPIED.items()} | {"](docs/": "](../"}


def command_page() -> str:
    """Every command with its arguments and options."""
    lines = ["# Commands", "", "Every command has `--help`, and `impact help COMMAND` prints the same."]
    for name, (_, summary, example) in COMMANDS.items():
        command = load_command(name)
        lines += ["", f"## impact {name}", "", summary, "", "```sh", f"impact {name} {example}", "```", ""]
        rows = [row for parameter in command.params for row in _parameter_rows(parameter)]
        lines += ["| argument or option | meaning |", "|---|---|", *rows] if rows else []
    return "\n".join(lines) + "\n"


def _parameter_rows(parameter: Any) -> Iterator[str]:
    if parameter.name == "help" or getattr(parameter, "hidden", False):
        return
    is_argument = not parameter.opts[0].startswith("-")
    words = parameter.name.upper() if is_argument else ", ".join(parameter.opts)
    metavar = getattr(parameter, "metavar", None)
    if metavar and not is_argument:
        words += f" {metavar}"
    text = (getattr(parameter, "help", None) or "").replace("\\[", "[").replace("|", "\\|")
    yield f"| `{words}` | {text} |"


def config_page() -> str:
    """The keys of a config."""
    lines = [
        "# Config keys",
        "",
        '`impact schema` prints the JSON Schema. Numbers are in SI, or strings with a unit such as `"5 km/h"`.',
        "`models` and `frictions` list contact force models and friction laws; parameters of a law are in",
        "`[model.KEY]` and `[friction.KEY]` ([the models](../models.md), [the friction laws](../frictions.md)).",
        "Any number of these, of `[sweep]` and of `[materials.NAME]` may be a list or a range (an axis),",
        "a column of a CSV file, `{ fit = [least, most] }` ([calibrate](../calibrate.md)) or a distribution",
        "([uncertain inputs](../uncertainty.md)).",
    ]
    tables = {"sweep": Sweep, "materials.NAME": MaterialTable, "design": Design, "data": Data}
    schemas = impact.schema()["$defs"]
    for name, table in {**tables, "solver": None, "output": None}.items():
        lines += ["", f"## [{name}]", "", "| key | meaning | values |", "|---|---|---|"]
        quantities = quantities_of(table) if table else {}
        fields = schemas[table.__name__ if table else name.title()]["properties"]
        defaults = {**SWEEP_DEFAULTS, **FIXED_STEP_DEFAULTS, **OBLIQUE_DEFAULTS} if table is Sweep else {}
        for key, field in fields.items():
            quantity = quantities.get(key)
            meaning = quantity.description if quantity else field["description"]
            values = quantity.expected if quantity else _values(field, schemas)
            # the schema is that of any text
            if name == "sweep" and key.startswith("material"):
                values = "a `NAME` of `[materials.NAME]` or of `impact materials`, or a list of them"
            default = defaults.get(key, field.get("default"))
            if default not in (None, []):
                values += f"; default `{json.dumps(default)}`"
            lines.append(f"| `{key}` | {meaning} | {values} |")
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    return f"{value:,}" if isinstance(value, int) else f"{value:g}"


def _values(field: dict[str, Any], schemas: dict[str, Any]) -> str:
    """What a key accepts, in words, from its JSON schema."""
    if "enum" in field:
        return ", ".join(f"`{json.dumps(value)}`" for value in field["enum"])
    if "$ref" in field:
        field = schemas[field["$ref"].rpartition("/")[2]]
    choices = field.get("oneOf", field.get("anyOf")) if "type" not in field else None
    if choices:
        return " or ".join(dict.fromkeys(_values(choice, schemas) for choice in choices))
    if field["type"] == "array":
        items = _values(field["items"], schemas)
        return "a list of " + re.sub(r"\ba (text|number|whole number|list)\b", r"\1s", items)
    if field["type"] == "object":
        keys = ", ".join(field.get("properties", ()))
        return f"`{{ {keys} }}`" if keys else "a table"
    limits = [f"{sign} {_number(field[limit])}" for limit, sign in LIMITS.items() if limit in field]
    return " ".join([WORDS[field["type"]], " and ".join(limits)]).strip()


# pages to read for the functions of a purpose of the docstring of the package
GUIDES = {
    "Run sweeps and single impacts": "start sweeps cluster",
    "See results and choose a law": "gallery sweeps",
    "Find inputs": "solve calibrate uncertainty",
    "Simulation codes and their time steps": "codes export timestep conform",
    "Store results and guard them": "storage ci",
    "Laws and what they need": "models frictions extending",
    "Classes of laws": "extending",
    "Classes of results": "schema",
    "Errors and warnings": "troubleshooting",
}


def api_page() -> str:
    """The functions and classes of the package, by the purposes of its docstring."""
    lines = ["# Python", "", "```python", "import impact", "```", "", "`help(impact)` lists the names by purpose."]
    sections: list[str] = []
    for purpose, names in re.findall(r"^([A-Z][\w ]+): ((?:\w+,?\s)+)$", impact.__doc__ or "", re.MULTILINE):
        guides = ", ".join(f"[](../{page}.md)" for page in GUIDES[purpose].split())
        lines += ["", f"**{purpose}** ({guides})", "", "| name | what it does |", "|---|---|"]
        sections += ["", f"## {purpose}", "", f"Guides: {guides}."]
        for name in names.replace(",", " ").split():
            thing = getattr(impact, name)
            summary = (inspect.getdoc(thing) or "").splitlines()[0].replace("|", "\\|")
            lines.append(f"| [`{name}`](#{name.lower()}) | {summary} |")
            kind = "autoclass" if isinstance(thing, type) else "autofunction"
            sections += ["", f"### {name}", "", "```{eval-rst}", f".. {kind}:: impact.{name}"]
            # what a user calls and reads; parameters are in the docstring
            if purpose == "Classes of results":
                sections.append("   :members: " + ", ".join(_members(thing)))
            sections.append("```")
            command = name.replace("_", "-")
            if command in COMMANDS:
                sections += ["", f"At the command line: [impact {command}](commands.md#impact-{command})."]
    # the page of types, one level lower
    types = (Path(__file__).parent / "types.md").read_text(encoding="utf-8")
    return "\n".join([*lines, *sections]) + "\n\n" + re.sub("^#", "##", types, flags=re.MULTILINE)


def _members(result: type) -> list[str]:
    """The public methods and properties of a class."""
    kinds = (FunctionType, property)
    members = {name: getattr(result, name) for name in dir(result) if not name.startswith("_")}
    # `sections` is what `str` and notebooks show
    return [name for name, value in members.items() if isinstance(value, kinds) and name != "sections"]


def module_page() -> str:
    """Every module, with the first line of its docstring."""
    package = Path(impact.__file__).parent
    lines = ["# Modules", "", "The first line of the docstring of each module, by package."]
    for folder in sorted({path.parent for path in package.rglob("*.py")}):
        lines += ["", f"## {folder.relative_to(package.parent).as_posix().replace('/', '.')}", ""]
        for module in sorted(folder.glob("*.py")):
            summary = ast.get_docstring(ast.parse(module.read_text(encoding="utf-8")))
            lines += [f"- `{module.stem}`: {summary.splitlines()[0]}"] if summary else []
    return "\n".join(lines) + "\n"


def write_reference(app: Any) -> None:
    """Write the pages that are generated from the code."""
    for name, text in law_pages().items():
        path = REFERENCE / f"{name}.md"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    figure6 = impact.sweep(REFERENCE.parents[1] / "configs" / "figure6.toml")
    impact.page(figure6, output=REFERENCE / "figure6.html", overwrite=True)
    pages = {"commands": command_page, "config": config_page, "python": api_page, "modules": module_page}
    for name, page in pages.items():
        (REFERENCE / f"{name}.md").write_text(page(), encoding="utf-8")
    for name, copy in COPIED.items():
        text = (REFERENCE.parents[1] / name).read_text(encoding="utf-8")
        for old, new in MOVED_COPIES.items():
            text = text.replace(old, new)
        (REFERENCE / copy).write_text(text, encoding="utf-8")


def move_links(app: Any, document: str, source: list[str]) -> None:
    """Replace links to pages that have another path in the site."""
    for old, new in MOVED.items():
        source[0] = source[0].replace(old, new)
    # a law is a row of the catalogue on GitHub, and has a page in the site
    laws = {"models": catalogue(), "frictions": frictions()}.get(document, {})
    for key in laws:
        source[0] = source[0].replace(f"](#{key})", f"](reference/{document}/{key}.md)")
    name_titles(app, "", document, source)
    # files of the repository are not part of the site
    source[0] = re.sub(r"\[([^\]]*)\]\(\.\./((?:configs|tests|src)/[^)]*)\)", r"`\2`", source[0])


def name_titles(app: Any, path: Any, document: str, source: list[str]) -> None:
    """Replace links whose text is the path of a page, as GitHub shows it, by the title of the page."""
    source[0] = re.sub(r"\[(?:docs/)?[\w/]+\.md\]\((?!http)", "[](", source[0])


def escape_docstring(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Escape what reStructuredText would read as markup: docstrings are plain text with `code`."""
    in_example = False
    for number, line in enumerate(lines):
        in_example = line.lstrip().startswith(">>>") or (in_example and bool(line.strip()))
        if not in_example:
            lines[number] = re.sub(r"([|*])", r"\\\1", line)
    start = _start_of_examples(lines)
    examples = ["", "Examples", "--------", "", *lines[start:]] if start else []
    lines[:] = [part for line in lines[: start or None] for part in _entry_lines(line)] + examples


def _entry_lines(line: str) -> list[str]:
    """An entry of a section, `name : meaning`, as the name and the meaning below it, which is not its type."""
    match = re.fullmatch(r"(\w[^:]*?) : (.+)", line)
    return [match[1], f"    {match[2]}"] if match else [line]


def _start_of_examples(lines: list[str]) -> int:
    """Where the text after the last section of a docstring begins; 0 if there is none."""
    underlines = [number for number, line in enumerate(lines) if re.fullmatch("-{4,}", line.strip())]
    for number in range(underlines[-1] + 2 if underlines else len(lines), len(lines)):
        if not lines[number - 1].strip() and lines[number].strip() and not lines[number].startswith(" "):
            return number
    return 0


def setup(app: Any) -> None:
    app.connect("builder-inited", write_reference)
    # before napoleon reads the sections
    app.connect("autodoc-process-docstring", escape_docstring, priority=400)
    app.connect("source-read", move_links)
    app.connect("include-read", name_titles)
