// The machine as a drawing, with its parts marked by the level of their alarm.
import { s } from "./dom.js";
import { LEVELS, QUANTITIES } from "./text.js";

export function picture(levels) {
  const ranks = Object.keys(LEVELS);
  // A part is marked by the worst of what is watched on it, and plain where nothing is.
  const mark = (part) => {
    const mine = Object.keys(levels).filter((name) => QUANTITIES[name]?.part === part).map((name) => ranks.indexOf(levels[name]));
    return mine.length ? `part ${ranks[Math.max(...mine)]}` : "";
  };
  const told = Object.entries(levels).filter(([name, level]) => level !== "normal" && QUANTITIES[name]?.part)
    .map(([name, level]) => `${QUANTITIES[name].part}: ${LEVELS[level]}`).join(", ");
  const rollers = [...Array(8).keys()].map((k) => {
    const a = (k * Math.PI) / 4;
    return s("circle", { cx: 190 + 34 * Math.cos(a), cy: 96 + 9 * Math.sin(a), r: 5, class: `housing ${mark("rollers")}` });
  });
  return s("svg", { viewBox: "0 0 340 190", role: "img", class: "machine",
    "aria-label": `Drawing of the machine. ${told || "All parts normal"}` },
    s("rect", { x: 96, y: 70, width: 190, height: 86, rx: 6, class: "housing" }),
    s("rect", { x: 86, y: 156, width: 210, height: 9, rx: 2, class: `housing ${mark("base")}` }),
    ...[104, 150, 230, 276].map((x) => s("path", { d: `M${x} 150v22M${x - 6} 150h12`, class: `screw ${mark("base")}` })),
    s("ellipse", { cx: 190, cy: 44, rx: 104, ry: 17, class: `table ${mark("table")}` }),
    ...[...Array(8).keys()].map((k) => {
      const a = (k * Math.PI) / 4 + 0.2;
      return s("circle", { cx: 190 + 84 * Math.cos(a), cy: 44 + 11 * Math.sin(a), r: 4, class: "station" });
    }),
    s("rect", { x: 216, y: 27, width: 16, height: 12, rx: 2, class: `housing ${mark("sensor")}` }),
    s("rect", { x: 180, y: 58, width: 20, height: 34, class: "housing" }),
    s("ellipse", { cx: 190, cy: 96, rx: 42, ry: 13, class: "housing" }),
    ...rollers,
    s("path", { d: "M112 118h150v24H112z M124 118l14 24 M150 118l14 24 M176 118l14 24 M202 118l14 24 M228 118l14 24", class: "cam" }),
    s("rect", { x: 62, y: 110, width: 42, height: 40, rx: 4, class: `housing ${mark("reducer")}` }),
    s("path", { d: "M71 130a12 12 0 1 0 24 0a12 12 0 1 0 -24 0 M83 118v24 M71 130h24", class: "gear" }),
    s("rect", { x: 8, y: 114, width: 50, height: 32, rx: 5, class: "motor" }),
    s("path", { d: "M58 130h5", class: "gear" }),
    ...[["motor", 33, 162], ["reducer", 83, 106], ["rollers", 252, 99], ["cam", 274, 134], ["table", 150, 22], ["sensor", 224, 22], ["base", 312, 164]]
      .map(([text, x, y]) => { const label = s("text", { x, y, class: "label" }); label.textContent = text; return label; }),
  );
}
