// Curves: a panel for each, all on the time axis of the timeline.

const PANEL = 104;

function formatted(value, unit) {
  if (value === null || value === undefined) return "–";
  if (unit === "%") return `${(value * 100).toFixed(value && value < 0.1 ? 1 : 0)} %`;
  const size = Math.abs(value);
  const digits = Number.isInteger(value) || size >= 100 ? 0 : size >= 1 ? 2 : 3;
  return `${value.toLocaleString("en", { maximumFractionDigits: digits })}${unit ? ` ${unit}` : ""}`;
}

// The rows of a curve that are known, in order of time.
function rowsOf(series) {
  const rows = [];
  series.t.forEach((t, row) => {
    if (!asGround() || (series.known ? series.known[row] : t) <= state.t) rows.push(row);
  });
  return rows;
}

function valueAt(series, t) {
  let low = countUpTo(series.t, t) - 1;
  if (asGround() && series.known) while (low >= 0 && series.known[low] > state.t) low--;
  return low < 0 ? null : series.v[low];
}

// By what is known, so that a scale does not tell what is to come.
function topOf(panel) {
  let top = 0, asked = 0;
  for (const series of panel.series) {
    const values = series.hi ?? series.v;
    for (const value of asGround() ? rowsOf(series).map((row) => values[row]) : values) {
      if (series.asked) asked = Math.max(asked, value ?? 0); else top = Math.max(top, value ?? 0);
    }
  }
  // What was asked is in the picture, unless it would flatten all else.
  if (asked && (asked <= 6 * top || !top)) top = Math.max(top, asked);
  top = Math.max(top * 1.06, panel.top ?? 0);
  return { top: top || 1, beyond: asked > top };
}

// As wide for all, so that the cursor stands at one place in all.
function panelGutter() {
  const tick = (panel) => Math.max(...valueTicks(topOf(panel).top, 3).map((value) => widthOf(formatted(value, panel.unit))));
  return Math.max(...here().panels.map(tick)) + 8;
}

function drawPanel(panel, width) {
  const unit = panel.unit;
  const { top, beyond } = topOf(panel);
  const ticks = valueTicks(top, 3);
  const gutter = panelGutter();
  const x = scale(gutter, width - 8);
  const y = (value) => 6 + (PANEL - 6) * (1 - Math.min(value, top * 1.02) / top);
  const nodes = [axis(x, 6, PANEL - 6)];
  for (const tick of ticks) {
    nodes.push(svg("path", { d: `M${px(x.left)} ${px(y(tick))}H${px(x.right)}`, class: "gridline" }));
    nodes.push(text(x.left - 6, y(tick) + 5, formatted(tick, unit), { "text-anchor": "end", class: "soft" }));
  }
  const clip = clipTo(x, PANEL);
  const body = svg("g", { "clip-path": `url(#${clip.id})` });
  panel.series.forEach((series, number) => {
    if (series.asked && beyond) return;
    body.append(...drawSeries(series, number, x, y));
  });
  return { x, height: PANEL + 22, nodes: [clip.node, ...nodes, body] };
}

const lookOf = (series, number) => (series.asked ? "c c-asked" : `c c${number}`);

function drawSeries(series, number, x, y) {
  const rows = rowsOf(series);
  let first = rows.findIndex((row) => series.t[row] >= state.from);
  first = first < 0 ? Math.max(0, rows.length - 1) : Math.max(0, first - 1);
  let line = "", areas = "", area = "", back = "", pen = false, last = null;
  const dots = series.look === "dots", isSteps = series.look === "steps";
  let previousX = null;
  for (let index = first; index < rows.length; index++) {
    const row = rows[index], t = series.t[row], value = series.v[row];
    if (value === null) {
      pen = false;
      if (area) areas += `${area}${back}z`;
      area = back = "";
      continue;
    }
    const at = x(t), high = y(value);
    if (dots && !series.lo) {
      if (t <= state.to) line += `M${px(at - 2.5)} ${px(high)}a2.5 2.5 0 1 0 5 0a2.5 2.5 0 1 0 -5 0`;
    } else if (!pen) line += `M${px(at)} ${px(high)}`;
    else line += isSteps ? `H${px(at)}V${px(high)}` : `L${px(at)} ${px(high)}`;
    if (isSteps && series.v[rows[index + 1]] === null) {
      line += `H${px(x(series.t[rows[index + 1]]))}`;
    }
    if (series.lo) {
      area += `${area ? "L" : "M"}${px(at)} ${px(y(series.hi[row]))}`;
      back = `L${px(at)} ${px(y(series.lo[row]))}${back}`;
    }
    pen = true;
    previousX = at;
    last = value;
    if (t > state.to) break;
  }
  const end = x(asGround() ? Math.min(state.t, state.until) : state.until);
  if (isSteps && pen && previousX !== null && end > previousX) line += `H${px(end)}`;
  const nodes = [];
  if (area) areas += `${area}${back}z`;
  if (areas) nodes.push(svg("path", { d: areas, class: "c-area" }));
  const cls = dots && !series.lo ? "c-dot" : lookOf(series, number);
  nodes.push(svg("path", { d: line, class: cls }));
  return last === null ? [] : nodes;
}

function curvePlots(host) {
  host.replaceChildren();
  return here().panels.map((panel) => {
    const values = panel.series.map(() => html("b"));
    const { beyond } = topOf(panel);
    const legend = html("div", { class: "legend" }, ...panel.series.map((series, number) => {
      const dots = series.look === "dots" && !series.lo;
      const line = dots
        ? svg("svg", { viewBox: "0 0 30 10" }, svg("path", { d: "M12 5a3 3 0 1 0 6 0a3 3 0 1 0 -6 0", class: "c-dot" }))
        : sample(lookOf(series, number));
      const off = series.asked && beyond ? " (off the scale)" : "";
      return html("span", {}, line, `${series.name}${off} `, values[number]);
    }));
    const box = html("div", { "data-label": panel.title });
    host.append(html("div", {}, html("h3", {}, panel.title), legend, box));
    const plot = new Plot(box, (width) => drawPanel(panel, width));
    plot.tellValues = () => panel.series.forEach((series, number) => {
      values[number].textContent = formatted(valueAt(series, state.t), panel.unit);
    });
    return plot;
  });
}
