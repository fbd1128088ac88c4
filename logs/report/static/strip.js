// The space-time diagram: the ground above, the rover below, time to the right. Every word is a
// slanted line, and its slope is the light time. Lost ones end with a cross, outages are gaps.

const WORD_CLASS = ["command", "event", "proposal", "proposal", "model", "alike", "stored", "alike w-heartbeat",
  "report", "alike"];
const ALIKE_FROM = 5;  // of the kinds: those that are many alike
const CROSS = 0.72;  // of the way: where a lost word ends
const hiddenKinds = new Set();

function wordsInView(words) {
  const rows = [];
  const longest = (words.longest ??= words.flight.reduce((a, b) => Math.max(a, b), 0) / 1000);
  for (let row = countUpTo(words.t, state.from - longest - 1); row < words.t.length; row++) {
    const t = words.t[row], down = words.kind[row] >= 100, arrives = t + words.flight[row] / 1000;
    if (t > state.to) break;
    if (arrives < state.from || hiddenKinds.has(words.kind[row] % 100)) continue;
    if (asGround() && (down ? arrives : t) > state.t) continue;
    rows.push(row);
  }
  return rows;
}

function drawStrip(width, narrow) {
  const gutter = narrow ? 0 : 122;
  const x = scale(gutter, width - 8);
  const lanes = lanesHere().filter((lane) => LINK_LANES.includes(lane.name));
  const above = drawLanes(width, narrow, lanes, false);
  const top = above.height + (narrow ? 38 : 26), bottom = top + 128, end = bottom + 24;
  const words = here().words;
  const clip = clipTo(x, end);
  const { paths, labels, note, dense } = wordPaths(words, x, top, bottom);
  const body = svg("g", { "clip-path": `url(#${clip.id})`, class: dense ? "dense" : "" });
  body.append(...outageBands(lanes, x, top, bottom), ...notYetKnown(x, top, bottom));
  for (const [cls, d] of paths) body.append(svg("path", { d, class: `w ${cls}` }));
  body.append(...labels);
  const names = narrow
    ? [text(0, top - 20, "ground above, rover below", { class: "soft" })]
    : [text(0, top + 5, "Ground", { class: "soft" }), text(0, bottom + 5, "Rover", { class: "soft" })];
  const sides = [top, bottom].map((y) => svg("path", { d: `M${x.left} ${y}H${x.right}`, class: "side" }));
  stripNote(note);
  return { x, height: end + 22, rows: above.rows, top, bottom,
    nodes: [clip.node, axis(x, 0, end), ...above.nodes, ...names, body, ...sides] };
}

function outageBands(lanes, x, top, bottom) {
  const nodes = [], seen = new Set();
  for (const lane of lanes) {
    for (const span of lane.spans) {
      const key = `${span.start} ${span.end}`;
      if (seen.has(key) || span.end < state.from || span.start > state.to) continue;
      seen.add(key);
      const [left, right] = within(x, span.start, span.end);
      const box = { x: px(left), width: px(Math.max(1, right - left)) };
      const cls = span.kind === "planned" ? "planned-wash" : "lost-wash";
      nodes.push(svg("rect", { ...box, y: top, height: bottom - top, class: cls }));
    }
  }
  return nodes;
}

// On the ground's side: what lies right of the last word that came up from the rover.
function notYetKnown(x, top, bottom) {
  if (!asGround()) return [];
  const so = x(heardUntil()), now = x(state.t);
  return [svg("path", { class: "unknown",
    d: `M${px(now)} ${top}L${px(so)} ${bottom}H${x.right + 2}V${top}z` })];
}

