// The policy map as the seed's columns: the height of a place is its policy value.

const TURN = -20 * Math.PI / 180, TILT = 48 * Math.PI / 180, TALLEST = 5;
const RAMP = [[255, 210, 122], [247, 154, 92], [226, 96, 108], [168, 69, 138], [101, 57, 143], [43, 42, 102]];

function ramp(share, shade) {
  const position = Math.min(1, Math.max(0, share)) * (RAMP.length - 1);
  const low = Math.min(Math.floor(position), RAMP.length - 2);
  const mix = RAMP[low].map((a, i) => a + (RAMP[low + 1][i] - a) * (position - low));
  return `rgb(${mix.map((part) => Math.round(part * (1 - shade))).join(",")})`;
}

function drawColumns(root, moment) {
  const chart = here().chart, unit = 30;
  const values = new Map(moment.places.map(([sign, value, action, depth]) => [sign, { value, action, depth }]));
  const greatest = Math.max(...moment.places.map(([, value]) => value), 1e-9);
  const project = (east, north, up) => {
    const x = east - chart.width / 2, y = north - chart.height / 2;
    const across = x * Math.cos(TURN) - y * Math.sin(TURN), away = x * Math.sin(TURN) + y * Math.cos(TURN);
    return [across * unit, -(away * Math.sin(TILT) + up * Math.cos(TILT)) * unit];
  };
  const blocks = [];
  here().rows.forEach((row, line) => [...row].forEach((character, east) => {
    const north = chart.height - 1 - line;
    const token = chart.tokens.get(`${east},${north}`);
    const value = token && values.get(token);
    const block = { east, north, up: 0, fill: () => "var(--panel)", words: token ?? "wall" };
    if (character === "#" || character === "o") {
      Object.assign(block, { up: character === "#" ? 0.25 : 0.45, fill: () => "var(--grid)", words: character === "#" ? "wall" : "rock" });
    } else if (value) {
      block.up = TALLEST * value.value / greatest;
      block.fill = value.action ? (shade) => ramp(value.value / greatest, shade) : () => "var(--page)";
      block.words = value.action
        ? `${token}: P_v ${formatted(value.value)}, ${value.action}, valence depth ${value.depth}` : `${token}: the goal`;
    } else block.words = `${token}: no known path to the goal`;
    block.goal = value && !value.action;
    block.name = token && chart.cells.get(token).named ? token.slice(3) : "";
    blocks.push(block);
  }));
  const away = ({ east, north }) => east * Math.sin(TURN) + north * Math.cos(TURN);
  blocks.sort((a, b) => away(b) - away(a));
  const points = [], nodes = [], names = [];
  for (const block of blocks) {
    const corner = (e, n, up) => { const p = project(block.east + e, block.north + n, up); points.push(p); return p; };
    const group = svg("g", {}, svg("title", {}, block.words));
    const face = (corners, shade) => group.append(svg("path", {
      d: `M${corners.map((p) => p.map(px).join(" ")).join("L")}z`, fill: block.fill(shade),
      stroke: "var(--line)", "stroke-width": 0.7 }));
    const [a, b] = [0.04, 0.96];
    const sides = [[[a, a], [b, a], 0.14], [[b, a], [b, b], 0.3], [[b, b], [a, b], 0.14], [[a, b], [a, a], 0.3]];
    for (const [from, to, shade] of sides) {
      if (block.up && project(...from, 0)[0] < project(...to, 0)[0]) {
        face([corner(...from, 0), corner(...to, 0), corner(...to, block.up), corner(...from, block.up)], shade);
      }
    }
    face([corner(a, a, block.up), corner(b, a, block.up), corner(b, b, block.up), corner(a, b, block.up)], 0);
    nodes.push(group);
    if (block.name || block.goal) {
      const [x, y] = project(block.east + 0.5, block.north + 0.5, block.up);
      names.push(text(x, y - (block.goal ? 12 : -5), block.name || "goal", { "text-anchor": "middle", class: "big halo" }));
      if (block.goal) names.push(svg("path", { d: `M${px(x)} ${px(y)}v-9`, class: "mark" }));
    }
  }
  const xs = points.map(([x]) => x), ys = points.map(([, y]) => y);
  const [left, top] = [Math.min(...xs), Math.min(...ys) - 24];
  root.setAttribute("viewBox", [left - 4, top, Math.max(...xs) - left + 8, Math.max(...ys) - top + 4].map(px).join(" "));
  root.replaceChildren(...nodes, ...names);
}

const DEPTHS = 60;  // rows, and places in a row

// A row for each valence depth, from the goal outwards.
function depthTable(moment) {
  const depths = [];
  for (const [sign, value, action, depth] of moment.places) (depths[depth] ??= []).push({ sign, value, action });
  const row = (places, depth) => {
    const words = places.slice(0, DEPTHS).map(({ sign, value, action }) =>
      html("span", { class: "place-value" }, `${sign} `, html("b", {}, action || "goal"), ` ${formatted(value)}`));
    if (places.length > DEPTHS) words.push(html("span", {}, `and ${places.length - DEPTHS} more`));
    return html("tr", {}, html("td", { class: "number" }, String(depth)), html("td", {}, ...words));
  };
  const rows = depths.map((places, depth) => places && row(places, depth)).filter(Boolean);
  const more = rows.length > DEPTHS ? [html("tr", {}, html("td"), html("td", {}, `and ${rows.length - DEPTHS} greater depths`))] : [];
  return html("table", { class: "depths" }, html("tr", {}, html("th", { class: "number" }, "depth"),
    html("th", {}, "Sign, best action there, policy value")), ...rows.slice(0, DEPTHS), ...more);
}

function policySection() {
  const moments = data.so?.maps ?? [];
  if (!moments.length) return;
  const select = byId("policy-moment");
  moments.forEach((moment, number) => select.append(html("option", { value: number },
    `${seconds(moment.t)}: ${moment.goal} becomes the top-goal`)));
  select.addEventListener("change", () => { setTime(moments[select.value].t); });
}

let policyDrawn = null;
function drawPolicy() {
  const moments = data.so?.maps ?? [];
  if (!moments.length || asGround()) return;
  const number = Math.max(0, countUpTo(moments.map(({ t }) => t), state.t) - 1);
  if (policyDrawn === number) return;
  policyDrawn = number;
  byId("policy-moment").value = number;
  const moment = moments[number];
  drawColumns(byId("columns"), moment);
  byId("depths").replaceChildren(depthTable(moment));
  byId("policy-title").textContent = `${moment.places.length} Signs can reach ${moment.goal}, which became the top-goal at ${seconds(moment.t)}.`;
}
