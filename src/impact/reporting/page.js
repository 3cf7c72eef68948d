"use strict";
const page = JSON.parse(document.getElementById("data").textContent);
const byId = id => document.getElementById(id);

// ---- values: what was integrated, and the formulas of the outputs

const TYPES = {f8: Float64Array, i4: Int32Array, i1: Int8Array};
const decode = ({type, base64}) => {
  const bytes = Uint8Array.from(atob(base64), letter => letter.charCodeAt(0));
  return new TYPES[type](bytes.buffer);
};
// an array has values along some axes, in C order
const open = array => array && {...array, data: decode(array)};
const inputs = Object.fromEntries(Object.entries(page.inputs).map(([name, array]) => [name, open(array)]));
const laws = page.laws.map(law => ({
  ...law,
  cells: law.cells && decode(law.cells),
  columns: Object.fromEntries(Object.entries(law.columns).map(([name, array]) => [name, open(array)])),
}));

// of a law as in pictures, on a dark page lighter; of the impulse-momentum solution as the text
const colorOf = law => law ? `color-mix(in srgb, ${law.color}, var(--ink) var(--lift))` : "var(--ink)";

function place(axes, at) {
  return axes.reduce((cell, axis) => cell * page.axes[axis].values.length + at[axis], 0);
}
const read = (array, at) => array.data[place(array.axes, at)];

function column(law, name, at) {
  const array = law.columns[name], cell = place(array.axes, at);
  return array.data[law.cells && array.is_shared ? law.cells[cell] : cell];
}

// an output of a law, or of the impulse-momentum solution for no law, at positions along all axes
function value(output, law, at) {
  if (law?.is_pair) return column(law, output, at);
  const [v1, v2, m1, m2, e] = ["v1", "v2", "m1", "m2", "e"].map(name => read(inputs[name], at));
  const v0 = v1 - v2, m = 1 / (1 / m1 + 1 / m2), asked = e >= 0 && e <= 1 ? e : NaN, isMissed = !(v0 > 0);
  const after = restitution => {
    const impulse = isMissed ? 0 : (1 + restitution) * m * v0;
    return {v1_post: v1 - impulse / m1, v2_post: v2 + impulse / m2};
  };
  if (!law) return output === "e_out" ? asked : after(asked)[output] ?? NaN;
  const K = law.is_table && column(law, "K", at);
  const length = law.is_table && (m * v0 / K * v0) ** (1 / (column(law, "n", at) + 1));
  // balls that miss each other have an answer, two walls have none
  const isFailed = law.is_table && !isMissed && (
    column(law, "status", at) >= page.first_failure || (law.asks_for_e && Number.isNaN(asked))
      || [m, K, length, m * v0 * v0, length / v0].some(size => !(size > 0 && size < Infinity))
  );
  const e_out = isFailed || isMissed ? NaN : column(law, "e_out", at);
  if (output === "e_out") return e_out;
  if (output === "e_error") return e_out - asked;
  if (output.startsWith("v")) {
    const delivered = isMissed ? after(0) : after(e_out), name = output.replace("error", "post");
    return output === name ? delivered[name] : delivered[name] - after(asked)[name];
  }
  if (isFailed) return NaN;
  if (isMissed) return 0;
  if (!law.is_table) return column(law, output, at);
  const unit = output === "peak_force" ? m * v0 * v0 / length : length / v0;
  return column(law, output, at) * unit;
}

// ---- numbers as text

const PREFIXES = {"-9": "n", "-6": "µ", "-3": "m", 0: "", 3: "k", 6: "M", 9: "G"};
const digits = number => Number.isFinite(number) ? String(+number.toPrecision(6)).replace("-", "−") : "–";

// a factor, and the unit of an output with its prefix, for values up to `largest`
function scale(unit, largest) {
  if (unit === "1") return [1, ""];
  if (unit === "°" || unit === "rad/s") return [1, unit];
  const power = largest > 0 ? 3 * Math.floor(Math.log10(largest) / 3 + 1e-4) : 0;
  const limited = Math.min(9, Math.max(-9, power));
  return [10 ** -limited, PREFIXES[limited] + unit];
}
const withUnit = (number, unit) => `${digits(number)}${unit === "°" ? "" : " "}${unit}`.trim();
const heading = (name, unit) => unit ? `${name} [${unit}]` : name;

// ---- state: the output, the axis to draw over, the positions along all axes, the laws, and the cursor

