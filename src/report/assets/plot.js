// SPDX-License-Identifier: Apache-2.0
// Plots by Chart.js, with error bars, and the same numbers as a table for those who do not see them.

const SERIES_COLOURS = 8;
const series_order = new Map();  // name of a series -> index of its colour, the same in all plots of the page

function series_index(name) {
  if (!series_order.has(name)) series_order.set(name, series_order.size % SERIES_COLOURS);
  return series_order.get(name);
}

const css_value = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const POINT_SHAPES = ["circle", "rect", "triangle", "rectRot", "crossRot", "star", "cross", "rectRounded"];

/** Chart.js plugin: a bar from `low` to `high` through every point that has them. */
const error_bars = {
  id: "error_bars",
  afterDatasetsDraw(chart) {
    const context = chart.ctx, { top, bottom } = chart.chartArea;
    chart.data.datasets.forEach((dataset, d) => {
      if (!chart.isDatasetVisible(d)) return;
      const points = chart.getDatasetMeta(d).data;
      context.save();
      context.strokeStyle = dataset.borderColor;
      context.lineWidth = 1.5;
      dataset.data.forEach((point, i) => {
        if (!Number.isFinite(point.low) || !Number.isFinite(point.high)) return;
        const to_y = (v) => {  // a bound of zero or less lies below every logarithmic axis
          const y = chart.scales.y.type === "logarithmic" && v <= 0 ? bottom : chart.scales.y.getPixelForValue(v);
          return clamp(y, top, bottom);
        };
        const x = points[i].x, low = to_y(point.low), high = to_y(point.high);
        context.beginPath();
        context.moveTo(x, low), context.lineTo(x, high);
        context.moveTo(x - 4, low), context.lineTo(x + 4, low), context.moveTo(x - 4, high),
        context.lineTo(x + 4, high);
        context.stroke();
      });
      context.restore();
    });
  },
};

function points_of(series) {
  return series.x.map((x, i) => ({ x, y: series.y[i], low: series.low?.[i] ?? NaN, high: series.high?.[i] ?? NaN }))
    .filter((p) => Number.isFinite(p.y));
}

/** Ticks of a logarithmic axis: the points' own positions where they are few, else powers of ten, with 2 and 5 times
 *  these where the axis spans few of them. */
function log_ticks({ min, max }, values) {
  const own = [...new Set(values)].sort((a, b) => a - b);
  if (own.length > 0 && own.length <= 6 && own.every((v, i) => i === 0 || v / own[i - 1] > 1.3)) return own;
  const steps = Math.log10(max / min) < 2 ? [1, 2, 5] : [1];
  const ticks = [];
  for (let power = Math.floor(Math.log10(min)); power <= Math.log10(max); power++)
    ticks.push(...steps.map((step) => Number(`${step}e${power}`)).filter((v) => v >= min && v <= max));
  return ticks;
}

function axis_of(axis, values, own_ticks) {
  const colours = { text: css_value("--text-soft"), grid: css_value("--line") };
  const common = { title: { display: Boolean(axis.label), text: axis.label, color: colours.text },
    grid: { color: colours.grid, drawBorder: false }, ticks: { color: colours.text, maxRotation: 0 } };
  if (axis.scale === "category") return { ...common, type: "category", grid: { display: false } };
  if (axis.scale !== "log")  // with all error bars
    return { ...common, type: "linear", beginAtZero: true, suggestedMin: Math.min(...values),
      suggestedMax: Math.max(...values) };
  const positive = values.filter((v) => v > 0);
  return { ...common, type: "logarithmic", min: Math.min(...positive) / 1.25, max: Math.max(...positive) * 1.25,
    afterBuildTicks(scale) { scale.ticks = log_ticks(scale, own_ticks ? positive : []).map((value) => ({ value })); },
    ticks: { ...common.ticks, autoSkip: false, callback: (value) => short_text(value, 3) } };
}

function dataset_of(series) {
  const index = series_index(series.name), colour = css_value(`--series-${index}`), style = series.style ?? "line";
  return {
    label: series.name, data: points_of(series), type: style === "bars" ? "bar" : "line", borderColor: colour,
    backgroundColor: style === "bars" ? colour + "99" : colour, borderWidth: style === "bars" ? 1 : 2,
    showLine: style !== "points",
    borderDash: style === "dashed" ? [6, 5] : [], pointStyle: POINT_SHAPES[index],
    pointRadius: style === "dashed" ? 0 : 4,
    pointHoverRadius: 6, maxBarThickness: 48,
  };
}

function chart_of(block, canvas) {
  const text = css_value("--text");
  const ys = block.series.flatMap((s) => points_of(s).flatMap((p) => [p.y, p.low, p.high])).filter(Number.isFinite);
  const xs = block.series.flatMap((s) => s.x);
  const categories = block.x.scale === "category" ? [...new Set(xs)] : undefined;
  const value_text = ({ y, low, high }) =>
    significant(y, 3) + (Number.isFinite(low) ? ` (${significant(low, 3)} … ${significant(high, 3)})` : "");
  return new Chart(canvas, {
    type: "line",
    data: { labels: categories, datasets: block.series.map(dataset_of) },
    plugins: [error_bars],
    options: {
      animation: false, maintainAspectRatio: false, font: { family: getComputedStyle(document.body).fontFamily },
      interaction: { mode: "nearest", intersect: false },
      scales: { x: axis_of(block.x, xs, true), y: axis_of(block.y, ys, false) },
      plugins: {
        legend: { labels: { color: text, usePointStyle: true, boxWidth: 10, boxHeight: 6, padding: 14 } },
        tooltip: { callbacks: {
          title: ([{ raw: { x } }]) => `${block.x.label ?? ""} ${typeof x === "number" ? significant(x, 4) : x}`.trim(),
          label: (item) => `${item.dataset.label}: ${value_text(item.raw)}` } },
      },
    },
  });
}

function plot_table(block) {
  const columns = [{ key: "series", title: "series", kind: "text" },
    { key: "x", title: block.x.label || "x", kind: block.x.scale === "category" ? "text" : "number", digits: 4 },
    { key: "y", title: block.y.label || "y", kind: "number" }];
  const rows = block.series.flatMap((s) =>
    points_of(s).map((p) => ({ series: s.name, x: p.x, y: { value: p.y, low: p.low, high: p.high } })));
  return el("details", {}, el("summary", {}, "Numbers"), draw_table({ caption: block.title, columns, rows }));
}

function draw_plot(block) {
  const canvas = el("canvas", { role: "img", "aria-label": block.alt ?? block.title });
  let chart = null;
  const draw = () => {
    chart?.destroy();
    chart = chart_of(block, canvas);
  };
  requestAnimationFrame(draw);  // when it has a size
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  return el("figure", { class: "plot" }, el("figcaption", {}, block.title), el("div", { class: "plot-area" }, canvas),
    plot_table(block));
}
