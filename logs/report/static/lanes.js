// The timeline: a row for each thing that lasts, and the commands.

const LANE = 22;
const LINK_LANES = ["Uplink", "Downlink", "Heard"];

function drawLanes(width, narrow, lanes, withAxis = true) {
  const gutter = narrow ? 0 : 122;
  const head = narrow ? 19 : 0;
  const x = scale(gutter, width - 8);
  const nodes = [], rows = [];
  let y = 4;
  for (const lane of lanes) {
    const height = lane.height ?? LANE;
    if (narrow) nodes.push(text(0, y + 14, lane.name, { class: "soft" }));
    else nodes.push(text(0, y + height / 2 + 5, shortened(lane.name, gutter - 8), { class: "soft" }));
    const top = y + head;
    nodes.push(svg("path", { d: `M${x.left} ${top + height / 2}H${x.right}`, class: "gridline" }));
    nodes.push(...(lane.draw ?? drawSpans)(lane, x, top, height));
    rows.push({ lane, top, bottom: top + height });
    y = top + height + 5;
  }
  const clip = clipTo(x, y);
  const body = svg("g", { "clip-path": `url(#${clip.id})` }, ...nodes.filter((node) => !node.fixed));
  const all = [clip.node, ...(withAxis ? [axis(x, 0, y)] : []), ...nodes, body];
  return { x, height: y + (withAxis ? 22 : 2), nodes: all, rows };
}

let clips = 0;
function clipTo(x, height) {
  const id = `clip-${clips = (clips + 1) % 1000}`;
  const area = svg("rect", { x: x.left, y: -20, width: x.right - x.left, height: height + 60 });
  return { id, node: svg("clipPath", { id }, area) };
}

function shortened(words, room) {
  if (widthOf(words) <= room) return words;
  let kept = words;
  while (kept.length > 1 && widthOf(kept + "…") > room) kept = kept.slice(0, -1);
  return kept + "…";
}

const within = (x, from, to) => [Math.max(x.left, x(from)), Math.min(x.right, x(to))];

function drawSpans(lane, x, top, height) {
  const paths = new Map(), labels = [], nodes = [];
  const add = (cls, d) => paths.set(cls, (paths.get(cls) ?? "") + d);
  for (const span of lane.spans) {
    if (span.end < state.from || span.start > state.to) continue;
    const [left, right] = within(x, span.start, span.end);
    const room = Math.max(1, right - left - (right - left > 4 ? 1 : 0));
    const low = span.kind === "nominal" ? height * 0.3 : 0;  // nothing to see here
    add(span.kind, `M${px(left)} ${px(top + low)}h${px(room)}v${px(height - 2 * low)}h${px(-room)}z`);
    const label = span.label && widthOf(span.label) + 12 <= room;
    if (label) labels.push({ at: left + room / 2, words: span.label, kind: span.kind });
  }
  for (const [kind, d] of paths) {
    nodes.push(svg("path", { d, class: `f-${kind}` }));
    if (PATTERN[kind]) nodes.push(svg("path", { d, fill: `url(#p-${PATTERN[kind]})` }));
  }
  for (const { at, words } of labels) {
    const half = widthOf(words) / 2 + 5;
    nodes.push(svg("rect", { x: px(at - half), y: top + 2, width: px(2 * half), height: height - 4,
      rx: 3, class: "chip" }));
    nodes.push(text(at, top + height / 2 + 5, words, { "text-anchor": "middle", class: "label" }));
  }
  for (const mark of lane.marks) {
    if (mark.t < state.from || mark.t > state.to) continue;
    nodes.push(markAt(mark.kind, x(mark.t), top + height / 2));
  }
  return nodes;
}

function markAt(kind, x, y, size = 5) {
  const d = {
    reached: `M${px(x)} ${y - 7}l7 7l-7 7l-7 -7z`,
    cross: `M${px(x - size)} ${y - size}l${2 * size} ${2 * size}m0 ${-2 * size}l${-2 * size} ${2 * size}`,
  }[kind] ?? `M${px(x)} ${y - 7}v14`;
  return svg("path", { d, class: `mark ${kind === "reached" ? "solid" : kind}` });
}

