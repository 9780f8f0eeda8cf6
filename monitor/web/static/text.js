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

export const LEVELS = { normal: "Normal", alert: "Alert", alarm: "Alarm", danger: "Danger" };

export const EVENTS = {
  raised: "raised", lowered: "lowered", ended: "ended", again: "asks again", acknowledged: "acknowledged",
  shelved: "shelved", unshelved: "no longer shelved", noted: "note",
};

export const T = {
  fleet: "All machines",
  allWell: (n) => n === 1 ? "The machine runs as usual." : `All ${n} machines run as usual.`,
  wrong: (n) => n === 1 ? "One machine needs attention" : `${n} machines need attention`,
  none: "No machine has sent samples yet.",
  noneHelp: "The monitor listens. A machine appears here with its first block of samples; docs/tutorials/monitor.md shows how to send one.",
  live: "live", lost: "Connection lost; what you see may be old. Trying again …",
  since: (t) => `since ${t}`,
  sure: (p) => p == null ? "" : `the network is ${Math.round(100 * p)} % sure of it`,
  left: (r) => `Danger in about ${r}`,
  leftNone: "No time to danger can be told yet.",
  waiting: "The first turns are being taken in.",
  unacked: "not acknowledged", shelved: (t) => `shelved until ${t}`,
  problems: "Sensor and samples", faults: "Faults", log: "Alarm log", turns: "Turns", noLog: "No alarm yet.",
  acknowledge: "Acknowledge", shelve: "Shelve 8 h", unshelve: "End shelving", note: "Add note",
  send: "Save", cancel: "Cancel", noteLabel: "Note (optional)", noteNeeded: "Note",
  trend: "Trend", noTrend: "No turn was diagnosed yet.", mode: "Speed", newest: "Newest turn", healthyTurn: "healthy turn", thisTurn: "this turn",
  record: "Acceleration over the turn", spectrum: "Amplitude by order (cycles a turn)",
  noRecord: "The samples of this turn are no longer kept.", noReference: "No healthy turn of this speed was kept to compare with.",
  bands: "What spoke for the verdict", notDiagnosed: "Not diagnosed",
  signIn: "Sign in", token: "Token", signInHelp: "This monitor asks for a token. Whoever started it has set one.",
  failed: "The monitor's engine has stopped; see its log.", missing: "There is nothing here.", notFound: "Back to all machines",
  asOf: (t) => `newest turn ${t}`, limits: "alert / alarm / danger", told: "network",
  explain: "The physics of this fault", before: "Older", after: "Newer",
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

export function size(name, value) {
  const q = QUANTITIES[name] ?? { unit: "", digits: 2 };
  return value == null ? "–" : `${(value * (q.factor ?? 1)).toFixed(q.digits)}${q.unit === "%" ? " %" : q.unit}`;
}

export function interval(name, s) {
  if (!s) return "–";
  return s[1] === s[2] ? size(name, s[0]) : `${size(name, s[0])} (${size(name, s[1])} to ${size(name, s[2])})`;
}

export const quantity = (name) => QUANTITIES[name]?.name ?? name;
