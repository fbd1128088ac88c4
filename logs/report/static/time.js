// Time: the part of the run that is on the screen, its scale, and how times are written.

const state = { side: "so", t: 0, from: 0, to: 1, until: 1 };

// As in logs and mission files: tenths of a second, rounded down.
function seconds(t) {
  const tenths = Math.floor(t / 100);
  return `${Math.floor(tenths / 10)}.${tenths % 10} s`;
}

function duration(t) {
  if (t < 1000) return `${(t / 1000).toFixed(t < 100 ? 3 : 2)} s`;
  return `${(t / 1000).toFixed(1)} s`;
}

function scale(left, right) {
  const perMs = (right - left) / Math.max(1e-9, state.to - state.from);
  const x = (t) => left + (t - state.from) * perMs;
  x.at = (px) => state.from + (px - left) / perMs;
  x.left = left;
  x.right = right;
  x.perMs = perMs;
  return x;
}

function timeTicks(x) {
  const least = 92 / x.perMs / 1000;
  const step = NICE_S.find((s) => s >= least) ?? Math.ceil(least / 86400) * 86400;
  const digits = step >= 1 ? 0 : step >= 0.1 ? 1 : 2;
  const ticks = [];
  for (let n = Math.ceil(state.from / 1000 / step - 1e-9); n * step * 1000 <= state.to + 1e-6; n++) {
    ticks.push({ t: n * step * 1000, text: clock(n * step * 1000, digits) });
  }
  return ticks;
}

// Whole numbers of 1, 2 or 5: where a scale of values is marked.
function valueTicks(top, count) {
  const raw = top / count;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((n) => n * power).find((s) => s >= raw * 0.999);
  const ticks = [];
  for (let n = 0; n * step <= top * 1.0001; n++) ticks.push(n * step);
  return ticks;
}

function zoomTo(from, to) {
  const least = Math.min(20, state.until);
  const width = Math.min(Math.max(to - from, least), state.until);
  state.from = Math.min(Math.max(0, from), state.until - width);
  state.to = state.from + width;
  redrawSoon();
}

function zoomBy(factor, about = state.t) {
  const middle = about >= state.from && about <= state.to ? about : (state.from + state.to) / 2;
  zoomTo(middle - (middle - state.from) * factor, middle + (state.to - middle) * factor);
}

function panBy(share) {
  const width = state.to - state.from;
  zoomTo(state.from + share * width, state.to + share * width);
}
