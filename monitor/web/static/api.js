// The interface of the monitor, and the stream of changes.
export class Refused extends Error {
  constructor(status, message) { super(message); this.status = status; }
}

async function answer(response) {
  const body = await response.json().catch(() => ({}));
  if (!response.ok) throw new Refused(response.status, body.error ?? response.statusText);
  return body;
}

export const get = async (path) => answer(await fetch(path, { headers: { accept: "application/json" } }));

export const post = async (path, body) => answer(await fetch(path, {
  method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body),
}));

const at = (machine) => `/api/machines/${encodeURIComponent(machine)}`;
export const fleet = () => get("/api/fleet");
export const trends = (machine) => get(`${at(machine)}/trends`);
export const turns = (machine, before) => get(`${at(machine)}/turns?count=25${before ? `&before=${before}` : ""}`);
export const physics = (machine) => get(`${at(machine)}/physics`);
export const turn = (machine, number) => get(`${at(machine)}/turns/${number}`);
export const events = (machine) => get(`/api/events?count=60${machine ? `&machine=${encodeURIComponent(machine)}` : ""}`);
export const act = (machine, quantity, body) => post(`${at(machine)}/alarms/${encodeURIComponent(quantity)}`, body);
export const signIn = (token) => post("/api/sign-in", { token });

// EventSource connects again by itself; after that everything is loaded anew.
export function listen({ machine, opened, lost }) {
  const stream = new EventSource("/events");
  stream.addEventListener("hello", opened);
  stream.addEventListener("again", opened);
  stream.addEventListener("machine", (event) => machine(JSON.parse(event.data)));
  stream.onerror = () => {
    lost();
    // A refusal ends the stream for good; where the sign-in has ended, `opened` asks for it.
    if (stream.readyState === EventSource.CLOSED) {
      setTimeout(() => opened().then(() => listen({ machine, opened, lost })), 3000);
    }
  };
}
