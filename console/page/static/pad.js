// A gamepad, read as `farside.console.stick.intention` reads a stick, by the table that it has. What
// is felt follows from the options that the page holds already: it waits for no link.

const FAVOUR = 0.1, LASTS_MS = 1000, RENEW_MS = 500;
const START = { buttons: [], back: false, held: null, told: "", meaning: null, changed: 0, proposed: "", proposedAt: 0,
  approached: null, felt: null, level: 0, levelAt: 0 };
const stick = { ...START };

const between = (value, least, most) => Math.min(Math.max(value, least), most);
const towards = (x, y, action) => {
  const [east, north] = table.directions[action] ?? [0, 0];
  return between(x * east + y * north, 0, 1);
};
const nearness = (far) => {
  const { dead_zone: zone, choose_at: full } = table.thresholds;
  return between((far - zone) / (full - zone), 0, 1);
};
const options = () => seen.frame?.options ?? [];

function strengthOf(felt) {
  const { least, rises, rumble } = table.forms[felt.kind];
  return { ...rumble, strength: rumble.strength * (least + (1 - least) * (felt.severity ?? 0)) * (rises ? felt.near : 1) };
}

// Whether the options mean something else than before.
function notice(now) {
  const proposed = options().filter(({ kind }) => kind === "proposed").map(({ action }) => action).join();
  const meaning = JSON.stringify([seen.frame?.proposal, options().map(({ action, kind }) => [action, kind])]);
  if (meaning === stick.meaning) return false;
  const marked = `${seen.frame?.proposal} ${proposed}`;
  if (marked !== stick.proposed) [stick.proposed, stick.proposedAt] = [marked, now];
  [stick.meaning, stick.changed, stick.held] = [meaning, now, null];
  return true;
}

function nearest(x, y) {
  const favoured = ({ action }) => { const near = nearness(towards(x, y, action)); return near && near + (action === stick.approached ? FAVOUR : 0); };
  const found = options().reduce((best, option) => (favoured(option) > (best ? favoured(best) : 0) ? option : best), null);
  return found;
}

function feltAt(now, x, y, option) {
  if (option && option.kind !== "free") {
    const before = stick.felt, same = before?.near > 0 && before.action === option.action && before.kind === option.kind;
    return { ...option, near: nearness(towards(x, y, option.action)), since: same ? before.since : now };
  }
  const proposed = options().find(({ kind }) => kind === "proposed");
  return proposed ? { ...proposed, near: 0, since: stick.proposedAt } : null;
}

function rumble(pad, now) {
  let level = 0;
  if (stick.felt) {
    const { strength, pulses, pulse_ms: pulse, pause_ms: pause } = strengthOf(stick.felt), played = now - stick.felt.since;
    const on = !pulses || (Math.floor(played / (pulse + pause)) < pulses && played % (pulse + pause) < pulse);
    level = on ? Math.round(strength * 100) / 100 : 0;
  }
  if (level === stick.level && !(level > 0 && now - stick.levelAt >= RENEW_MS)) return;
  [stick.level, stick.levelAt] = [level, now];
  pad.vibrationActuator?.playEffect?.("dual-rumble", { duration: LASTS_MS, strongMagnitude: level, weakMagnitude: level });
}

function holds(now, action, seconds) {
  if (stick.held?.action !== action) stick.held = { action, since: now };
  return now - stick.held.since >= seconds * 1000;
}

// What a stick that stands out orders.
function decide(now, x, y) {
  const limits = table.thresholds, aside = Math.min(Math.abs(x), Math.abs(y));
  const option = options().find(({ action }) => { const far = towards(x, y, action); return far >= limits.choose_at && aside <= limits.aside * far; });
  if (!option || !stick.back) { stick.held = null; return; }
  const { action, kind } = option;
  if (now - stick.changed < limits.quiet_s * 1000) { stick.back = false; choose(action, false); return; }
  if (kind === "invalid") {
    if (stick.told !== action) { stick.told = action; choose(action, false); }
    if (towards(x, y, action) < limits.full_at || !holds(now, action, limits.insist_s)) return;
    choose(action, true);
  } else if (kind === "proposed" && seen.frame.proposal) {
    if (!holds(now, action, limits.approve_s)) return;
    answer("approve");
  } else choose(action, false);
  stick.back = false;
}

function readPad(pad, now) {
  const x = pad.axes[0] ?? 0, y = -(pad.axes[1] ?? 0), changed = notice(now), option = nearest(x, y);
  const near = option ? nearness(towards(x, y, option.action)) : 0;
  if (option || stick.approached) showCue(option?.action ?? null, near);
  stick.approached = option?.action ?? null;
  stick.felt = feltAt(now, x, y, option);
  rumble(pad, now);
  if (Math.max(Math.abs(x), Math.abs(y)) < table.thresholds.back_below) {
    Object.assign(stick, { back: true, held: null, told: "" });
  } else {
    if (changed) stick.back = false;
    if (!opened()) decide(now, x, y);
  }
  for (const [number, act] of [[0, () => answer("approve")], [1, () => answer("veto")], [9, () => send("opens", "seat")]]) {
    const down = Boolean(pad.buttons[number]?.pressed);
    if (down && stick.buttons[number] === false && !opened()) act();
    stick.buttons[number] = down;
  }
}

const plugged = () => [...navigator.getGamepads?.() ?? []].find((pad) => pad?.connected);

function poll() {
  const pad = table && plugged();
  if (!pad) {
    Object.assign(stick, { ...START, buttons: [] });
    setTimeout(poll, 250);
    return;
  }
  readPad(pad, performance.now());
  requestAnimationFrame(poll);
}
