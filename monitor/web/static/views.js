// What each view shows, as elements, from plain values.
import { h } from "./dom.js";
import { picture } from "./picture.js";
import * as charts from "./charts.js";
import { EVENTS, LEVELS, QUANTITIES, T, interval, quantity, remaining, size, time, unitOf } from "./text.js";

const RANK = { normal: 0, alert: 1, alarm: 2, danger: 3 };
// States in which nobody sees how a machine runs.
const URGENT = ["stale", "dead", "clipped", "swapped", "overload", "other_speed", "no_indexing", "no_pulse", "not_comparable", "broken_payload"];
const link = (...parts) => `#/${parts.map(encodeURIComponent).join("/")}`;

export const badge = (level) => h(`span.badge.${level}`, {}, LEVELS[level]);

const levelOf = (machine, name) => machine.alarms[name]?.level_name ?? "normal";
const blind = (machine) => Boolean(machine.last.problem) || machine.active_states.some((one) => URGENT.includes(one));
export const rank = (machine) => RANK[machine.level] + (blind(machine) ? 0.5 : 0);
// Seen to run as usual: nothing else is said to.
const usual = (machine) => rank(machine) === 0 && machine.last.healthy === true;
// Of a turn that was not diagnosed the time stands by itself; sizes are older then.
const newest = (machine) => machine.last.problem ? machine.last.problem_ns ?? machine.last.time_ns : machine.last.time_ns;
const verdict = (last) => last.problem ? `${T.notDiagnosed}: ${last.problem}` : last.verdict ?? T.waiting;

function told(machine, name) {
  const last = machine.last, alarm = machine.alarms[name], level = levelOf(machine, name), mode = last.size_mode?.[name];
  const left = remaining(last.remaining?.[name]), sized = last.modes?.[mode]?.time_ns ?? last.time_ns;
  return h("ul.facts", {},
    h("li", {}, h("b", {}, interval(name, last.sizes?.[name])), Object.keys(last.modes ?? {}).length > 1 && mode ? ` ${T.at(mode)}` : "",
      last.sizes?.[name] && (last.problem || (mode && mode !== last.mode)) ? ` ${T.sizedAt(time(sized))}` : "", alarm?.since_ns ? ` ${T.since(time(alarm.since_ns))}` : ""),
    level !== "danger" && !last.problem && (left ? h("li", {}, T.left(left)) : level !== "normal" && name !== "change" && h("li", {}, T.leftNone)),
    level !== "normal" && h("li", {}, QUANTITIES[name]?.todo[level]),
    alarm && !alarm.acknowledged && h("li.open", {}, T.unacked),
    alarm?.shelved && h("li", {}, T.shelved(time(alarm.shelved_until_ns))));
}

function sensorLine(machine, words) {
  const active = machine.active_states;
  return active.length ? h("p.state", {}, active.map((name) => machine.states[name]?.text || words[name]).join("; ")) : null;
}

export function fleet(state) {
  const machines = [...state.fleet.values()].sort((a, b) => rank(b) - rank(a) || a.machine.localeCompare(b.machine));
  const troubles = state.troubles.map((trouble) => h("p.state", {}, trouble));
  if (!machines.length) return [h("h1", {}, T.none), troubles, h("p.quiet", {}, T.noneHelp)];
  const wrong = machines.filter((one) => rank(one) > 0);
  return [
    h("h1", {}, wrong.length ? T.wrong(wrong.length)
      : !state.troubles.length && machines.every(usual) ? T.allWell(machines.length) : T.unsure(machines.length)), troubles,
    h("ul.cards", {}, machines.map((machine) => {
      const worst = machine.worst;
      return h(`li.card.${machine.level}`, {},
        h("h2", {}, h("a", { href: link("m", machine.machine) }, machine.machine), " ", badge(machine.level)),
        worst ? [h("p.what", {}, h("a", { href: link("m", machine.machine, "f", worst) }, quantity(worst))), told(machine, worst)]
          : h("p", {}, verdict(machine.last)),
        sensorLine(machine, state.words),
        h("p.quiet", {}, T.asOf(time(newest(machine)))));
    })),
  ];
}

