// Loads, listens, and shows the view that the address names: #/, #/m/NAME, #/m/NAME/f/QUANTITY, #/m/NAME/t/NUMBER.
import * as api from "./api.js";
import { h, morph } from "./dom.js";
import { T, quantity, setUnits } from "./text.js";
import * as views from "./views.js";

const state = { fleet: new Map(), limits: {}, words: {}, person: { operator: false }, troubles: [], connected: false };
const content = document.getElementById("content"), path = document.getElementById("path"), status = document.getElementById("link");
const dialog = document.getElementById("dialog");
let shown = "", drawing = false, refreshed = 0, later = 0, listening = false;

const route = () => location.hash.replace(/^#\/?/, "").split("/").filter(Boolean).map(decodeURIComponent);

async function load() {
  const fleet = await api.fleet();
  Object.assign(state, { limits: fleet.limits, words: fleet.states, person: fleet.person, failed: fleet.engine.failed, troubles: fleet.troubles });
  setUnits(fleet.units);
  state.physical = fleet.physics;
  state.fleet = new Map(fleet.machines.map((one) => [one.machine, one]));
}

// What a view needs beyond the fleet; what comes once another is shown is dropped.
async function details() {
  const [, name, kind, item] = route(), here = location.hash;
  const keep = (found) => { if (location.hash === here) Object.assign(state, found); };
  if (!name) return;
  if (kind === "t") return keep({ turn: await api.turn(name, Number(item)).catch(() => null) });
  const [events, trends, turns, physics] = await Promise.all([
    api.events(name), kind === "f" ? api.trends(name) : null, kind === "f" ? api.turns(name) : null,
    state.physical ? api.physics(name) : null]);
  keep({ events: events.events, answers: physics?.answers, ...(trends ? { trends, turns: turns.turns } : {}) });
}

function draw() {
  drawing = false;
  const [, name, kind, item] = route(), here = location.hash;
  const parts = !name ? views.fleet(state) : kind === "f" ? views.fault(state, name, item, ask)
    : kind === "t" ? views.turn(state, name, Number(item)) : views.machine(state, name, ask);
  const fresh = h("main", { id: "content", tabindex: "-1" }, parts);
  if (here === shown) morph(content, fresh);
  else { content.replaceChildren(...fresh.childNodes); if (shown) content.focus(); shown = here; scrollTo(0, 0); }
  const trail = [h("a", { href: "#/" }, T.fleet)];
  if (name) trail.push(" › ", h("a", { href: `#/m/${encodeURIComponent(name)}` }, name));
  if (kind) trail.push(" › ", kind === "f" ? quantity(item) : `Turn ${item}`);
  path.replaceChildren(...trail);
  document.title = name ?? (([...state.fleet.values()].some((one) => views.rank(one) > 0) ? "(!) " : "") + "Machines");
  status.textContent = state.failed ? T.failed : state.connected ? T.live : T.lost;
  status.className = state.connected && !state.failed ? "ok" : "bad";
}

function soon() {
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(draw);
}

function turned() {
  Object.assign(state, { events: undefined, answers: undefined, trends: undefined, turns: undefined, turn: undefined });
  return go();
}

async function go() {
  try { await details(); } catch (error) { if (error.status === 401) return signIn(); }
  soon();
}

async function again() {
  try { await load(); state.connected = true; } catch (error) {
    state.connected = false;
    if (error.status === 401) return signIn();
  }
  await go();
}

function changed(machine) {
  const before = state.fleet.get(machine.machine);
  state.fleet.set(machine.machine, machine);
  soon();
  const [, name, kind] = route();
  if (name !== machine.machine || kind === "t") return;
  // Tables and curves follow at most once a second, the last change too.
  const wait = before?.level !== machine.level ? 0 : Math.max(0, refreshed + 1000 - performance.now());
  clearTimeout(later);
  later = setTimeout(() => { refreshed = performance.now(); go(); }, wait);
}

function ask(name, key, action) {
  if (action === "unshelve") return doIt(name, key, { action });
  const note = h("textarea", { id: "note", rows: 3, maxlength: 500 });
  const error = h("p.error", { role: "alert" });
  const form = h("form", { method: "dialog", onsubmit: async (event) => {
    event.preventDefault();
    const body = { action, note: note.value, ...(action === "shelve" ? { hours: 8 } : {}) };
    try { await doIt(name, key, body); dialog.close(); } catch (refused) { error.textContent = refused.message; }
  } },
    h("h2", { id: "dialog-title" }, `${T[action] ?? T.note}: ${quantity(key)}, ${name}`),
    action === "repaired" && h("p", {}, T.repairedHelp),
    h("label", { for: "note" }, action === "note" ? T.noteNeeded : T.noteLabel), note, error,
    h("p.actions", {}, h("button.primary", { type: "submit" }, T.send),
      h("button", { type: "button", onclick: () => dialog.close() }, T.cancel)));
  dialog.replaceChildren(form);
  dialog.showModal();
}

async function doIt(name, key, body) {
  await api.act(name, key, body);
  await again();
}

function signIn() {
  if (dialog.open) return;
  const token = h("input", { id: "token", type: "password", autocomplete: "current-password" }), error = h("p.error", { role: "alert" });
  dialog.replaceChildren(h("form", { method: "dialog", onsubmit: async (event) => {
    event.preventDefault();
    try { await api.signIn(token.value); dialog.close(); await again(); connect(); } catch (refused) { error.textContent = refused.message; }
  } }, h("h2", { id: "dialog-title" }, T.signIn), h("p", {}, T.signInHelp),
  h("label", { for: "token" }, T.token), token, error, h("p.actions", {}, h("button.primary", { type: "submit" }, T.signIn))));
  dialog.showModal();
}

function connect() {
  if (listening) return;
  listening = true;
  api.listen({ machine: changed, opened: again, lost: () => { state.connected = false; soon(); } });
}

addEventListener("hashchange", turned);
document.getElementById("foot").textContent = `Times in ${Intl.DateTimeFormat().resolvedOptions().timeZone}`;
again().then(() => { if (!dialog.open) connect(); });
