// Keys, pointer and buttons. What is pressed goes to the server with how long its meaning has stood.

const meanings = new Map();

function means(control, meaning) {
  if (meanings.get(control)?.meaning !== meaning) meanings.set(control, { meaning, since: performance.now() });
}

function learnMeanings(frame) {
  means("proposal", frame.proposal);
  means("newest", JSON.stringify(frame.newest));
  means("paused", frame.paused);
  means("alarms", frame.alarms.join());
  // A drive behind another is the same to the hand: who orders several in a row is not held up.
  for (const { action, does } of frame.options) means(`choose ${action}`, does.replace(/ after command \d+$/, ""));
}

const send = (name, detail) => document.querySelector(".farside-hands")?.dispatchEvent(new CustomEvent(name, { detail }));

function press(what, fields = {}, control = null) {
  const since = control && meanings.get(control)?.since;
  send("press", since === null ? { what, ...fields } : { what, ...fields, shown_ms: performance.now() - (since ?? performance.now()) });
}

const answer = (what) => press(what, { number: seen.frame?.proposal ?? 0 }, "proposal");
const choose = (action, insist) => press("choose", { word: action, insist }, `choose ${action}`);
const pause = () => press(seen.frame?.paused ? "play" : "pause", {}, "paused");
const acknowledge = () => press("acknowledge", { alarms: seen.frame?.alarms ?? [] }, "alarms");
const takeBack = () => {
  const { number = 0, held = null } = seen.frame?.newest ?? {};
  if (held === null) press("take_back", { number }, "newest");
  else press("discard", { number: held }, "newest");
};

// A dialog takes a moment to open: what is typed meanwhile is meant for it, and for nothing else.
const OPENING_MS = 1500;
let opening = null;

function open(name) {
  opening = { key: null, until: performance.now() + OPENING_MS };
  send("opens", name);
  const look = () => {
    const dialog = opened();
    if (!dialog && performance.now() < opening.until) { requestAnimationFrame(look); return; }
    const { key } = opening;
    opening = null;
    if (dialog && key) chooseIn(dialog, key);
  };
  requestAnimationFrame(look);
}

const chooseIn = (dialog, key) => {
  const choice = dialog.querySelector(`[data-key="${CSS.escape(key)}"]`);
  choice?.click();
  return Boolean(choice);
};

function goalHere() {
  if (seen.hover) press("goal", { word: seen.hover.place });
  else open("goal");
}

const TURNS = { ArrowUp: "N", ArrowRight: "E", ArrowDown: "S", ArrowLeft: "W", w: "N", d: "E", s: "S", a: "W" };
const KEYS = {
  Enter: () => answer("approve"), Backspace: () => answer("veto"), Escape: takeBack, " ": pause,
  g: goalHere, m: () => open("mode"), h: () => send("opens", "view"), "?": () => open("help"),
  ",": () => press("slower"), ".": () => press("faster"), n: () => press("arrival"), c: () => press("contact"),
  x: acknowledge,
};

const isTyping = (node) => node.isContentEditable || ["INPUT", "TEXTAREA", "SELECT"].includes(node.tagName);
const opened = () => document.querySelector(".q-dialog");

function onKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || isTyping(event.target)) return;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const dialog = opened();
  if (dialog) {
    if (!event.repeat && chooseIn(dialog, key)) event.preventDefault();
    return;
  }
  if (opening) {
    event.preventDefault();
    if (!event.repeat) opening.key ??= key;
    return;
  }
  // A button in focus takes these keys for itself.
  if ((key === "Enter" || key === " ") && event.target.closest("button, [role=switch]")) return;
  const act = TURNS[key] ? () => choose(TURNS[key], event.shiftKey) : KEYS[key];
  if (!act) return;
  event.preventDefault();
  if (!event.repeat) act();
}

const actionAt = (node) => {
  const button = node.closest?.("[data-option], [data-shows]");
  return button ? button.dataset.option ?? (button.dataset.shows === "approve" ? seen.frame?.proposed || null : null) : null;
};

let looking = 0, looked = "";
function lookAt(place) {
  clearTimeout(looking);
  looking = setTimeout(() => {
    if (place !== looked) press("look", { word: looked = place });
  }, 300);
}

function hover(found) {
  if (found?.place === seen.hover?.place) return;
  seen.hover = found;
  lookAt(found?.place ?? "");
  drawSoon();
}

function onPointer(event) {
  const map = event.target.closest?.(".farside-map");
  hover(map && event.pointerType !== "touch" ? drawings.map?.pick(event) ?? null : null);
}

// With a mouse a click sets the goal that the pointer shows; a finger shows it by a first tap.
function onClick(event) {
  if (!event.target.closest?.(".farside-map")) return;
  const found = drawings.map?.pick(event) ?? null;
  const isShown = found && found.place === seen.hover?.place;
  if (isShown) press("goal", { word: found.place });
  else if (event.pointerType === "touch") hover(found);
}

function listen() {
  addEventListener("keydown", onKey);
  addEventListener("pointermove", onPointer);
  addEventListener("click", onClick);
  // A button that was clicked gives back the keys.
  addEventListener("pointerup", () => setTimeout(() => { if (!opened() && document.activeElement?.closest("button")) document.activeElement.blur(); }));
  for (const name of ["pointerover", "focusin"]) addEventListener(name, (event) => { const action = actionAt(event.target); if (action) showCue(action); });
  for (const name of ["pointerout", "focusout"]) addEventListener(name, (event) => { if (actionAt(event.target)) showCue(null); });
}