// Commands stand on three levels in turn: sent (a tick), on board (a line), under way (a bar).
function commandLane() {
  return { name: "Commands", height: 44, commands: commandsHere(), draw: drawCommands, marks: [],
    spans: [] };
}

const LEVELS = 3;

function drawCommands(lane, x, top, height) {
  const step = height / LEVELS;
  const d = { sent: "", way: "", bar: "", bad: "" };
  const nodes = [], free = Array(LEVELS).fill(-Infinity);
  for (const one of lane.commands) {
    const last = one.ended ?? (asGround() ? state.t : state.until);
    if (last < state.from || one.sent > state.to) continue;
    const level = one.number % LEVELS;
    const y = px(top + step * (level + 0.5));
    const [left, right] = within(x, one.sent, last);
    if (one.sent >= state.from) d.sent += `M${px(left)} ${px(y - 5)}v10`;
    d.way += `M${px(left)} ${y}H${px(right)}`;
    if (one.begun !== undefined) {
      const [begun, ended] = within(x, one.begun, last);
      const room = Math.max(1, ended - begun);
      d.bar += `M${px(begun)} ${px(y - 4)}h${px(room)}v8h${px(-room)}z`;
    }
    if (one.end && one.end !== "done" && one.ended <= state.to) {
      d.bad += `M${px(right - 4)} ${y - 4}l8 8m0 -8l-8 8`;
    }
    const words = String(one.number);
    if (right - left > widthOf(words) + 14 && left > free[level]) {
      nodes.push(text(left + 4, y + 5, words, { class: "halo label" }));
      free[level] = left + widthOf(words) + 8;
    }
  }
  return [
    svg("path", { d: d.way, class: "rail" }),
    svg("path", { d: d.bar, class: "f-guided" }),
    svg("path", { d: d.sent, class: "mark" }),
    svg("path", { d: d.bad, class: "mark bad" }),
    ...nodes,
  ];
}

function commandTitle(one) {
  const parts = [`command ${one.number}: ${one.text}`];
  if (one.taken !== undefined) parts.push(`arrived ${duration(one.taken - one.sent)} after it was sent`);
  if (one.end) parts.push(`${one.end}${one.why ? `: ${one.why}` : ""}, at ${seconds(one.ended)}`);
  return parts.join("; ");
}

// What is told of what lies under the pointer.
function tellLane(drawn, x, y) {
  const row = drawn.rows.find(({ top, bottom }) => y >= top - 2 && y <= bottom + 3);
  if (!row) return "";
  const t = drawn.x.at(x), near = 6 / drawn.x.perMs;
  if (row.lane.commands) {
    const level = Math.min(LEVELS - 1, Math.max(0, Math.floor((y - row.top) / (row.bottom - row.top) * LEVELS)));
    const found = row.lane.commands.findLast((one) => one.number % LEVELS === level
      && one.sent - near <= t && t <= (one.ended ?? state.t) + near);
    return found ? commandTitle(found) : row.lane.name;
  }
  const mark = row.lane.marks.find((one) => Math.abs(one.t - t) <= near);
  const span = row.lane.spans.findLast((one) => one.start <= t && t <= one.end);
  const wide = row.lane.spans.findLast((one) => one.start - near <= t && t <= one.end + near);
  return mark?.title ?? (span ?? wide)?.title ?? row.lane.name;
}

function timelinePlot(host) {
  let drawn = null;
  return new Plot(host, (width, narrow) => {
    const lanes = lanesHere().filter((lane) => !LINK_LANES.includes(lane.name));
    return (drawn = drawLanes(width, narrow, [...lanes, commandLane()]));
  }, (x, y) => tellLane(drawn, x, y));
}