const state = {output: page.outputs[0].name, x: page.first_axis, at: page.axes.map(() => 0), cursor: null};
const outputNow = () => page.outputs.find(output => output.name === state.output);
// the friction of a pair has other outputs than the normal motion of a model
const isChoice = law => law.is_pair === outputNow().of_friction;
const shown = () => laws.filter(law => isChoice(law) && byId(`law-${law.key}`).checked);
const along = position => state.at.map((at, axis) => axis === state.x ? position : at);

// the positions of the axis in the order of its values, which are drawn
function order() {
  const {values} = page.axes[state.x];
  const drawn = values.map((_, position) => position).filter(position => Number.isFinite(values[position]));
  return drawn.sort((one, other) => values[one] - values[other]);
}

function curves() {
  const positions = order(), x = positions.map(position => page.axes[state.x].values[position]);
  const curve = law => ({law, x, y: positions.map(position => value(state.output, law, along(position)))});
  const reference = curve(null);
  const own = shown().map(curve);
  return reference.y.some(Number.isFinite) ? [reference, ...own] : own;
}

// ---- the picture

// of a curve
const MAX_MARKERS = 60;
// values are equal that differ by less, relative to the largest
const FLAT = 1e-6;
const SVG = "http://www.w3.org/2000/svg";
function add(parent, name, attributes, text = "") {
  const element = parent.appendChild(document.createElementNS(SVG, name));
  for (const [key, content] of Object.entries(attributes)) element.setAttribute(key, content);
  element.textContent = text;
  return element;
}

function ticks(low, high, isLog, count) {
  if (isLog && Math.log10(high / low) >= 1) {
    const powers = [];
    for (let power = Math.ceil(Math.log10(low) - 1e-9); 10 ** power <= high * (1 + 1e-9); power += 1) {
      powers.push(10 ** power);
    }
    const every = Math.ceil(powers.length / count);
    return powers.filter((_, index) => index % every === 0);
  }
  const rough = (high - low) / count, size = 10 ** Math.floor(Math.log10(rough));
  const step = size * [1, 2, 2.5, 5, 10].find(factor => size * factor >= rough);
  const first = Math.ceil(low / step - 1e-9), last = Math.floor(high / step + 1e-9);
  return Array.from({length: Math.max(0, last - first + 1)}, (_, index) => (first + index) * step);
}

function marker(shape, x, y) {
  const r = 3.5;
  const paths = {
    o: `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`,
    s: `M${x - r} ${y - r}h7v7h-7z`,
    D: `M${x} ${y - r}l${r} ${r}l${-r} ${r}l${-r} ${-r}z`,
    "^": `M${x} ${y - r}l${r} 7h-7z`,
    v: `M${x} ${y + r}l${r} -7h-7z`,
    "<": `M${x - r} ${y}l7 ${-r}v7z`,
    ">": `M${x + r} ${y}l-7 ${-r}v7z`,
  };
  return paths[shape] ?? `M${x - r} ${y - r}l7 7m0 -7l-7 7`;
}

