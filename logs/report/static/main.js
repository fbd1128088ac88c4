// One slider moves all views; the switch shows what the ground knew at its time.

const data = JSON.parse(byId("data").textContent);
const sides = Object.keys(data);
sides.forEach((side) => prepare(data[side]));
state.side = sides.includes("so") ? "so" : "ground";
state.until = Math.max(1, ...sides.map((side) => data[side].until));
state.to = state.until;

let timeline, strip, curves = [], due = 0;

function setTime(t) {
  state.t = Math.min(Math.max(0, t), state.until);
  byId("slider").value = Math.round(state.t);
  byId("slider").setAttribute("aria-valuetext", seconds(state.t));
  if (asGround()) redrawSoon(); else cursorSoon();
}

// Drawing waits for the next frame, and is done once however much has changed.
let wants = 0;
function soon(what) {
  wants = Math.max(wants, what);
  due ||= requestAnimationFrame(() => {
    due = 0;
    const all = wants === 2;
    wants = 0;
    if (all) redraw(); else moveCursors();
  });
}
const redrawSoon = () => soon(2);
const cursorSoon = () => soon(1);

function moveCursors() {
  plots.forEach((plot) => { plot.moveCursor(); plot.tellValues?.(); });
  drawOverview();
  drawMap();
  drawNow();
  drawPolicy();
  drawEvents();
}

function redraw() {
  plots.forEach((plot) => plot.redraw());
  if (asGround()) drawCommandTables();
  moveCursors();
}

// The whole run in a bar: outages, alarms, and the part that is on the screen.
function drawOverview() {
  const root = byId("overview"), width = Math.max(240, root.clientWidth);
  const x = (t) => 8 + t / state.until * (width - 16);
  const nodes = [svg("path", { d: `M8 9H${width - 8}`, class: "rail" })];
  for (const lane of lanesHere().filter((one) => LINK_LANES.includes(one.name))) {
    for (const span of lane.spans) {
      nodes.push(svg("rect", { x: px(x(span.start)), y: 4, width: px(Math.max(1, x(span.end) - x(span.start))), height: 10,
        fill: `url(#p-${span.kind === "planned" ? "planned" : "outage"})` }));
    }
  }
  const bad = eventsHere().filter((event) => ["alarm", "warning"].includes(event.level)).map((event) => `M${px(x(event.t))} 2v14`);
  nodes.push(svg("path", { d: bad.join(""), class: "mark" }));
  if (state.from > 0 || state.to < state.until) {
    nodes.push(svg("rect", { x: px(x(state.from)), y: 0, width: px(Math.max(2, x(state.to) - x(state.from))), height: 18, class: "pick" }));
  }
  root.setAttribute("viewBox", `0 0 ${width} 18`);
  root.replaceChildren(...nodes);
}

function showSide(side) {
  state.side = side;
  document.body.classList.toggle("ground", side === "ground");
  curves.forEach((plot) => plots.splice(plots.indexOf(plot), 1));
  curves = curvePlots(byId("curves"));
  listed = "";
  policyDrawn = null;
  stripLegend();
  mapLegend();
  drawCommandTables();
  byId("notes").replaceChildren(...here().notes.map((note) => html("li", {}, note)));
  redraw();
}

function stepEvent(direction) {
  const times = eventsHere().filter((event) => event.level !== "routine").map(({ t }) => t);
  const next = direction > 0 ? here().events.map(({ t, level }) => (level === "routine" ? -1 : t)).find((t) => t > state.t + 0.5)
    : times.findLast((t) => t < state.t - 0.5);
  if (next !== undefined) setTime(next);
}

// About ten light times there and back around the cursor: where the slopes can be seen.
function zoomToLight() {
  const words = here().words, flights = (words?.flight ?? []).filter((flight) => flight > 0).sort((a, b) => a - b);
  const light = Math.max(50, (flights[flights.length >> 1] ?? 1e6) / 1000);
  zoomTo(state.t - 8 * light, state.t + 8 * light);
}

const KEYS = {
  "+": () => zoomBy(0.5), "-": () => zoomBy(2), 0: () => zoomTo(0, state.until),
  "[": () => stepEvent(-1), "]": () => stepEvent(1), l: () => zoomToLight(),
};

function begin() {
  document.body.prepend(patterns());
  timeline = timelinePlot(byId("timeline"));
  strip = stripPlot(byId("strip"));
  policySection();
  drawLinkTable();
  const slider = byId("slider");
  slider.max = state.until;
  slider.addEventListener("input", () => setTime(Number(slider.value)));
  byId("switch")?.addEventListener("change", (event) => showSide(event.target.checked ? "ground" : "so"));
  byId("events-wanted").addEventListener("change", drawEvents);
  const buttons = { before: () => stepEvent(-1), after: () => stepEvent(1), closer: KEYS["+"], farther: KEYS["-"],
    earlier: () => panBy(-0.5), later: () => panBy(0.5), whole: KEYS[0], light: KEYS.l };
  for (const [id, act] of Object.entries(buttons)) byId(id).addEventListener("click", act);
  addEventListener("keydown", (event) => {
    const typing = ["SELECT", "TEXTAREA"].includes(event.target.tagName);
    if (typing || event.ctrlKey || event.metaKey || event.altKey || !KEYS[event.key]) return;
    event.preventDefault();
    KEYS[event.key]();
  });
  let width = innerWidth;
  addEventListener("resize", () => { if (innerWidth !== width) { width = innerWidth; redrawSoon(); } });
  // Paper is narrow: drawn anew for it, so that text keeps its size.
  const print = (on) => () => { document.body.classList.toggle("printing", on); redraw(); };
  addEventListener("beforeprint", print(true));
  addEventListener("afterprint", print(false));
  const asked = new URLSearchParams(location.hash.slice(1));
  if (asked.get("as") === "ground" && byId("switch")) byId("switch").checked = true;
  const t = asked.has("t") ? Number(asked.get("t")) * 1000 : state.until;
  state.t = Number.isFinite(t) ? Math.min(Math.max(0, t), state.until) : 0;
  slider.value = state.t;
  showSide(asked.get("as") === "ground" ? "ground" : state.side);
  setTime(state.t);
}

begin();
