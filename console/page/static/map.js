// The map: what is known is drawn solid, what is predicted dashed and fading with its probability.

const seen = { frame: null, chart: null, heat: [], view: "map", hover: null, ghost: null };
const LIKELY = 0.5;  // below it no ghost is drawn but a region
const LEVELS = 24;

const rounded = (points) => `M${points.map((point) => point.map(px).join(" ")).join("L")}`;

function placeAt(east, north) {
  const character = seen.chart?.rows[seen.chart.rows.length - 1 - north]?.[east];
  if (character === undefined || character === "#" || character === "o") return null;
  return character === "." || character === "~" ? `${east},${north}` : character;
}

const cellOf = ([east, north]) => `${east},${north}`;

class MapDrawing {
  constructor(root) {
    this.root = root;
    this.base = svg("svg", { class: "base" });
    this.over = svg("svg", { class: "over" });
    root.replaceChildren(this.base, this.over);
    this.drawn = "";
    new ResizeObserver(() => { this.measure(); drawSoon(); }).observe(root);
    this.measure();
  }

  measure() {
    this.width = this.root.clientWidth;
    this.height = this.root.clientHeight;
    this.drawn = "";
  }

  // Where a point of the yard, in cells from its south-west corner, is drawn.
  lay() {
    const { rows } = seen.chart, east = rows[0].length, north = rows.length;
    if (seen.view === "columns") {
      const places = new Map(seen.heat.map(([e, n, value]) => [`${e},${n}`, { value, goal: value <= 0, words: `${placeAt(e, n)}: ${px(value)} s` }]));
      const greatest = seen.heat.reduce((most, [, , value]) => Math.max(most, value), 1e-9);
      const columns = columnsOf(rows, places, greatest, (e, n) => placeAt(e, n) ?? "");
      const up = (x, y) => TALLEST * (places.get(`${Math.floor(x)},${Math.floor(y)}`)?.value ?? 0) / greatest;
      return { nodes: columns.nodes, box: columns.box, unit: 22, at: (x, y) => columns.project(x, y, up(x, y)) };
    }
    const unit = Math.max(1, Math.min(this.width / east, this.height / north));
    const yard = yardOf(rows, unit), name = yard.querySelector("text");
    if (seen.view === "heat") this.heat(unit, north).forEach((node) => yard.insertBefore(node, name));
    const box = [(east * unit - this.width) / 2, (north * unit - this.height) / 2, this.width, this.height];
    return { nodes: [yard], box, unit, at: (x, y) => [x * unit, (north - y) * unit] };
  }

  heat(unit, rows) {
    const greatest = seen.heat.reduce((most, [, , value]) => Math.max(most, value), 1e-9);
    const levels = new Map(), words = [];
    for (const [east, north, value] of seen.heat) {
      const level = Math.round(LEVELS * value / greatest), [x, y] = [px(east * unit), px((rows - 1 - north) * unit)];
      levels.set(level, (levels.get(level) ?? "") + `M${x} ${y}h${px(unit)}v${px(unit)}h${px(-unit)}z`);
      if (unit >= 34) words.push(text(x + unit / 2, y + unit - 6, String(Math.round(value)), { class: "halo", "text-anchor": "middle" }));
    }
    return [...[...levels].map(([level, d]) => svg("path", { d, class: "heat", fill: ramp(level / LEVELS, 0) })), ...words];
  }

  draw() {
    if (!seen.chart || !this.width || !this.height) return;
    if (this.drawn !== seen.view) {
      this.drawn = seen.view;
      this.laid = this.lay();
      const box = this.laid.box.map(px).join(" ");
      this.base.setAttribute("viewBox", box);
      this.over.setAttribute("viewBox", box);
      this.base.replaceChildren(...this.laid.nodes);
    }
    if (seen.frame) this.over.replaceChildren(...this.shapes(seen.frame.map));
  }

  middle([east, north]) { return this.laid.at(east + 0.5, north + 0.5); }

  square([east, north], part, attributes) {
    const [a, b] = [0.5 - part / 2, 0.5 + part / 2];
    const corners = [[a, a], [b, a], [b, b], [a, b]].map(([x, y]) => this.laid.at(east + x * 0.999, north + y * 0.999));
    return svg("path", { d: `${rounded(corners)}z`, ...attributes });
  }

