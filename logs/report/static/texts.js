// What the page says in words at the time of the slider.

function spanAt(name) {
  const lane = here().lanes.find((one) => one.name === name);
  return lane?.spans?.findLast((span) => span.start <= state.t && (span.end ?? Infinity) > state.t);
}

const ago = (t) => `${duration(Math.max(0, state.t - t))} ago`;

function placeName(view, [xCm, yCm]) {
  const cell = `${Math.floor(xCm / 100 / view.cell_m)},${Math.floor(yCm / 100 / view.cell_m)}`;
  return view.chart.tokens.get(cell) ?? cell;
}

function panelValue(title, series) {
  const panel = here().panels.find((one) => one.title.startsWith(title));
  const found = panel?.series.find((one) => one.name === series) ?? panel?.series[0];
  return found && formatted(valueAt(found, state.t), panel.unit);
}

function since(span) {
  return span ? `${span.title.replace(/^(mode|failsafe) /, "")}, since ${seconds(span.start)}` : "not known";
}

function nowSo() {
  const view = here(), rows = [];
  rows.push(["Mode", since(spanAt("Mode"))], ["Failsafe", since(spanAt("Failsafe"))]);
  const action = spanAt("Action");
  rows.push(["Action", action ? action.title : "none, the rover stands"]);
  const truth = view.track && along(view.track, state.t), believed = view.believed && along(view.believed, state.t);
  if (truth) {
    const off = believed ? `, its estimate is ${(Math.hypot(truth[0] - believed[0], truth[1] - believed[1]) / 100).toFixed(2)} m off` : "";
    rows.push(["Place", placeName(view, truth) + off]);
  }
  const battery = panelValue("Battery", "true charge");
  if (battery) rows.push(["Battery", battery]);
  rows.push(["Link", ["Uplink", "Downlink"].map((name) => `${name.toLowerCase()} ${spanAt(name)?.label ?? "open"}`).join(", ")]);
  rows.push(["Goals", goalTokens().join(", ") || "none"]);
  if (panelValue("Growth", "Signs")) {
    rows.push(["Model", `${panelValue("Growth", "Signs")} Signs, ${panelValue("Growth", "hypotheses")} hypotheses, mean C_m ${panelValue("Corroboration", "mean of all hypotheses")}`]);
  }
  return rows;
}

function nowGround(whole) {
  const heard = data.ground.heard, row = lastHeard(), rows = [];
  if (row < 0) rows.push(["Heard", "nothing yet"]);
  else {
    const word = (column) => heard.words[heard[column][row]];
    rows.push(["Heard", `what was so ${ago(heard.so[row])}, at ${seconds(heard.so[row])}`, true]);
    rows.push(["Told", `at ${placeName(data.ground, [heard.x[row], heard.y[row]]).replace("at:", "")}, ${word("mode")}, failsafe ${word("failsafe")}`, true]);
    if (whole) rows.push(["Action", word("action"), true],
      ["Battery", formatted(heard.battery[row] / 1000, "%"), true], ["Goals", word("goals"), true]);
  }
  const predicted = predictedNow();
  if (predicted) {
    const likely = predicted.places.slice(0, 3).map(([sign, chance]) => `${sign} ${Math.round(chance * 100)} %`);
    if (predicted.unknown >= 0.005) likely.push(`anywhere else ${Math.round(predicted.unknown * 100)} %`);
    rows.push(["Predicted", likely.join(", ")]);
  }
  if (whole) {
    const silence = here().lanes.find((lane) => lane.name === "Heard")?.spans
      ?.findLast((span) => span.start <= state.t && (span.end ?? Infinity) > state.t);
    rows.unshift(["Link", silence ? `${silence.label}, since ${seconds(silence.start)}` : "the rover is heard"]);
    const signs = panelValue("Growth", "Signs");
    if (signs) rows.push(["Shadow", `${signs} Signs, ${panelValue("Growth", "hypotheses")} hypotheses`]);
  }
  return rows;
}

