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

  /** Crops of every inset and image: [{inset, colour, crops: [{record, canvas, label}]}], canvas null where an image
   *  has no such view; decodes what is missing. */
  async rows() {
    const { images, insets, reference, painter } = this.comparer;
    await Promise.all([...images, reference].filter(Boolean).flatMap((record) =>
      [painter.prepare(record), painter.load(record.image)]));
    return insets.map((inset, i) => ({
      inset,
      colour: INSET_COLOURS[i % INSET_COLOURS.length],
      crops: images.map((record) => {
        const picture = painter.painting(record);
        return { record, canvas: picture && crop_of(picture, inset), label: painter.crop_label(record, inset) };
      }),
    }));
  }

  async update() {
    const version = ++this.version;
    if (!this.comparer.insets.length) this.element.replaceChildren();
    else if (this.comparer.visible) {
      const rows = await this.rows();
      if (version !== this.version) return;  // a later update overtook this one
      this.element.replaceChildren(this.table(rows));
    }
    this.element.setAttribute("aria-busy", "false");
  }

  table(rows) {
    const { images } = this.comparer;
    const head = el("tr", {}, el("td"), images.map((image) => el("th", { scope: "col" }, image.name)));
    const body = rows.map(({ inset, colour, crops }, i) => el("tr", {},
      el("th", { scope: "row" },
        el("button", { type: "button", class: "remove", title: `Remove inset ${i + 1}`,
          "aria-label": `Remove inset ${i + 1}`,
          style: `--inset: ${colour}`, click: () => this.comparer.remove_inset(i) }, "×")),
      crops.map(({ record, canvas, label }) => {
        if (!canvas) return el("td", {}, this.comparer.painter.failure(record));
        canvas.setAttribute("role", "img");
        const place = `Inset ${i + 1} at ${inset.x}, ${inset.y}`;
        canvas.setAttribute("aria-label", `${place}: ${record.name}${label ? ", " + label : ""}`);
        canvas.style.borderColor = colour;
        return el("td", {}, canvas, el("div", { class: "error" }, label));
      })));
    return el("table", { class: "crops" }, el("thead", {}, head), el("tbody", {}, body));
  }
}
