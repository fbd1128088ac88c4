// The map: the track by mode, and where the rover is, believes to be, is believed to be.

const MAP_HEIGHT = 540;

function drawMap() {
  const root = byId("map"), view = here(), chart = view.chart;
  const width = Math.max(240, root.parentElement.clientWidth);
  const cell = Math.min(width / chart.width, MAP_HEIGHT / chart.height);
  const size = { x: chart.width * cell, y: chart.height * cell };
  const at = (xCm, yCm) => [px(xCm / 100 / view.cell_m * cell), px(size.y - yCm / 100 / view.cell_m * cell)];
  const middle = (token) => {
    const place = chart.cells.get(token);
    return place && [px((place.east + 0.5) * cell), px(size.y - (place.north + 0.5) * cell)];
  };
  root.setAttribute("viewBox", `0 0 ${px(size.x)} ${px(size.y)}`);
  const on = { view, chart, cell, at, middle, size };
  root.replaceChildren(yardOf(view.rows, cell), ...tracksOn(on), ...bumpsOn(on), ...goalsOn(on), ...roversOn(on));
}

// The track as runs of one mode: before the cursor, and faintly after it.
function tracksOn({ view, at }) {
  const paths = new Map();
  const add = (mode, later, from, to) => {
    const key = `t t-${mode}${later ? " t-later" : ""}`;
    const path = paths.get(key) ?? { d: "", last: "" };
    const [a, b] = [from.join(" "), to.join(" ")];
    path.d += path.last === a ? `L${b}` : `M${a}L${b}`;
    path.last = b;
    paths.set(key, path);
  };
  if (asGround()) {
    const heard = view.heard;
    if (!heard) return [];
    let before = -1;
    for (const row of heard.bySo) {
      if (heard.known[row] > state.t) continue;
      if (before >= 0 && heard.so[row] - heard.so[before] <= heard.gap) {
        add(heard.words[heard.mode[row]], false, at(heard.x[before], heard.y[before]), at(heard.x[row], heard.y[row]));
      }
      before = row;
    }
  } else if (view.track) {
    const { t, x, y } = view.track;
    const modes = view.lanes.find((lane) => lane.name === "Mode")?.spans ?? [];
    let number = 0;
    for (let row = 1; row < t.length; row++) {
      while (number + 1 < modes.length && modes[number + 1].start <= t[row]) number++;
      add(modes[number]?.kind ?? "guided", t[row] > state.t, at(x[row - 1], y[row - 1]), at(x[row], y[row]));
    }
  }
  const order = [...paths].sort(([a], [b]) => b.includes("later") - a.includes("later"));
  return order.map(([cls, { d }]) => svg("path", { d, class: cls }));
}

function bumpsOn({ view, at }) {
  const past = view.bumps.filter(([t]) => t <= state.t);
  return past.length ? [svg("path", { class: "bump",
    d: past.map(([, x, y]) => { const [a, b] = at(x, y); return `M${a - 4} ${b - 4}l8 8m0 -8l-8 8`; }).join("") })] : [];
}

function goalTokens() {
  if (asGround()) {
    const heard = here().heard, row = lastHeard();
    return row < 0 ? [] : heard.words[heard.goals[row]].split(", ");
  }
  return here().lanes.filter((lane) => lane.name.startsWith("Goal ")
    && lane.spans.some((span) => span.start <= state.t && (span.end ?? Infinity) > state.t))
    .map((lane) => lane.name.slice(5));
}

function goalsOn({ middle, cell }) {
  return goalTokens().map(middle).filter(Boolean).map(([x, y]) => {
    const r = px(Math.max(6, cell * 0.42));
    return svg("path", { d: `M${x} ${y - r}l${r} ${r}l${-r} ${r}l${-r} ${-r}z`, class: "goal" });
  });
}

