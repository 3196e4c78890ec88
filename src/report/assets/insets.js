// SPDX-License-Identifier: Apache-2.0
// Magnified crops of all images of a scene, side by side below the stage.

const INSET_COLOURS = ["#f5a623", "#38b6ff", "#5fd35f", "#f06bd6", "#ffe14d", "#b58cff"];

function frame_rectangle(context, colour, x, y, w, h) {
  context.lineWidth = 4;
  context.strokeStyle = "rgb(0 0 0 / 60%)";
  context.strokeRect(x, y, w, h);
  context.lineWidth = 2;
  context.strokeStyle = colour;
  context.strokeRect(x, y, w, h);
}

function draw_cross(context, x, y) {
  for (const [width, colour] of [[3, "rgb(0 0 0 / 60%)"], [1, "#fff"]]) {
    context.lineWidth = width;
    context.strokeStyle = colour;
    context.beginPath();
    context.moveTo(x - 8, y), context.lineTo(x + 8, y), context.moveTo(x, y - 8), context.lineTo(x, y + 8);
    context.stroke();
  }
}

/** The crop of a painted image, one canvas pixel per image pixel. */
function crop_of(picture, { x, y, w, h }) {
  const canvas = el("canvas", { width: w, height: h });
  canvas.getContext("2d").drawImage(picture, x, y, w, h, 0, 0, w, h);
  return canvas;
}

class InsetStrip {
  constructor(comparer) {
    this.comparer = comparer;
    this.element = el("div", { class: "insets" });
    this.version = 0;
  }

  request_update() {
    if (this.frame) return;
    this.element.setAttribute("aria-busy", "true");
    this.frame = requestAnimationFrame(() => {
      this.frame = null;
      this.update();
    });
  }

  /** Crops of every inset and image: [{inset, colour, crops: [{record, canvas, error}]}]; decodes what is missing. */
  async rows() {
    const { comparer } = this, { images, insets, reference } = comparer;
    const loaded = await Promise.all(images.map((record) => comparer.store.load(record.image)));
    const reference_image = reference && loaded[images.indexOf(reference)];
    return insets.map((inset, i) => ({
      inset,
      colour: INSET_COLOURS[i % INSET_COLOURS.length],
      crops: images.map((record, k) => ({
        record,
        canvas: crop_of(painted_for(comparer, record, loaded[k], reference_image), inset),
        error: reference && record !== reference ? relative_mse(loaded[k], reference_image, inset) : null,
      })),
    }));
  }

  async update() {
    const version = ++this.version;
    if (!this.comparer.insets.length) this.element.replaceChildren();
    else if (this.comparer.visible) {
      let rows;
      try { rows = await this.rows(); } catch (error) {
        rows = null;
        this.element.replaceChildren(el("p", {}, error.message));
      }
      if (version !== this.version) return;  // a later update overtook this one
      if (rows) this.element.replaceChildren(this.table(rows));
    }
    this.element.setAttribute("aria-busy", "false");
  }

  table(rows) {
    const { images } = this.comparer;
    const head = el("tr", {}, el("td"), images.map((image) => el("th", { scope: "col" }, image.name)));
    const body = rows.map(({ inset, colour, crops }, i) => el("tr", {},
      el("th", { scope: "row" },
        el("button", { type: "button", class: "remove", title: `Remove inset ${i + 1}`, "aria-label": `Remove inset ${i + 1}`,
          style: `--inset: ${colour}`, click: () => this.comparer.remove_inset(i) }, "×")),
      crops.map(({ record, canvas, error }) => {
        const text = error === null ? (record.role === "reference" ? "reference" : "") : `relMSE ${significant(error, 2)}`;
        canvas.setAttribute("role", "img");
        canvas.setAttribute("aria-label", `Inset ${i + 1} at ${inset.x}, ${inset.y}: ${record.name}${text ? ", " + text : ""}`);
        canvas.style.borderColor = colour;
        return el("td", {}, canvas, el("div", { class: "error" }, text));
      })));
    return el("table", { class: "crops" }, el("thead", {}, head), el("tbody", {}, body));
  }
}

/** The comparer's painting of an image, made where the stage has not needed it yet. */
function painted_for(comparer, record, image, reference) {
  const { mode } = comparer.state, key = `${mode} ${comparer.stops}`;
  const old = comparer.paintings.get(record.image);
  if (old?.key === key) return old.canvas;
  const canvas = painted(image, reference, mode, comparer.stops);
  comparer.paintings.set(record.image, { key, canvas });
  return canvas;
}