  shapes(map) {
    const { unit } = this.laid, nodes = [];
    const line = (spots, cls) => spots?.length > 1 && nodes.push(svg("path", { d: rounded(spots.map((spot) => this.middle(spot))), class: cls }));
    for (const piece of pieces(map.track ?? [])) line(piece, "track");
    line(map.policy, "policy");
    if (unit >= 34 && seen.view === "map") {
      const taken = new Set([map.now, ...map.after ?? []].filter(Boolean).flatMap(({ spots }) => spots).map(cellOf));
      for (const goal of map.goals ?? []) taken.add(`${goal.east},${goal.north}`);
      for (const spot of (map.policy ?? []).filter((one) => !taken.has(cellOf(one)))) {
        const [x, y] = this.laid.at(spot[0] + 0.94, spot[1] + 0.1);
        nodes.push(text(x, y, String(Math.round(spot[2])), { class: "cost halo", "text-anchor": "end" }));
      }
    }
    line(map.committed, "committed");
    if (map.now) nodes.push(...this.ghost(map.now, "◌", "ghost now"));
    for (const ghost of map.after ?? []) nodes.push(...this.ghost(ghost, String(ghost.command ?? ""), "ghost"));
    for (const goal of map.goals ?? []) nodes.push(...this.goal(goal));
    if (map.heard) nodes.push(this.rover(map));
    nodes.push(...this.meant());
    return nodes;
  }

  ghost(ghost, mark, cls) {
    const [first] = ghost.spots, { unit } = this.laid;
    const title = svg("title", {}, ghost.label);
    if (!first) return [];
    if (first[2] < LIKELY) {
      const region = ghost.spots.map((spot) => this.square(spot, 0.92, { class: "region", "fill-opacity": px(0.2 + spot[2]) }));
      const [x, y] = this.middle(first);
      return [svg("g", {}, title, ...region), text(x, y + 5, `${mark} ?`, { class: "halo", "text-anchor": "middle" })];
    }
    const [x, y] = this.middle(first);
    const circle = svg("circle", { cx: px(x), cy: px(y), r: px(unit * 0.34), class: cls, opacity: px(first[2]) });
    const name = mark === "◌" ? [] : [text(x, y + 5, mark, { class: "halo ghost-name", "text-anchor": "middle" })];
    return [svg("g", {}, title, circle, ...name)];
  }

  goal(goal) {
    const [x, y] = this.laid.at(goal.east + 0.68, goal.north + 0.36), r = px(Math.max(8, this.laid.unit * 0.26));
    const shape = svg("path", { d: `M${px(x)} ${px(y - r)}l${r} ${r}l${-r} ${r}l${-r} ${-r}z`, class: goal.is_sent ? "goal sent" : "goal" });
    return [svg("g", {}, svg("title", {}, goal.name), shape), text(x, y + 5, String(goal.order), { class: goal.is_sent ? "halo" : "goal-order", "text-anchor": "middle" })];
  }

  rover(map) {
    const { cell_m } = seen.chart, { x_m, y_m, heading_rad } = map.heard, r = px(Math.max(5, this.laid.unit * 0.2));
    const [x, y] = this.laid.at(x_m / cell_m, y_m / cell_m);
    const [tipX, tipY] = this.laid.at(x_m / cell_m + 0.36 * Math.cos(heading_rad), y_m / cell_m + 0.36 * Math.sin(heading_rad));
    return svg("g", { class: map.heard_stale ? "rover stale" : "rover" }, svg("title", {}, map.heard_label),
      svg("circle", { cx: px(x), cy: px(y), r }), svg("path", { d: rounded([[x, y], [tipX, tipY]]) }));
  }

  // What an action at hand would do, and the place under the pointer.
  meant() {
    const nodes = [], option = seen.frame.options.find(({ action }) => action === seen.ghost);
    for (const spot of option?.spots ?? []) {
      nodes.push(this.square(spot, 0.84, { class: "meant", opacity: px(0.25 + 0.75 * spot[2]) }));
      const [x, y] = this.middle(spot);
      nodes.push(text(x, y - this.laid.unit * 0.2, `${Math.round(100 * spot[2])} %`, { class: "halo", "text-anchor": "middle" }));
    }
    if (seen.hover) {
      const [x, y] = this.laid.at(seen.hover.east + 0.5, seen.hover.north + 1);
      nodes.push(this.square([seen.hover.east, seen.hover.north], 0.96, { class: "hover" }),
        text(x, y - 4, `◆ ${seen.hover.place}`, { class: "halo", "text-anchor": "middle" }));
    }
    return nodes;
  }

  // The place at a point of the screen; none while columns hide which it is.
  pick(event) {
    if (!this.laid || seen.view === "columns") return null;
    const box = this.base.getBoundingClientRect(), [left, top] = this.laid.box, { unit } = this.laid;
    const east = Math.floor((event.clientX - box.left + left) / unit);
    const north = seen.chart.rows.length - 1 - Math.floor((event.clientY - box.top + top) / unit);
    const place = placeAt(east, north);
    return place && { east, north, place };
  }
}

// Places that follow one another in a row; which way it went between others nobody has told.
function pieces(spots) {
  const found = [];
  for (const spot of spots) {
    const last = found.at(-1)?.at(-1);
    if (last && Math.abs(last[0] - spot[0]) + Math.abs(last[1] - spot[1]) === 1) found.at(-1).push(spot);
    else found.push([spot]);
  }
  return found;
}