function along(track, t) {
  const row = countUpTo(track.t, t) - 1;
  if (row < 0) return null;
  if (row + 1 >= track.t.length) return [track.x[row], track.y[row]];
  const share = (t - track.t[row]) / (track.t[row + 1] - track.t[row]);
  return [track.x, track.y].map((column) => column[row] + share * (column[row + 1] - column[row]));
}

function predictedNow() {
  const all = data.ground.predicted;
  let row = countUpTo(all.map((one) => one.t), state.t) - 1;
  return row < 0 ? null : all[row];
}

function standingProposal() {
  return here().proposals.findLast((one) => (one.known ?? one.made) <= state.t
    && !(one.ended !== undefined && (one.known_end ?? one.ended) <= state.t)) ?? null;
}

function roversOn({ view, at, middle, cell }) {
  const nodes = [], r = Math.max(5, cell * 0.2);
  const predicted = predictedNow();
  for (const [token, chance] of predicted?.places ?? []) {
    const place = chance >= 0.05 && middle(token);
    if (!place) continue;
    const side = px(cell * 0.86);
    nodes.push(svg("g", {}, svg("title", {}, `predicted at the ground: ${token}, ${Math.round(chance * 100)} %`),
      svg("rect", { x: px(place[0] - side / 2), y: px(place[1] - side / 2), width: side, height: side, rx: 4,
        class: "guess", "fill-opacity": 0.05 + 0.25 * chance })));
  }
  const path = standingProposal()?.path.map(middle).filter(Boolean) ?? [];
  if (path.length > 1) nodes.push(svg("path", { d: `M${path.map((point) => point.join(" ")).join("L")}`, class: "path" }));
  const heard = data.ground.heard, row = lastHeard();
  if (row >= 0) {
    const [x, y] = at(heard.x[row], heard.y[row]);
    nodes.push(svg("path", { d: `M${px(x - r)} ${px(y - r)}h${px(2 * r)}v${px(2 * r)}h${px(-2 * r)}z`, class: "heard-at" }));
  }
  if (asGround() || !view.track) return nodes;
  const truth = along(view.track, state.t), believed = view.believed && along(view.believed, state.t);
  if (truth) {
    const [x, y] = at(...truth);
    nodes.push(svg("circle", { cx: x, cy: y, r: px(r * 0.85), class: "rover" }));
  }
  if (believed) {
    const [x, y] = at(...believed);
    nodes.push(svg("circle", { cx: x, cy: y, r: px(r * 1.5), class: "believed" }));
  }
  return nodes;
}

function mapLegend() {
  const line = (cls, words) => html("span", {}, sample(`t ${cls}`), words);
  const shape = (node, words) => html("span", {}, svg("svg", { viewBox: "0 0 30 10" }, node), words);
  const entries = [line("t-guided", "guided"), line("t-shared", "shared"), line("t-autonomous", "autonomous")];
  if (!asGround()) {
    entries.push(shape(svg("circle", { cx: 15, cy: 5, r: 5, class: "rover" }), "rover"),
      shape(svg("circle", { cx: 15, cy: 5, r: 6, class: "believed" }), "its own estimate"));
  }
  entries.push(
    shape(svg("path", { d: "M10 0h10v10h-10z", class: "heard-at" }), "as last heard at the ground"),
    shape(svg("path", { d: "M8 -1h14v12h-14z", class: "guess" }), "now, as predicted at the ground"),
    shape(svg("path", { d: "M15 -2l7 7l-7 7l-7 -7z", class: "goal" }), "goal"),
    shape(svg("path", { d: "M2 5H28", class: "path" }), "proposed path"));
  if (here().rows.some((row) => row.includes("~"))) {
    entries.push(shape(svg("path", { d: "M5 -1h20v12h-20z", class: "shade" }), "terrain shadow"));
  }
  if (here().bumps.length) entries.push(shape(svg("path", { d: "M11 1l8 8m0 -8l-8 8", class: "bump" }), "bump"));
  byId("map-legend").replaceChildren(...entries);
}
