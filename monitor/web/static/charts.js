// Charts by uPlot: trend with interval and limits, record over the healthy one, spectrum.
import { h } from "./dom.js";
import { T, quantity, size, unitOf } from "./text.js";

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const axis = (more = {}) => ({
  stroke: css("--text"), grid: { stroke: css("--line"), width: 1 }, ticks: { stroke: css("--line") }, font: "13px system-ui", ...more,
});

function holder(key, label, draw) {
  const box = h("div.chart", { "data-keep": key, role: "img", "aria-label": label });
  // Drawn once the box is in the page and has a width.
  requestAnimationFrame(() => {
    if (!box.isConnected || !window.uPlot) return;
    const width = () => Math.max(240, box.clientWidth);
    const chart = draw(box, width());
    new ResizeObserver(() => chart.setSize({ width: width(), height: chart.height })).observe(box);
  });
  return box;
}

export function trend(name, data, limits, key) {
  const { unit, factor } = unitOf(name);
  const times = data.time, scaled = (values) => values.map((value) => value * factor);
  const flat = (limit) => times.map(() => limit * factor);
  const rows = [times, scaled(data.value), scaled(data.low), scaled(data.high), ...limits.map(flat)];
  const top = Math.max(...rows[3], limits[0] * factor * 1.15);
  const whole = `${quantity(name)}${unit ? ` [${unit}]` : ""}`, fits = whole.length <= 36;
  const label = `${T.trend}: ${quantity(name)}, last ${size(name, data.value.at(-1))}`;
  return holder(key, label, (box, width) => new uPlot({
    width, height: 300, cursor: { drag: { x: true, y: false } }, legend: { show: false },
    scales: { x: { time: true }, y: { range: [0, top * 1.05] } },
    axes: [axis(), axis({ label: fits ? whole : unit, size: 56 })],
    series: [
      {}, { stroke: css("--accent"), width: 2.5 },
      { stroke: "transparent", points: { show: false } }, { stroke: "transparent", points: { show: false } },
      ...["--alert", "--alarm", "--danger"].map((color) => ({ stroke: css(color), width: 1.5, dash: [7, 4], points: { show: false } })),
    ],
    bands: [{ series: [3, 2], fill: css("--band") }],
  }, rows, box));
}

export function record(turn, key) {
  const mine = turn.record, reference = turn.reference?.record;
  const x = mine.values.map((_, k) => k * mine.step_s);
  const rows = [x, ...(reference ? [reference.values] : []), mine.values];
  const series = [{}, ...(reference ? [{ stroke: css("--healthy"), width: 1.2 }] : []), { stroke: css("--accent"), width: 1.2 }];
  return holder(key, T.record, (box, width) => new uPlot({
    width, height: 280, legend: { show: false }, scales: { x: { time: false } },
    axes: [axis({ label: "s" }), axis({ label: turn.unit.replace("^2", "²"), size: 56 })], series,
  }, rows, box));
}

export function spectrum(turn, key) {
  const mine = turn.spectrum, reference = turn.reference?.spectrum;
  const rows = [mine.order, ...(reference ? [reference.amplitude] : []), mine.amplitude];
  const series = [{}, ...(reference ? [{ stroke: css("--healthy"), width: 1.2 }] : []), { stroke: css("--accent"), width: 1.2 }];
  return holder(key, T.spectrum, (box, width) => new uPlot({
    width, height: 260, legend: { show: false }, scales: { x: { time: false }, y: { distr: 3 } },
    axes: [axis({ label: "order" }), axis({ label: turn.unit.replace("^2", "²"), size: 64 })], series,
  }, rows, box));
}
