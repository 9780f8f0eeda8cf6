// All English text of the page, and how numbers and times are written.
export const QUANTITIES = {
  backlash_deg: {
    name: "Play in the reducer", part: "reducer", unit: "°", digits: 1,
    what: "Play between motor and cam, at the motor shaft.",
    todo: {
      alert: "Note it; look at the reducer at the next planned stop.",
      alarm: "Plan the repair: order the reducer's wear parts and a slot.",
      danger: "Stop when the batch allows and repair: teeth now strike each other at every index.",
    },
  },
  crack: {
    name: "Cracked roller", part: "rollers", unit: "%", digits: 0, factor: 100,
    what: "Stiffness that the follower rollers have lost in one sense.",
    todo: {
      alert: "Look at the rollers through the inspection cover at the next stop.",
      alarm: "Plan to change the roller; keep its number.",
      danger: "Stop and change the roller: pieces of it may block the cam.",
    },
  },
  looseness: {
    name: "Loose base screws", part: "base", unit: "%", digits: 0, factor: 100,
    what: "How far the housing's screws are on the way from tight to fully loose.",
    todo: {
      alert: "Check the torque of the base screws at the next stop.",
      alarm: "Tighten the base screws soon and mark them.",
      danger: "Stop and tighten the base screws; check the dowels.",
    },
  },
  change: {
    name: "Unexplained change", part: null, unit: "", digits: 1,
    what: "How far turns are from what was taught and from what is usual here; 1 is as far as chance goes.",
    todo: {
      alert: "Listen to the machine and check the sensor's mounting.",
      alarm: "Something has changed that no known fault explains: inspect machine and sensor.",
      danger: "Inspect at once: the machine does not move as it did.",
    },
  },
};

// Faults of a twin; their units come with the limits.
const TWIN = {
  crack_single: ["One cracked roller", "rollers", "Stiffness that one follower roller has lost.",
    "Look at the rollers at the next stop.", "Plan to change the roller.", "Stop and change the roller."],
  reducer_play: ["Play in the reducer", "reducer", "Play between motor and cam, at the motor shaft.",
    "Look at the reducer at the next planned stop.", "Plan the repair of the reducer.", "Stop when the batch allows and repair the reducer."],
  follower_play: ["Play of the followers", "rollers", "Play between rollers and cam, at the table.",
    "Check the preload of the rollers at the next stop.", "Plan to set or change the rollers.", "Stop and set the rollers."],
  loose_base: ["Loose base screws", "base", "How far the housing's screws are on the way from tight to fully loose.",
    "Check the torque of the base screws.", "Tighten the base screws soon and mark them.", "Stop and tighten the base screws; check the dowels."],
  friction: ["Growing friction", "table", "Friction of the table beyond what it had when it was healthy.",
    "Check the lubrication of the table.", "Plan to inspect the table's bearing.", "Stop and inspect the table's bearing."],
  imbalance: ["Imbalance", "table", "Unequal load of the table's stations.",
    "Check the fixtures and parts on the table.", "Balance the table soon.", "Stop and balance the table."],
  mesh_wear: ["Worn mesh", "reducer", "How much the stiffness of the reducer's mesh varies.",
    "Look at the reducer's oil at the next stop.", "Plan the repair of the reducer.", "Stop when the batch allows and repair the reducer."],
  sensor_loose: ["Loose sensor", "sensor", "How far the sensor's mount has come loose.",
    "Check the sensor's mounting.", "Fasten the sensor.", "Fasten the sensor: what else is told cannot be relied on."],
  sensor_gain: ["Wrong gain", "sensor", "How far the sensor's gain is from what it was.",
    "Check the amplifier's range.", "Calibrate the sensor.", "Calibrate or change the sensor: what else is told cannot be relied on."],
};
for (const [name, [title, part, what, alert, alarm, danger]] of Object.entries(TWIN)) {
  QUANTITIES[name] = { name: title, part, unit: "", what, todo: { alert, alarm, danger } };
}

// The unit of a quantity and the factor to it, once the monitor has told the units of whoever diagnoses.
const units = {};
export const setUnits = (told) => Object.assign(units, told);
export function unitOf(name) {
  const q = QUANTITIES[name] ?? { unit: "", digits: 2 };
  if (units[name] == null) return { unit: q.unit, short: q.unit, factor: q.factor ?? 1, digits: q.digits ?? 2 };
  // "° at the motor shaft" is said once, where the quantity is explained; beside a number it is "°".
  return { unit: units[name], short: /^[°%]/.test(units[name]) ? units[name][0] : units[name], factor: 1, digits: null };
}

export const LEVELS = { normal: "Normal", alert: "Alert", alarm: "Alarm", danger: "Danger" };

export const EVENTS = {
  raised: "raised", lowered: "lowered", ended: "ended", again: "asks again", acknowledged: "acknowledged", repaired: "repaired",
  shelved: "shelved", unshelved: "no longer shelved", noted: "note",
};