function underWay() {
  const open = commandsHere().filter((one) => one.sent <= state.t && (one.ended ?? Infinity) > state.t);
  const shown = open.slice(-4).map((one) => {
    const begun = one.begun !== undefined && one.begun <= state.t, taken = one.taken !== undefined && one.taken <= state.t;
    const stage = begun ? `began ${ago(one.begun)}` : taken ? `arrived ${ago(one.taken)}` : `sent ${ago(one.sent)}`;
    return `${one.number} ${one.text} (${stage})`;
  });
  if (open.length > shown.length) shown.push(`and ${open.length - shown.length} before`);
  return shown.join("; ") || "none";
}

function flying() {
  const words = here().words;
  if (!words || asGround()) return null;
  let count = 0;
  const longest = (words.longest ??= words.flight.reduce((a, b) => Math.max(a, b), 0) / 1000), named = [];
  for (let row = countUpTo(words.t, state.t - longest - 1); row < words.t.length && words.t[row] <= state.t; row++) {
    if (words.lost[row] || words.t[row] + words.flight[row] / 1000 < state.t) continue;
    count++;
    if (words.named[row] && named.length < 4) named.push(words.named[row]);
  }
  if (!count) return "nothing";
  return `${count} word${count === 1 ? "" : "s"}${named.length ? `, among them ${named.join(", ")}` : ""}`;
}

function drawNow() {
  byId("time").replaceChildren(seconds(state.t), html("span", {}, ` ${clock(state.t)}`));
  const rows = asGround() ? nowGround(true) : nowSo();
  rows.push(["Commands", underWay()]);
  const proposal = standingProposal();
  if (proposal) rows.push(["Proposal", `${proposal.number}: ${proposal.action}, towards ${proposal.goal}`]);
  if (flying()) rows.push(["On the way", flying()]);
  const list = (all) => all.flatMap(([name, value, told]) => [html("dt", {}, name), html("dd", told ? { class: "told" } : {}, value)]);
  byId("now").replaceChildren(...list(rows));
  byId("now-ground").replaceChildren(...(asGround() ? [] : list(nowGround(false))));
  const events = here().events.slice(0, countUpTo(here().events.map(({ t }) => t), state.t)).slice(-6);
  byId("latest").replaceChildren(...events.map((event) => html("li", { class: event.level ?? "" },
    html("span", { class: "soft" }, seconds(event.t)), html("span", {}, sign(event.level) + event.text))));
}

const sign = (level) => ({ alarm: "■ ", warning: "▲ " })[level] ?? "";

// --- tables -----------------------------------------------------------------------------------

const COMMAND_HEADS = ["", "order", "sent", "arrived", "begun", "over", "told", "how it ended"];
const SLOWEST = 8, ENDED_OTHERWISE = 60;

function commandTable(commands) {
  const at = (t) => html("td", { class: "number" }, t === undefined ? "–" : seconds(t));
  const after = (t, from) => html("td", { class: "number" }, t === undefined ? "–" : `+${duration(t - from)}`);
  const rows = commands.map((one) => html("tr", {}, html("td", { class: "number" }, String(one.number)),
    html("td", { class: "order" }, one.text), at(one.sent), after(one.taken, one.sent), after(one.begun, one.sent),
    after(one.ended, one.sent), after(asGround() && one.end === undefined ? undefined : one.told_ended, one.sent),
    html("td", one.end && one.end !== "done" ? { class: "bad" } : {},
      one.end ? `${one.end}${one.why ? `: ${one.why}` : ""}` : "not over")));
  return html("div", { class: "scroll" }, html("table", {},
    html("tr", {}, ...COMMAND_HEADS.map((head, column) => html("th", column > 1 && column < 7 ? { class: "number" } : {}, head))), ...rows));
}

