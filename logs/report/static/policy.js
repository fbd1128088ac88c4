// The policy map: the height of a place is its policy value.

function drawColumns(root, moment) {
  const chart = here().chart;
  const places = new Map();
  for (const [sign, value, action, depth] of moment.places) {
    const place = chart.cells.get(sign);
    if (place) places.set(`${place.east},${place.north}`, { value, goal: !action,
      words: action ? `${sign}: P_v ${formatted(value)}, ${action}, valence depth ${depth}` : `${sign}: the goal` });
  }
  const greatest = Math.max(...moment.places.map(([, value]) => value), 1e-9);
  const tell = (east, north) => `${chart.tokens.get(`${east},${north}`)}: no known path to the goal`;
  const { nodes, box } = columnsOf(here().rows, places, greatest, tell);
  root.setAttribute("viewBox", box.map(px).join(" "));
  root.replaceChildren(...nodes);
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
