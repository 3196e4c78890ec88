// SPDX-License-Identifier: Apache-2.0
// Below the stage: values of the pixel under the pointer, the colour scale, messages.

const READOUT_WIDTH = 384;  // pixels that one image's values need
const PLACE_WIDTH = 106;
const MOST_LINES = 5;

class Readout {
  constructor(comparer) {
    this.comparer = comparer;
    this.pixel = el("div", { class: "pixel" });
    this.scale = el("div", { class: "scale" });
    this.message = el("div", { class: "message", role: "status" });
    this.credit = el("p", { class: "credit" });
    this.element = el("div", { class: "foot" }, this.pixel, this.scale);
    this.more = el("div", { class: "more" }, this.message, this.credit);
  }

  show() {
    const { state, scene } = this.comparer, { scale, note } = VIEWS[state.mode];
    this.credit.textContent = scene.credit ?? "";
    this.credit.hidden = !scene.credit;
    this.scale.hidden = !scale;
    if (scale)
      this.scale.replaceChildren(el("div", { class: "colour-bar" },
        el("div", { class: "ramp", style: `background: ${css_ramp(scale.ramp)}` }),
        el("div", { class: "marks" }, scale_marks(scale, state.gain).map((mark) => el("span", {}, mark)))),
      el("div", { class: "note" }, note));
  }

  /** The images whose values are shown: those on the stage and the reference. */
  records() {
    const { state, images, reference } = this.comparer;
    const shown = state.layout === "grid" ? images
      : [images[state.a], ...(state.layout === "split" ? [images[state.b]] : [])];
    return [...new Set([...shown, ...(reference ? [reference] : [])])];
  }

  /** Room for all values at once, so that the stage keeps its place while the pointer moves. */
  reserve(width) {
    const in_a_line = Math.floor((width - PLACE_WIDTH) / READOUT_WIDTH), n = this.records().length;
    this.pixel.classList.toggle("stacked", in_a_line < 1);  // the place above the values
    this.pixel.style.setProperty("--lines", Math.min(in_a_line < 1 ? n + 1 : Math.ceil(n / in_a_line), MOST_LINES));
  }

  show_pixel() {
    const at = this.comparer.pointed();
    if (!at) this.pixel.replaceChildren(el("span", {}, "Point at a pixel to read its values."));
    else
      this.pixel.replaceChildren(el("span", { class: "place" }, `x ${at.x}, y ${at.y}`),
        el("div", { class: "values" }, this.records().map((record) => this.values(record, at))));
  }

  /** One image's values at a pixel, from the half floats, and what the view says of them. */
  values(record, { x, y }) {
    const { comparer } = this, { state, store, reference, painter } = comparer, { view } = painter;
    const image = store.ready(state.mode === "layer" ? painter.ids(record)?.[0] : record.image);
    if (!image) return null;
    const i = y * image.width + x, parts = [];
    for (const value of pixel_of(image, x, y))
      parts.push(" ", value < 0 ? el("span", { class: "negative" }, significant(value, 4)) : significant(value, 4));
    const other = reference && record !== reference && state.mode !== "layer" && store.ready(reference.image);
    const numbers = record === reference && view !== VIEWS.predicted ? null : painter.numbers_of(record);
    if (numbers) parts.push(` · ${view.short} ${view_number(view, numbers.values[i], 2)}`);
    else if (other && !view.values) parts.push(` · error ${significant(relative_error(image, other, i), 2)}`);
    return el("span", {}, el("b", {}, record.name), parts);
  }

  say(text) {
    this.message.textContent = text;
    clearTimeout(this.silence);
    this.silence = setTimeout(() => { this.message.textContent = ""; }, 6000);
  }
}