function drawCommandTables() {
  const commands = commandsHere();
  const over = commands.filter((one) => one.ended !== undefined && one.end === "done");
  const slowest = [...over].sort((a, b) => (b.ended - b.sent) - (a.ended - a.sent)).slice(0, SLOWEST);
  const others = commands.filter((one) => !one.end || one.end !== "done");
  byId("slowest").replaceChildren(slowest.length ? commandTable(slowest) : html("p", { class: "soft" }, "None is done."));
  const shown = others.slice(-ENDED_OTHERWISE);
  byId("refused").replaceChildren(shown.length ? commandTable(shown) : html("p", { class: "soft" }, "None."),
    ...(others.length > shown.length ? [html("p", { class: "note" }, `The last ${shown.length} of ${others.length}.`)] : []));
  byId("command-count").textContent = asGround() ? `${commands.length} sent, ${over.length} known to be done.` : commandCounts();
}

function commandCounts() {
  const counts = here().command_counts ?? {}, all = Object.values(counts).reduce((a, b) => a + b, 0);
  return [`${all} sent`, ...Object.entries(counts).map(([end, count]) => `${count} ${end || "not over"}`)].join(", ") + ".";
}

let listed = "", items = [], found = [];
const LISTED = 1500;

function drawEvents() {
  const wanted = byId("events-wanted").value, key = `${state.side} ${wanted}`;
  if (listed !== key) {
    listed = key;
    const fits = { warning: (one) => ["warning", "alarm"].includes(one.level), all: () => true,
      "": (one) => one.level !== "routine" }[wanted];
    const events = here().events.filter(fits), shown = events.slice(0, LISTED);
    found = events.map(({ t }) => t);
    items = shown.map((event) => {
      const item = html("li", { class: event.level ?? "", tabindex: 0 }, html("span", {}, sign(event.level)),
        html("span", {}, seconds(event.t)), html("span", { class: "soft who" }, event.role), html("span", {}, event.text));
      const go = () => setTime(event.t);
      item.addEventListener("click", go);
      item.addEventListener("keydown", (press) => { if (press.key === "Enter") go(); });
      return { t: event.t, item };
    });
    byId("events").replaceChildren(...items.map(({ item }) => item));
  }
  // At the ground those up to now: how many are to come is not to be told.
  const count = asGround() ? countUpTo(found, state.t) : found.length;
  byId("events-note").textContent = count > LISTED ? `The first ${LISTED} of ${count}.` : count ? "" : "None.";
  const last = countUpTo(items.map(({ t }) => t), state.t) - 1;
  const list = byId("events"), shown = items[last]?.item;
  if (shown) list.scrollTop = Math.max(0, shown.offsetTop - list.offsetTop - list.clientHeight / 2);
  items.forEach(({ t, item }, number) => {
    item.classList.toggle("here", number === last);
    item.classList.toggle("later", t > state.t && !asGround());
    item.hidden = asGround() && t > state.t;
  });
}

function drawLinkTable() {
  const rows = data.so?.link ?? [];
  if (!rows.length) return;
  const names = { sent: "sent", delivered: "delivered", lost: "lost", outage: "in outage", shadowed: "in shadow",
    queue_full: "queue full", expired: "expired", bit_error: "bit error", store_full: "store full", no_route: "no route", duplicated: "twice", damaged: "damaged",
    refused: "refused" };
  const used = Object.keys(names).filter((name) => ["sent", "delivered", "lost"].includes(name) || rows.some((row) => row.counters[name]));
  byId("link-table").replaceChildren(html("table", {},
    html("tr", {}, html("th", {}, "frames"), ...used.map((name) => html("th", { class: "number" }, names[name])), html("th", { class: "number" }, "mean delay")),
    ...rows.map((row) => html("tr", {}, html("td", {}, row.name),
      ...used.map((name) => html("td", { class: "number" }, formatted(row.counters[name]))),
      html("td", { class: "number" }, row.counters.delay_s === null ? "–" : duration(row.counters.delay_s * 1000))))));
}