function gauge(name, sizes, limits) {
  const [value, low, high] = sizes, top = limits[2] * 1.25, at = (x) => `${Math.min(100, Math.max(0, (100 * x) / top)).toFixed(1)}`;
  const svg = (tag, attributes) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [key, v] of Object.entries(attributes)) element.setAttribute(key, v);
    return element;
  };
  const box = svg("svg", { viewBox: "0 0 100 8", preserveAspectRatio: "none", class: "gauge", "aria-hidden": "true" });
  box.append(svg("rect", { x: 0, y: 3, width: 100, height: 2, class: "rail" }));
  limits.forEach((limit, k) => box.append(svg("rect", { x: at(limit), y: 1, width: 0.7, height: 6, class: ["alert", "alarm", "danger"][k] })));
  box.append(svg("rect", { x: at(low), y: 2, width: Math.max(0.6, at(high) - at(low)), height: 4, class: "reach" }));
  box.append(svg("rect", { x: at(value) - 0.5, y: 0.5, width: 1.2, height: 7, class: "value" }));
  return box;
}

function actions(state, machine, name, ask) {
  if (!state.person.operator) return null;
  const alarm = machine.alarms[name];
  const button = (text, action) => h("button", { type: "button", onclick: () => ask(machine.machine, name, action) }, text);
  return h("div.actions", {},
    alarm && !alarm.acknowledged && button(T.acknowledge, "acknowledge"),
    alarm?.shelved ? button(T.unshelve, "unshelve") : alarm && button(T.shelve, "shelve"),
    button(T.repaired, "repaired"), button(T.note, "note"));
}

function log(events) {
  if (!events?.length) return h("p.quiet", {}, T.noLog);
  return h("div.scroll", { tabindex: "0", role: "region", "aria-label": T.log }, h("table", {},
    h("thead", {}, h("tr", {}, ["Time", "Alarm", "What", "Level", "Size", "Who, note"].map((text) => h("th", { scope: "col" }, text)))),
    h("tbody", {}, events.map((one) => h("tr", {},
      h("td", {}, h("a", { href: link("m", one.machine, "t", one.turn) }, time(one.time_ns))),
      h("td", {}, quantity(one.quantity)), h("td", {}, EVENTS[one.kind] ?? one.kind), h("td", {}, badge(one.level)),
      h("td", {}, one.value == null ? "" : interval(one.quantity, [one.value, one.low, one.high])),
      h("td", {}, [one.user, one.note].filter(Boolean).join(": ")))))));
}

export function machine(state, name, ask) {
  const one = state.fleet.get(name);
  if (!one) return missing();
  const levels = Object.fromEntries(Object.keys(state.limits).map((key) => [key, levelOf(one, key)]));
  const names = Object.keys(state.limits).filter((key) => one.last.sizes?.[key] || one.alarms[key])
    .sort((a, b) => RANK[levelOf(one, b)] - RANK[levelOf(one, a)]);
  const noted = Object.entries(one.states).sort((a, b) => b[1].active - a[1].active || b[1].last_ns - a[1].last_ns);
  return [
    h("h1", {}, name, " ", badge(one.level)),
    h("p", {}, verdict(one.last),
      !one.last.problem && one.last.probability != null ? ` (${T.sure(one.last.probability)}). ` : ". ",
      h("span.quiet", {}, `${T.asOf(time(newest(one)))}, ${(one.last.problem && one.last.problem_mode) || one.last.mode || ""}`)),
    sensorLine(one, state.words),
    h("div.two", {}, h("div", { "data-keep": JSON.stringify(levels) }, picture(levels)),
      h("section", { "aria-label": T.faults }, h("h2", {}, T.faults), names.map((key) =>
        h(`div.fault.${levelOf(one, key)}`, {},
          h("h3", {}, h("a", { href: link("m", name, "f", key) }, quantity(key)), " ", badge(levelOf(one, key))),
          one.last.sizes?.[key] && gauge(key, one.last.sizes[key], state.limits[key]),
          told(one, key), levelOf(one, key) !== "normal" || one.alarms[key] ? actions(state, one, key, ask) : null)))),
    state.physical && physics(state.answers),
    h("section", {}, h("h2", {}, T.log), log(state.events)),
    noted.length ? h("section", {}, h("h2", {}, T.problems), h("ul.plain", {}, noted.map(([key, value]) =>
      h("li", {}, h(value.active ? "b" : "span.quiet", {}, value.text || state.words[key]),
        h("span.quiet", {}, ` ${value.count} ×, ${time(value.last_ns)}`))))) : null,
  ];
}

