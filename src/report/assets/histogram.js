// SPDX-License-Identifier: Apache-2.0
// Histograms of what the stage shows: of each channel of a picture on a logarithmic axis, or of a view's numbers on
// their scale. Counts are logarithmic.

const HISTOGRAM = { bins: 160, height: 110, channels: ["#e5484d", "#30a46c", "#3e8fe8"], low: 1e-4, high: 100 };
const PICTURE_SCALE = { low: HISTOGRAM.low, high: HISTOGRAM.high, logarithmic: true };

/** Counts of values in the bins of a scale; values beyond its ends are in the first and the last bin. */
function binned(values, scale, gain) {
  const bins = new Float64Array(HISTOGRAM.bins), place = scale_position(scale, gain);
  const bin_of = (value) => clamp(Math.floor(place(value) * bins.length), 0, bins.length - 1);
  for (const value of values)
    if (!Number.isNaN(value)) bins[scale.logarithmic && value <= 0 ? 0 : bin_of(value)]++;
  return bins;
}

/** Smallest, mean and largest value, and how many pixels are negative or not a number in any channel. */
function facts_of(channels) {
  let low = Infinity, high = -Infinity, sum = 0, count = 0, negative = 0, broken = 0;
  for (let i = 0; i < channels[0].length; i++) {
    let is_negative = false, is_broken = false;
    for (const values of channels) {
      const v = values[i];
      is_broken ||= !Number.isFinite(v);
      is_negative ||= v < 0;
      if (Number.isFinite(v)) low = Math.min(low, v), high = Math.max(high, v), sum += v, count++;
    }
    negative += is_negative;
    broken += is_broken;
  }
  return { low, high, mean: sum / count, negative, broken };
}

function facts_text({ low, high, mean, negative, broken }, number, signed) {
  const pixels = (n, what) => (n ? ` · ${n} pixel${n > 1 ? "s" : ""} ${what}` : "");
  return `min ${number(low)} · mean ${number(mean)} · max ${number(high)}` +
    (signed ? "" : pixels(negative, "negative")) + pixels(broken, "not finite");
}

class HistogramPanel {
  constructor(comparer) {
    this.comparer = comparer;
    this.element = el("div", { class: "histograms" });
    this.key = null;
  }

  /** Draws again where what it shows has changed. */
  update() {
    const { state, painter, size } = this.comparer;
    this.element.hidden = !state.histogram;
    if (!state.histogram) return;
    const records = [...new Set(this.comparer.panes().map((pane) => pane.image))];
    const ready = records.map((record) => Boolean(painter.images(record)));
    const key = [this.comparer.scene.name, state.mode, painter.view.depends(state), state.gain, size.width,
      records.map((r) => r.name), ready,
      this.element.clientWidth, css_value("--ground")].join("|");
    if (key === this.key) return;
    this.key = key;
    this.element.replaceChildren(...records.filter((_, k) => ready[k]).map((record) => this.figure(record)));
  }

  figure(record) {
    const { painter, state } = this.comparer, { view } = painter;
    const image = painter.images(record)[0], n = image.width * image.height, numbers = painter.numbers_of(record);
    const channels = numbers ? [numbers.values] : Array.from({ length: image.channels }, (_, c) =>
      Float32Array.from(image.halves.subarray(c * n, (c + 1) * n), (bits) => half_values[bits]));
    const directions = painter.display(record) === "direction";
    const scale = view.scale ?? (directions ? { low: -1, high: 1 } : PICTURE_SCALE), gain = view.scale ? state.gain : 0;
    const number = (value) => (view.scale ? view_number(view, value) : significant(value, 3));
    const facts = facts_text(facts_of(channels), number, directions || scale.low < 0);
    const canvas = el("canvas", { role: "img", "aria-label": `Histogram of ${record.name}: ${facts}` });
    requestAnimationFrame(() => this.draw(canvas, channels.map((values) => binned(values, scale, gain)), scale));
    const marks = scale_marks(scale, gain);
    return el("figure", { class: "histogram" }, el("figcaption", {}, el("b", {}, record.name), ` ${facts}`), canvas,
      el("div", { class: "marks" }, marks.map((mark) => el("span", {}, mark))));
  }

  draw(canvas, histograms, scale) {
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, { height, bins } = HISTOGRAM;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    const context = canvas.getContext("2d");
    context.scale(ratio, ratio);
    const most = Math.log1p(Math.max(...histograms.map((h) => Math.max(...h))));
    const { state } = this.comparer;
    if (scale === PICTURE_SCALE && state.tone === "srgb") {  // above this line pixels are white
      const x = scale_position(scale, -state.exposure)(1) * width;
      context.setLineDash([4, 3]);
      context.strokeStyle = css_value("--text-soft");
      context.strokeRect(x, 0, 0, height);
      context.setLineDash([]);
    }
    context.lineWidth = 1;
    context.font = "10px system-ui, sans-serif";
    for (let count = 1; Math.log1p(count) < most; count *= 10) {  // a line for each power of ten
      const y = height * (1 - Math.log1p(count) / most);
      context.fillStyle = css_value("--line");
      context.fillRect(0, y, width, 1);
      context.fillStyle = css_value("--text-soft");
      if (y > 11) context.fillText(significant(count, 1), 2, y - 2);
    }
    histograms.forEach((counts, c) => {
      const colour = histograms.length === 3 ? HISTOGRAM.channels[c] : css_value("--accent");
      context.beginPath();
      context.moveTo(0, height);
      counts.forEach((count, k) => {
        const y = height * (1 - Math.log1p(count) / most);
        context.lineTo(k * width / bins, y), context.lineTo((k + 1) * width / bins, y);
      });
      context.lineTo(width, height);
      context.globalAlpha = 0.16;
      context.fillStyle = context.strokeStyle = colour;
      context.fill();
      context.globalAlpha = 1;
      context.lineWidth = 1.2;
      context.stroke();
    });
  }
}