function wordPaths(words, x, top, bottom) {
  const paths = new Map(), labels = [];
  const add = (cls, d) => paths.set(cls, (paths.get(cls) ?? "") + d);
  const rows = wordsInView(words);
  const alike = rows.filter((row) => words.kind[row] % 100 >= ALIKE_FROM).length;
  // Every n-th of each kind, so that no kind goes for another.
  const every = Math.max(1, Math.ceil(alike / (3 * (x.right - x.left))));
  const counted = new Map();
  const free = { up: -Infinity, down: -Infinity };
  const few = rows.length - alike <= (x.right - x.left) / 14;
  const arrived = new Set(asGround() ? commandsHere().filter((one) => one.taken !== undefined).map((one) => `command ${one.number}`) : []);
  const dense = rows.length - alike > (x.right - x.left) / 5;
  for (const row of rows) {
    const kind = words.kind[row] % 100, down = words.kind[row] >= 100;
    const lost = words.lost[row] > 0;
    if (kind >= ALIKE_FROM && every > 1) {
      const key = words.kind[row] * 2 + lost;
      const count = counted.get(key) ?? 0;
      counted.set(key, count + 1);
      if (count % every) continue;
    }
    const [from, to] = down ? [bottom, top] : [top, bottom];
    const left = x(words.t[row]), flight = words.flight[row] / 1000 * x.perMs;
    const part = lost ? CROSS : 1;
    const right = left + flight * part, y = from + (to - from) * part;
    const unsure = asGround() && words.unended.has(row) && !arrived.has(words.named[row].split(",")[0]);
    add(`w-${WORD_CLASS[kind]}${unsure ? " w-open" : ""}`, `M${px(left)} ${from}L${px(right)} ${px(y)}`);
    if (lost) {
      const size = kind < ALIKE_FROM && !dense ? 4 : 2.5;
      add(kind < ALIKE_FROM ? "w-cross" : "w-cross w-many", `M${px(right - size)} ${px(y - size)}l${2 * size} ${2 * size}m0 ${-2 * size}l${-2 * size} ${2 * size}`);
    }
    if (words.again.has(row) && kind < ALIKE_FROM) {
      add("w-again", `M${px(left - 3)} ${from}a3 3 0 1 0 6 0a3 3 0 1 0 -6 0`);
    }
    const name = few && kind < ALIKE_FROM && words.named[row];
    const side = down ? "down" : "up";
    if (name && left >= free[side] && left + widthOf(name) < x.right) {
      labels.push(text(left, down ? bottom + 18 : top - 8, name, { class: "label" }));
      free[side] = left + widthOf(name) + 12;
    }
  }
  // What matters lies on top.
  const order = ["w-report", "w-alike", "w-stored", "w-model", "w-proposal", "w-event", "w-command", "w-cross", "w-again"];
  const rank = ([cls]) => order.findIndex((name) => cls.startsWith(name));
  return { paths: [...paths].sort((a, b) => rank(a) - rank(b)), labels, note: every, dense };
}

function stripNote(every) {
  byId("strip-note").textContent = every > 1
    ? `At this zoom, 1 in ${every} of each kind of words that are many alike is drawn; of commands, events and proposals all that this page holds.`
    : "";
}

// The words nearest to the pointer.
function tellWord(drawn, x, y) {
  if (y < drawn.top - 4 || y > drawn.bottom + 4) return tellLane(drawn, x, y);
  const words = here().words;
  let best = null, distance = 7;
  for (const row of wordsInView(words)) {
    const down = words.kind[row] >= 100, part = words.lost[row] ? CROSS : 1;
    const share = (y - drawn.top) / (drawn.bottom - drawn.top);
    const way = down ? 1 - share : share;
    if (way > part) continue;
    const at = drawn.x(words.t[row] + words.flight[row] / 1000 * way);
    const weight = Math.abs(at - x) + (words.kind[row] % 100 >= ALIKE_FROM ? 1.5 : 0);
    if (weight < distance) [best, distance] = [row, weight];
  }
  return best === null ? "" : wordTitle(words, best);
}

function wordTitle(words, row) {
  const name = words.named[row] || words.kinds[words.kind[row] % 100];
  const flight = duration(words.flight[row] / 1000);
  const sent = `${name}, sent at ${seconds(words.t[row])}`;
  if (words.lost[row]) return `${sent}, ${words.losses[words.lost[row]]}`;
  if (words.unended.has(row)) return asGround() ? sent : `${sent}, on its way at the end of the log`;
  return `${sent}, ${flight} on its way`;
}

function stripLegend() {
  // At the ground all kinds: those to come are not to be told.
  const used = new Set(asGround() ? here().words.kinds.keys() : here().words.kind.map((kind) => kind % 100));
  const shown = here().words.kinds.map((name, kind) => ({ name, kind })).filter(({ kind }) => used.has(kind));
  const entries = shown.map(({ name, kind }) => {
    const box = html("input", { type: "checkbox" });
    box.checked = !hiddenKinds.has(kind);
    box.addEventListener("change", () => {
      if (box.checked) hiddenKinds.delete(kind); else hiddenKinds.add(kind);
      redrawSoon();
    });
    return html("label", {}, box, sample(`w w-${WORD_CLASS[kind]}`), name);
  });
  const cross = svg("svg", { viewBox: "0 0 30 10" },
    svg("path", { d: "M0 8L18 3", class: "w w-event" }),
    svg("path", { d: "M14 -1l8 8m0 -8l-8 8", class: "w w-cross" }));
  const again = svg("svg", { viewBox: "0 0 30 10" },
    svg("path", { d: "M12 5a3 3 0 1 0 6 0a3 3 0 1 0 -6 0", class: "w w-again" }));
  byId("strip-legend").replaceChildren(...entries, html("span", {}, cross, "lost"),
    html("span", {}, again, "sent again"));
}

const sample = (cls) => svg("svg", { viewBox: "0 0 30 10" }, svg("path", { d: "M0 5H30", class: cls }));

function stripPlot(host) {
  let drawn = null;
  return new Plot(host, (width, narrow) => (drawn = drawStrip(width, narrow)),
    (x, y) => tellWord(drawn, x, y));
}