function physics(answers) {
  const one = answers?.[0];
  const told = !one ? [h("p.quiet", {}, T.noPhysics)] : [
    h("p.what", {}, one.problem ? `${T.physicsFailed}: ${one.problem}` : one.headline),
    one.remarks?.length ? h("ul.plain", {}, one.remarks.map((remark) => h("li", {}, remark))) : null,
    one.level != null && h("p", {}, T.physicsBelow(one.level, one.before)),
    h("p.quiet", {}, T.physicsOf(one.turns, one.turn, time(one.time_ns), one.took_s))];
  return h("section.physics", { "aria-label": T.physics }, h("h2", {}, T.physics), told);
}

export function fault(state, name, key, ask) {
  const one = state.fleet.get(name), modes = state.trends?.modes ?? {}, q = QUANTITIES[key];
  if (!one || !state.limits[key]) return missing();
  const mine = Object.entries(modes).filter(([, by]) => by[key]?.time.length);
  return [
    h("h1", {}, `${quantity(key)}, ${name}`, " ", badge(levelOf(one, key))),
    h("p", {}, q?.what, unitOf(key).unit !== unitOf(key).short && ` ${T.inUnit(unitOf(key).unit)}`), told(one, key), actions(state, one, key, ask),
    h("p.quiet", {}, `${T.limits}: ${state.limits[key].map((limit) => size(key, limit)).join(" / ")}`),
    state.physical && physics(state.answers),
    mine.length ? mine.map(([mode, by]) => [h("h2", {}, `${T.trend}, ${mode}`),
      charts.trend(key, by[key], state.limits[key], `${name} ${mode} ${key} ${by[key].time.at(-1)}`)]) : h("p.quiet", {}, T.noTrend),
    h("h2", {}, T.turns), turnTable(state, name, key),
    h("h2", {}, T.log), log(state.events?.filter((event) => event.quantity === key)),
  ];
}

function turnTable(state, name, key) {
  return h("div.scroll", { tabindex: "0", role: "region", "aria-label": T.turns }, h("table", {},
    h("thead", {}, h("tr", {}, ["Turn", "Time", quantity(key), "Verdict"].map((text) => h("th", { scope: "col" }, text)))),
    h("tbody", {}, (state.turns ?? []).map((turn) => h("tr", {},
      h("td", {}, h("a", { href: link("m", name, "t", turn.number) }, String(turn.number))), h("td", {}, time(turn.start_ns)),
      h("td", {}, interval(key, turn.sizes?.[key])), h("td", {}, turn.problem || turn.verdict))))));
}

export function turn(state, name, number) {
  const one = state.turn;
  if (one === undefined) return [h("h1", {}, `Turn ${number}, ${name}`)];
  if (!one) return missing();
  const key = `${name} ${number}`;
  const legend = h("p.legend", {}, h("span.mine", {}, T.thisTurn), one.reference ? h("span.healthy", {}, `${T.healthyTurn} ${one.reference.number}`) : T.noReference);
  return [
    h("h1", {}, `Turn ${number}, ${name}`),
    h("p", {}, one.problem ? `${T.notDiagnosed}: ${one.problem}.` : h("b", {}, one.verdict),
      one.probability != null ? ` (${T.told}: ${T.percent(one.probability)})` : "", ` ${time(one.start_ns)}, ${one.mode}`),
    h("p.actions", {}, number > 1 && h("a.button", { href: link("m", name, "t", number - 1) }, T.before),
      h("a.button", { href: link("m", name, "t", number + 1) }, T.after)),
    one.sizes && h("ul.facts", {}, Object.entries(one.sizes).map(([k, v]) => h("li", {}, `${quantity(k)}: `, h("b", {}, interval(k, v))))),
    one.record ? [h("h2", {}, T.record), legend, charts.record(one, `r ${key}`), h("h2", {}, T.spectrum), charts.spectrum(one, `s ${key}`)]
      : h("p.quiet", {}, T.noRecord),
    one.more?.bands && [h("h2", {}, T.bands), h("ul.facts", {}, one.more.bands.map(([low, high, share]) =>
      h("li", {}, `${low.toFixed(0)} to ${high.toFixed(0)} Hz: ${share >= 0 ? "+" : ""}${share.toFixed(2)}`)))],
  ];
}

export const missing = () => [h("h1", {}, T.missing), h("p", {}, h("a", { href: "#/" }, T.notFound))];