export const T = {
  fleet: "All machines",
  allWell: (n) => n === 1 ? "The machine runs as usual." : `All ${n} machines run as usual.`,
  unsure: (n) => `No alarm, but it is not certain that ${n === 1 ? "the machine runs" : `all ${n} machines run`} as usual.`,
  wrong: (n) => n === 1 ? "One machine needs attention" : `${n} machines need attention`,
  none: "No machine has sent samples yet.",
  noneHelp: "The monitor listens. A machine appears here with its first block of samples; docs/tutorials/monitor.md shows how to send one.",
  live: "live", lost: "Connection lost; what you see may be old. Trying again …",
  since: (t) => `since ${t}`, at: (mode) => `at ${mode}`,
  percent: (p) => `${Math.min(99, Math.round(100 * p))} %`,
  sure: (p) => `the network is ${T.percent(p)} sure of it`,
  left: (r) => `Danger in about ${r} of running`,
  leftNone: "No time to danger can be told yet.",
  waiting: "The first turns are being taken in.",
  unacked: "not acknowledged", shelved: (t) => `shelved until ${t}`,
  problems: "Sensor and samples", faults: "Faults", log: "Alarm log", turns: "Turns", noLog: "No alarm yet.",
  acknowledge: "Acknowledge", shelve: "Shelve 8 h", unshelve: "End shelving", note: "Add note",
  repaired: "Repaired", repairedHelp: "Trend and remaining time begin anew with the next turn, and what is usual here is learnt again.",
  send: "Save", cancel: "Cancel", noteLabel: "Note (optional)", noteNeeded: "Note",
  trend: "Trend", noTrend: "No turn was diagnosed yet.", healthyTurn: "healthy turn", thisTurn: "this turn",
  record: "Acceleration over the turn", spectrum: "Amplitude by order (cycles a turn)",
  noRecord: "The samples of this turn are no longer kept, or cannot be read: see the log.", noReference: "No healthy turn of this speed was kept to compare with.",
  bands: "What spoke for the verdict", notDiagnosed: "Not diagnosed",
  signIn: "Sign in", token: "Token", signInHelp: "This monitor asks for a token. Whoever started it has set one.",
  failed: "The monitor's engine has stopped; see its log.", missing: "There is nothing here.", notFound: "Back to all machines",
  sizedAt: (t) => `as of ${t}`, asOf: (t) => `newest turn ${t}`, limits: "alert / alarm / danger", told: "network",
  inUnit: (unit) => `In ${unit}.`,
  physics: "What the physics says", noPhysics: "No answer yet; one comes with the next alarm and every few hours.",
  physicsOf: (turns, turn, t, took) => `of ${turns} turns up to turn ${turn}, ${t}, in ${Math.round(took)} s`,
  physicsBelow: (level, before) => `The model of the machine leaves ${level.toFixed(1)} times the noise, ${before.toFixed(1)} times without a fault.`,
  physicsFailed: "Physics gave no answer", before: "Older", after: "Newer",
};

const stamp = new Intl.DateTimeFormat("en-GB", {
  year: "numeric", month: "short", day: "2-digit", hour: "2-digit", minute: "2-digit", second: "2-digit", timeZoneName: "short",
});
export const time = (ns) => ns == null ? "–" : stamp.format(new Date(ns / 1e6));

export function span(seconds) {
  if (seconds == null) return "long";
  const steps = [[86400 * 365.25, "years"], [86400, "days"], [3600, "hours"], [60, "minutes"], [1, "seconds"]];
  for (const [size, name] of steps) if (seconds >= 2 * size) return `${Math.round(seconds / size)} ${name}`;
  return "moments";
}

export function remaining(r) {
  if (!r || r[0] == null) return null;
  return `${span(r[0])} (${r[1] == null ? "?" : span(r[1])} to ${r[2] == null ? "much longer" : span(r[2])})`;
}

// A size with its unit; of one with an interval of some `width`, down to the place that tells its ends apart.
export function size(name, value, width = 0) {
  const { short, factor, digits } = unitOf(name);
  if (value == null) return "–";
  const number = value * factor, place = width > 0 ? Math.ceil(-Math.log10(factor * width / 2)) : -Infinity;
  const text = digits != null ? number.toFixed(Math.min(20, Math.max(digits, place)))
    : String(Number(number.toPrecision(Math.min(20, Math.max(2, Math.floor(Math.log10(Math.abs(number) || 1)) + 1 + place)))));
  return `${text}${!short || short === "°" ? short : ` ${short}`}`;
}

export function interval(name, s) {
  if (!s) return "–";
  const width = s[2] - s[1];
  return s[1] === s[2] ? size(name, s[0]) : `${size(name, s[0], width)} (${size(name, s[1], width)} to ${size(name, s[2], width)})`;
}

export const quantity = (name) => QUANTITIES[name]?.name ?? name;
