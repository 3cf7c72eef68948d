// Filters and sorts the table in an element of the class "catalogue"; without this script it is a plain table.
"use strict";

// columns with at most this many values have a list of them
const MAX_CHOICES = 20;
// characters of a line that is not broken
const SHORT = 16;

// what a column is filtered and sorted by: the line of a <summary> if it has one, else its lines
function linesOf(cell) {
  const lines = (cell.querySelector("summary") ?? cell).innerText.split("\n");
  return lines.map((line) => line.trim()).filter(Boolean);
}

// numbers before texts, and dashes last
function compare(one, other) {
  const numbers = [parseFloat(one), parseFloat(other)];
  if (numbers.some((number) => !Number.isNaN(number))) {
    return (Number.isNaN(numbers[0]) ? Infinity : numbers[0]) - (Number.isNaN(numbers[1]) ? Infinity : numbers[1]);
  }
  return (one === "–") - (other === "–") || (one > other) - (one < other);
}

function isShort(line) {
  return line.length <= SHORT;
}

function element(tag, properties, ...children) {
  const created = Object.assign(document.createElement(tag), properties);
  created.append(...children);
  return created;
}

function enhance(catalogue) {
  const table = catalogue.querySelector("table");
  const body = table.tBodies[0];
  const heads = [...table.tHead.rows[0].cells];
  const names = heads.map((head) => head.innerText.trim());
  const rows = [...body.rows].map((row) => {
    const cells = [...row.cells];
    // names of the cells, which are below each other on a narrow screen
    cells.forEach((cell, index) => (cell.dataset.label = names[index]));
    const lines = cells.map(linesOf);
    cells.slice(1).forEach((cell, index) => {
      cell.classList.toggle("short", !cell.querySelector("details") && lines[index + 1].every(isShort));
    });
    const anchor = row.querySelector("a[id]");
    anchor.after(element("a", { href: `#${anchor.id}`, className: "headerlink", title: "Link to this row" }, "#"));
    return { row, lines, text: row.textContent.toLowerCase() };
  });

  const search = element("input", { type: "search", placeholder: "words, such as lammps hertz" });
  const selects = names.map((name, index) => {
    const values = [...new Set(rows.flatMap(({ lines }) => lines[index]))].sort(compare);
    const areWords = values.every(isShort) && values.some((value) => isNaN(parseFloat(value)));
    if (values.length < 2 || values.length > MAX_CHOICES || !areWords) return null;
    const options = values.map((value) => element("option", {}, value));
    return element("select", {}, element("option", { value: "" }, "all"), ...options);
  });
  const count = element("output", {});
  const order = element("select", {}, ...["as published", ...names].map((name) => element("option", {}, name)));
  const labelled = (name, control) => element("label", {}, `${name} `, control);
  const controls = element("form", { className: "catalogue-controls" }, labelled("search", search));
  selects.forEach((select, index) => select && controls.append(labelled(names[index], select)));
  controls.append(labelled("sorted by", order), element("button", { type: "reset" }, "show all"), count);
  controls.addEventListener("submit", (event) => event.preventDefault());
  catalogue.prepend(controls);

  function filter() {
    const words = search.value.toLowerCase().split(/\s+/);
    let shown = 0;
    for (const { row, lines, text } of rows) {
      const isChosen = selects.every((select, index) => !select?.value || lines[index].includes(select.value));
      row.hidden = !(isChosen && words.every((word) => text.includes(word)));
      shown += !row.hidden;
    }
    count.value = `${shown} of ${rows.length}`;
  }

  // column 0 is the order of the page
  function sort(column, isDescending) {
    const index = column - 1;
    const first = ({ lines }) => lines[index][0] ?? "";
    const sorted = [...rows];
    if (index >= 0) sorted.sort((one, other) => compare(first(one), first(other)));
    if (isDescending) sorted.reverse();
    body.append(...sorted.map(({ row }) => row));
    const direction = isDescending ? "descending" : "ascending";
    heads.forEach((head, place) => head.setAttribute("aria-sort", place === index ? direction : "none"));
    order.selectedIndex = column;
  }

  heads.forEach((head, index) => {
    const button = element("button", { type: "button" }, names[index]);
    button.addEventListener("click", () => sort(index + 1, head.getAttribute("aria-sort") === "ascending"));
    head.replaceChildren(button);
  });
  controls.addEventListener("input", filter);
  order.addEventListener("input", () => sort(order.selectedIndex, false));
  controls.addEventListener("reset", () => setTimeout(() => (sort(0, false), filter())));
  // a link to a row shows it, also if it is filtered out; what is below the table has moved
  function show() {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const row = target?.closest("tr");
    if (row?.hidden) controls.reset();
    setTimeout(() => (row ?? target)?.scrollIntoView({ behavior: "instant" }));
  }
  window.addEventListener("hashchange", show);
  // the pictures above it have their heights then
  window.addEventListener("load", show);
  sort(0, false);
  filter();
}

document.querySelectorAll(".catalogue").forEach(enhance);
