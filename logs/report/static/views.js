// The two sides of a run: what was so, and what the ground knew. On the ground's side nothing is
// taken that it did not know at the time of the slider.

const summed = (steps) => { let sum = 0; return steps.map((step) => (sum += step)); };

function prepare(view) {
  for (const panel of view.panels ?? []) {
    for (const series of panel.series) {
      series.t = summed(series.t);
      if (series.known) series.known = summed(series.known);
    }
  }
  for (const track of [view.track, view.believed]) if (track) track.t = summed(track.t);
  if (view.words) {
    view.words.t = summed(view.words.t);
    view.words.again = new Set(view.words.again);
    view.words.unended = new Set(view.words.unended);
    let next = 0;
    const names = view.words.named;
    view.words.named = view.words.kind.map((kind) => (kind % 100 < ALIKE_FROM ? names[next++] : ""));
  }
  if (view.heard) {
    const heard = view.heard;
    heard.known = summed(heard.known);
    heard.so = summed(heard.so);
    let newest = 0;
    heard.newest = heard.so.map((so, row) => (so >= heard.so[newest] ? (newest = row) : newest));
    heard.bySo = heard.so.map((_, row) => row).sort((a, b) => heard.so[a] - heard.so[b] || a - b);
  }
  for (const key of ["lanes", "panels", "commands", "proposals", "events", "maps", "notes", "bumps",
    "predicted", "rows", "link"]) view[key] ??= [];
  const named = (names) => (row) => Object.fromEntries(names.map((name, place) => [name, row[place] ?? undefined]));
  view.commands = view.commands.map(named(["number", "text", "sent", "taken", "begun", "ended", "end", "why",
    "told_taken", "told_begun", "told_ended"]));
  for (const lane of view.lanes) {
    lane.spans = (lane.spans ?? []).map(named(["start", "end", "kind", "label", "title", "known", "known_end"]));
  }
  view.chart = chartOf(view);
  return view;
}

function chartOf(view) {
  const height = view.rows.length, cells = new Map();
  view.rows.forEach((row, fromNorth) => [...row].forEach((character, east) => {
    const north = height - 1 - fromNorth;
    if (character === "#" || character === "o") return;
    const named = character >= "A" && character <= "Z";
    cells.set(`at:${named ? character : `${east},${north}`}`, { east, north, named });
  }));
  const tokens = new Map([...cells].map(([token, cell]) => [`${cell.east},${cell.north}`, token]));
  return { cells, tokens, width: view.rows[0]?.length ?? 1, height: Math.max(1, height) };
}

// The number of sorted values that are not greater than `value`.
function countUpTo(values, value) {
  let low = 0, high = values.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] <= value) low = middle + 1; else high = middle;
  }
  return low;
}

const asGround = () => state.side === "ground";
const here = () => data[state.side];
const isKnown = (t) => !asGround() || t <= state.t;

// A span as far as it is known; nothing if it is not.
function known(span) {
  if (!asGround()) return { ...span, end: span.end ?? state.until };
  if ((span.known ?? span.start) > state.t) return null;
  const over = span.end !== undefined && (span.known_end ?? span.end) <= state.t;
  const horizon = span.known === undefined ? state.t : Math.max(span.start, heardUntil());
  return { ...span, end: over ? span.end : horizon };
}

// The row of telemetry that was measured last, of those that had arrived at a time; -1 for none.
function lastHeard(t = state.t) {
  const heard = data.ground.heard;
  return heard ? heard.newest[countUpTo(heard.known, t) - 1] ?? -1 : -1;
}

// The newest moment on board that the ground has heard of.
function heardUntil() {
  const row = lastHeard();
  return row < 0 ? 0 : data.ground.heard.so[row];
}

// Rows of the timeline that the ground makes from telemetry: a gap stays a gap until it is filled.
function heardLanes() {
  const heard = here().heard;
  const lanes = [["Mode", heard.mode], ["Failsafe", heard.failsafe], ["Goals", heard.goals]]
    .map(([name, column]) => ({ name, column, spans: [], marks: [] }));
  let before = -1;
  for (const row of heard.bySo) {
    if (heard.known[row] > state.t) continue;
    const near = before >= 0 && heard.so[row] - heard.so[before] <= heard.gap;
    for (const lane of lanes) {
      const last = lane.spans.at(-1);  // never a gap: a span follows each
      const same = last && lane.column[row] === lane.column[before];
      if (near) last.end = heard.so[row];
      if (near && same) continue;
      if (before >= 0 && !near) lane.spans.push(unheard(heard.so[before], heard.so[row]));
      const word = heard.words[lane.column[row]];
      const kind = lane.name === "Goals" ? "told" : word;
      lane.spans.push({ start: heard.so[row], end: heard.so[row], kind, label: word,
        title: `${lane.name.toLowerCase()} ${word}, as told` });
    }
    before = row;
  }
  for (const lane of lanes) if (before >= 0) lane.spans.push(unheard(heard.so[before], state.t));
  return lanes;
}

const unheard = (start, end) => ({ start, end, kind: "gap", label: end - start > 2 * here().heard.gap ? "no word" : "",
  title: `no word of ${seconds(start)} to ${seconds(end)}` });

function lanesHere() {
  const lanes = here().lanes.map((lane) => ({
    name: lane.name,
    spans: lane.spans.map(known).filter(Boolean),
    marks: (lane.marks ?? []).filter((mark) => isKnown(mark.known ?? mark.t)),
  }));
  return asGround() && here().heard ? [...heardLanes(), ...lanes] : lanes;
}

// A command as it is known: the stages that have not been told are left out.
function commandsHere() {
  if (!asGround()) return here().commands;
  return here().commands.filter((one) => one.sent <= state.t).map((one) => {
    const told = (stage) => one[`told_${stage}`] <= state.t;
    return {
      ...one,
      taken: told("taken") ? one.taken : undefined,
      begun: told("begun") ? one.begun : undefined,
      ended: told("ended") ? one.ended : undefined,
      end: told("ended") ? one.end : undefined,
      why: told("ended") ? one.why : undefined,
    };
  });
}

const eventsHere = () => here().events.filter((event) => isKnown(event.t));
