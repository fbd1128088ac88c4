// The yard as the chart has it, and as the seed's columns, for the report and the console.

// Walls, rocks, places and their names, from the top left corner.
function yardOf(rows, cell) {
  const d = { wall: "", rock: "", shade: "", place: "" };
  const names = [];
  rows.forEach((row, line) => [...row].forEach((character, east) => {
    const x = px(east * cell), y = px(line * cell), side = px(cell);
    const box = `M${x} ${y}h${side}v${side}h${-side}z`;
    if (character === "#") d.wall += box;
    else if (character === "o") d.rock += `M${px((east + 0.15) * cell)} ${px((line + 0.5) * cell)}a${px(cell * 0.35)} ${px(cell * 0.35)} 0 1 0 ${px(cell * 0.7)} 0a${px(cell * 0.35)} ${px(cell * 0.35)} 0 1 0 ${px(-cell * 0.7)} 0`;
    else {
      if (cell >= 8) d.place += box;
      if (character === "~") d.shade += box;
      if (character !== "." && character !== "~" && cell >= 9) {
        names.push(text((east + 0.16) * cell, (line + 0.16) * cell + 11, character, { class: "big halo" }));
      }
    }
  }));
  return svg("g", {}, ...Object.entries(d).map(([cls, path]) => svg("path", { d: path, class: cls })), ...names);
}

const TURN = -20 * Math.PI / 180, TILT = 48 * Math.PI / 180, TALLEST = 5;
const RAMP = [[255, 210, 122], [247, 154, 92], [226, 96, 108], [168, 69, 138], [101, 57, 143], [43, 42, 102]];

function ramp(share, shade) {
  const position = Math.min(1, Math.max(0, share)) * (RAMP.length - 1);
  const low = Math.min(Math.floor(position), RAMP.length - 2);
  const mix = RAMP[low].map((a, i) => a + (RAMP[low + 1][i] - a) * (position - low));
  return `rgb(${mix.map((part) => Math.round(part * (1 - shade))).join(",")})`;
}

// Columns as high as the values of their places, in the painter's order. `places` holds, by
// "east,north", { value, goal, words }; `other` gives the words of a place that has none.
function columnsOf(rows, places, greatest, other) {
  const unit = 30, width = rows[0].length, height = rows.length;
  const project = (east, north, up) => {
    const x = east - width / 2, y = north - height / 2;
    const across = x * Math.cos(TURN) - y * Math.sin(TURN), away = x * Math.sin(TURN) + y * Math.cos(TURN);
    return [across * unit, -(away * Math.sin(TILT) + up * Math.cos(TILT)) * unit];
  };
  const blocks = [];
  rows.forEach((row, line) => [...row].forEach((character, east) => {
    const north = height - 1 - line, value = places.get(`${east},${north}`);
    const block = { east, north, up: 0, fill: () => "var(--panel)", words: other(east, north),
      name: character >= "A" && character <= "Z" ? character : "", goal: value?.goal };
    if (character === "#" || character === "o") {
      Object.assign(block, { up: character === "#" ? 0.25 : 0.45, fill: () => "var(--grid)", words: character === "#" ? "wall" : "rock" });
    } else if (value) {
      block.up = TALLEST * value.value / greatest;
      block.fill = value.goal ? () => "var(--page)" : (shade) => ramp(value.value / greatest, shade);
      block.words = value.words;
    }
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
  const xs = points.reduce((most, [x]) => [Math.min(most[0], x), Math.max(most[1], x)], [Infinity, -Infinity]);
  const ys = points.reduce((most, [, y]) => [Math.min(most[0], y), Math.max(most[1], y)], [Infinity, -Infinity]);
  const top = ys[0] - 24;
  return { project, nodes: [...nodes, ...names], box: [xs[0] - 4, top, xs[1] - xs[0] + 8, ys[1] - top + 4] };
}