let picture = null;
function draw() {
  const svg = byId("picture"), width = Math.max(300, svg.parentNode.clientWidth);
  const height = Math.round(Math.min(560, Math.max(280, 0.62 * width)));
  const axis = page.axes[state.x], {is_log: isLog, has_words: hasWords} = axis;
  const output = outputNow(), drawn = curves();
  const right = width - 14, top = 12, bottom = height - 46, warp = isLog ? Math.log : number => number;
  const x = drawn[0]?.x ?? [], numbers = drawn.flatMap(curve => curve.y).filter(Number.isFinite);
  svg.replaceChildren();
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.setAttribute("height", height);
  picture = null;
  for (const law of laws) byId(`law-${law.key}`).parentNode.hidden = !isChoice(law);
  if (!numbers.length) {
    add(svg, "text", {x: width / 2, y: height / 2, "text-anchor": "middle"}, "no values to draw here");
    return list();
  }
  let [low, high] = [Math.min(...numbers), Math.max(...numbers)];
  const size = Math.max(Math.abs(low), Math.abs(high));
  // errors of the solver do not make a curve of a constant
  const room = 0.05 * (high - low > FLAT * size ? high - low : size || 1);
  [low, high] = [low - room, high + room];
  const [factor, unit] = scale(output.unit, Math.max(Math.abs(low), Math.abs(high)));
  const levels = ticks(low * factor, high * factor, false, height / 60);
  // the numbers stand between the name of the output and the frame
  const left = 34 + 7.5 * Math.max(4, ...levels.map(number => digits(number).length));
  const [xSize, xUnit] = axis.scaled, xFactor = 1 / xSize;
  const first = x[0], last = x[x.length - 1];
  const share = number => (warp(number) - warp(first)) / (warp(last) - warp(first));
  const toX = number => last > first ? left + share(number) * (right - left) : (left + right) / 2;
  const toY = number => bottom - (number - low) / (high - low) * (bottom - top);

  for (const number of levels) {
    const y = toY(number / factor);
    add(svg, "line", {x1: left, x2: right, y1: y, y2: y, class: "grid"});
    add(svg, "text", {x: left - 8, y: y + 4, "text-anchor": "end"}, digits(number));
  }
  const every = Math.ceil(x.length * 90 / width), words = x.filter((_, index) => index % every === 0);
  for (const number of hasWords ? words : ticks(first * xFactor, last * xFactor, isLog, width / 90)) {
    const at = toX(hasWords ? number : number / xFactor), text = hasWords ? axis.names[number] : digits(number);
    add(svg, "line", {x1: at, x2: at, y1: top, y2: bottom, class: "grid"});
    add(svg, "text", {x: at, y: bottom + 18, "text-anchor": "middle"}, text);
  }
  add(svg, "path", {d: `M${left} ${top}V${bottom}H${right}`, class: "frame"});
  add(svg, "text", {x: (left + right) / 2, y: height - 8, "text-anchor": "middle"}, heading(axis.label, xUnit));
  const beside = `translate(14 ${(top + bottom) / 2}) rotate(-90)`;
  add(svg, "text", {transform: beside, "text-anchor": "middle"}, heading(output.label, unit));

  for (const {law, y} of drawn) {
    const points = x.map((number, index) => [toX(number), toY(y[index])]).map(
      ([px, py], index) => Number.isFinite(y[index]) ? [px.toFixed(2), py.toFixed(2)] : null
    );
    const d = points.map((at, index) => at ? `${points[index - 1] ? "L" : "M"}${at.join(" ")}` : "").join("");
    const stroke = colorOf(law), line = {d, stroke, class: "curve"};
    add(svg, "path", {...line, "stroke-dasharray": law ? law.dashes : "none", "stroke-width": law ? 1.6 : 2.6});
    // values of the grid have markers, lines between them are interpolation
    if (law && points.length <= MAX_MARKERS) {
      const marks = points.filter(at => at).map(([px, py]) => marker(law.marker, +px, +py)).join("");
      add(svg, "path", {d: marks, stroke, class: "markers"});
    }
  }
  const cursor = add(svg, "line", {class: "cursor"});
  picture = {drawn, x, warp, left, right, top, bottom, toX, unit, factor, xFactor, xUnit, cursor};
  list();
}

// ---- the values at the cursor: of the grid, or interpolated as the lines are drawn

function atCursor({x, warp}) {
  const target = state.cursor ?? x[Math.floor((x.length - 1) / 2)];
  const found = x.findIndex(number => number >= target), last = x.length - 1;
  const after = found < 0 ? last : Math.min(last, Math.max(1, found));
  const before = Math.max(0, after - 1);
  const share = after > before ? (warp(target) - warp(x[before])) / (warp(x[after]) - warp(x[before])) : 0;
  return {target, before, after, share, isOnGrid: share <= 0 || share >= 1};
}

function list() {
  const body = byId("values"), note = byId("note");
  body.replaceChildren();
  note.textContent = "";
  if (!picture) return;
  const {drawn, cursor, top, bottom, toX, factor, unit, xFactor, xUnit} = picture, axis = page.axes[state.x];
  const {target, before, after, share, isOnGrid} = atCursor(picture);
  const ends = {x1: toX(target), x2: toX(target), y1: top, y2: bottom};
  for (const [name, content] of Object.entries(ends)) cursor.setAttribute(name, content);
  const text = axis.has_words ? axis.texts[target] : withUnit(target * xFactor, xUnit);
  const remark = isOnGrid ? "" : ": between values of the grid, interpolated";
  note.textContent = `at ${axis.label} = ${text}${remark}`;
  for (const {law, y} of drawn) {
    const number = isOnGrid ? y[share >= 1 ? after : before] : y[before] + share * (y[after] - y[before]);
    const row = body.insertRow(), name = row.insertCell();
    name.textContent = law ? law.label : page.reference;
    name.style.borderLeft = `4px solid ${colorOf(law)}`;
    row.insertCell().textContent = `${isOnGrid ? "" : "≈ "}${withUnit(number * factor, unit)}`;
  }
}

function point(event) {
  if (!picture) return;
  const {x, left, right, toX, warp} = picture, {has_words: hasWords, is_log: isLog} = page.axes[state.x];
  const px = event.clientX - byId("picture").getBoundingClientRect().left;
  const share = Math.min(1, Math.max(0, (px - left) / (right - left)));
  const distance = number => Math.abs(toX(number) - px);
  const nearest = x.reduce((best, number) => distance(number) < distance(best) ? number : best);
  const between = warp(x[0]) + share * (warp(x[x.length - 1]) - warp(x[0]));
  const isNear = hasWords || distance(nearest) <= 5;
  state.cursor = isNear ? nearest : isLog ? Math.exp(between) : between;
  list();
}

function step(event) {
  const moves = {ArrowLeft: -1, ArrowRight: 1};
  if (!picture || !(event.key in moves)) return;
  event.preventDefault();
  const {x} = picture, {before, after, share} = atCursor(picture), now = share >= 1 ? after : before;
  state.cursor = x[Math.min(x.length - 1, Math.max(0, now + moves[event.key]))];
  list();
}

// ---- the numbers of the picture as CSV

function csv() {
  const axis = page.axes[state.x], output = outputNow(), drawn = curves();
  const quote = text => `"${String(text).replaceAll('"', '""')}"`;
  const named = (name, unit) => quote(heading(name, unit === "1" ? "" : unit));
  const others = page.axes.map((other, number) => `# ${other.label} = ${other.texts[state.at[number]]}`);
  others.splice(state.x, 1);
  const names = drawn.map(({law}) => named(`${output.name} of ${law ? law.key : page.reference}`, output.unit));
  const cell = number => Number.isNaN(number) ? "" : String(number);
  const rows = order().map((position, index) => [
    axis.has_words ? quote(axis.texts[position]) : axis.values[position],
    ...drawn.map(({y}) => cell(y[index])),
  ].join(","));
  const head = [named(axis.name, axis.unit), ...names].join(",");
  return [`# ${page.title}`, ...others, head, ...rows, ""].join("\n");
}

// ---- the controls

function make(parent, name, properties = {}) {
  return parent.appendChild(Object.assign(document.createElement(name), properties));
}

function setUp() {
  for (const {label, name} of page.outputs) make(byId("variable"), "option", {textContent: label, value: name});
  page.axes.forEach((axis, number) => make(byId("x"), "option", {textContent: axis.label, value: number}));
  byId("x").value = state.x;
  for (const law of laws) {
    const label = make(byId("laws"), "label");
    const box = make(label, "input", {type: "checkbox", id: `law-${law.key}`, checked: true});
    label.append(` ${law.label}`);
    label.style.borderLeft = `4px solid ${colorOf(law)}`;
    box.addEventListener("change", draw);
  }
  page.axes.forEach((axis, number) => {
    const row = make(byId("sliders"), "label"), name = make(row, "span"), max = axis.values.length - 1;
    const slider = make(row, "input", {type: "range", id: `axis-${number}`, min: 0, max, step: 1, value: 0});
    const update = () => { name.textContent = `${axis.label} = ${axis.texts[state.at[number]]}`; };
    slider.addEventListener("input", () => {
      state.at[number] = +slider.value;
      update();
      draw();
    });
    update();
  });
  const hideDrawn = () => page.axes.forEach((_, number) => {
    byId(`axis-${number}`).parentNode.hidden = number === state.x;
  });
  byId("variable").addEventListener("change", event => {
    state.output = event.target.value;
    draw();
  });
  byId("x").addEventListener("change", event => {
    Object.assign(state, {x: +event.target.value, cursor: null});
    hideDrawn();
    draw();
  });
  byId("csv").addEventListener("click", () => {
    const href = URL.createObjectURL(new Blob([csv()], {type: "text/csv"}));
    make(document.body, "a", {href, download: `${state.output}.csv`, hidden: true}).click();
  });
  const svg = byId("picture");
  svg.addEventListener("pointermove", point);
  svg.addEventListener("pointerdown", point);
  svg.addEventListener("keydown", step);
  hideDrawn();
  new ResizeObserver(draw).observe(svg.parentNode);
}

setUp();
draw();
