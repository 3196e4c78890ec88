// SPDX-License-Identifier: Apache-2.0
// Buttons and sliders around the stage, the line of pixel values, the help.

const STOPS_RANGE = 10;

const KEYS = [
  ["1 … 9, 0", "show an image; in split, on the pointer's side"],
  ["Shift + 1 … 0", "image on the right of the split"],
  ["Space", "exchange the two images"],
  ["S, G", "split, grid (again: one image)"],
  ["I, X, D", "picture, squared error, signed difference"],
  ["E, Shift + E", "half a stop brighter, darker"],
  ["R", "reset the exposure"],
  ["+, −, wheel", "zoom (the wheel after a click, or with Ctrl)"],
  ["F, O", "fit the stage, one pixel to one pixel"],
  ["arrows, drag", "pan"],
  ["[, ]", "move the split"],
  ["N", "draw an inset; Enter takes the middle of the view, Esc gives up"],
  ["P", "save the figure with all insets as PNG"],
];

class Controls {
  constructor(comparer) {
    this.comparer = comparer;
    const update = (changes) => comparer.update(changes);
    this.scene = el("select", { "aria-label": "Scene", change: () => comparer.choose_scene(this.scene.selectedIndex) },
      comparer.block.scenes.map((scene) => el("option", {}, scene.name)));
    this.mode = segmented("View", [["image", "Picture", "Picture (I)"], ["error", "Error", "Squared error relative to the reference (X)"],
      ["difference", "Difference", "Signed difference from the reference (D)"]], (mode) => update({ mode }));
    this.layout = segmented("Layout", [["single", "One", "One image"], ["split", "Split", "Two images with a slider (S)"],
      ["grid", "Grid", "All images (G)"]], (layout) => update({ layout }));
    this.stops = el("input", { type: "range", min: -STOPS_RANGE, max: STOPS_RANGE, step: 0.25,
      input: () => this.set_stops(Number(this.stops.value)) });
    this.stops_value = el("output");
    this.stops_name = el("span");
    const button = (text, hint, click) => el("button", { type: "button", title: hint, "aria-label": hint, click }, text);
    const tools = el("div", { class: "tools" },
      button("−", "Zoom out (−)", () => this.zoom(0.5)), button("+", "Zoom in (+)", () => this.zoom(2)),
      button("Fit", "Fit the stage (F)", () => this.fit()), button("1:1", "One pixel to one pixel (O)", () => this.one_to_one()),
      this.inset = button("Inset", "Draw an inset (N)", () => comparer.gestures.toggle_drawing()),
      this.figure = button("Figure", "Save a figure with all insets as PNG (P)", () => this.save()),
      button("Link", "Copy a link to this view", () => this.copy_link()),
      button("Full", "Full screen", () => this.full_screen()), button("?", "Keys", () => this.help.showModal()));
    this.help = el("dialog", { class: "keys", "aria-label": "Keys", click: (event) => event.target === this.help && this.help.close() },
      el("table", {}, KEYS.map(([keys, text]) => el("tr", {}, el("th", { scope: "row" }, keys), el("td", {}, text)))),
      el("form", { method: "dialog" }, el("button", { autofocus: "" }, "Close")));
    this.methods = el("div", { class: "methods", role: "group", "aria-label": "Images" });
    this.other = el("select", { "aria-label": "Image on the right", change: () => update({ b: this.other.selectedIndex }) });
    this.other_label = el("label", { class: "other" }, "Right: ", this.other);
    this.head = el("div", { class: "head" },
      el("div", { class: "bar" }, comparer.block.scenes.length > 1 && this.scene || null, this.layout.group, this.mode.group,
        el("label", { class: "stops" }, this.stops_name, this.stops, this.stops_value), tools),
      el("div", { class: "bar" }, this.methods, this.other_label), this.help);
    this.handle = el("div", { class: "handle", role: "slider", tabindex: "0", "aria-label": "Split position", "aria-valuemin": 0,
      "aria-valuemax": 100, keydown: (event) => this.move_handle(event) });
    comparer.stage.append(this.handle);
    this.pixel = el("div", { class: "pixel" });
    this.scale = el("div", { class: "scale" });
    this.message = el("div", { class: "message", role: "status" });
    this.credit = el("p", { class: "credit" });
    this.foot = el("div", { class: "foot" }, this.pixel, this.scale, this.message, this.credit);
  }

  // ---- showing the state ----------------------------------------------------------------------------------------------

  show() {
    const { state, images, scene, reference } = this.comparer;
    if (this.shown_scene !== scene) this.show_scene(scene, images);
    this.layout.show(state.layout);
    this.mode.show(state.mode);
    this.mode.buttons.forEach((b) => { b.disabled = b.dataset.value !== "image" && !reference; });
    this.stops_name.textContent = state.mode === "image" ? "Exposure" : "Gain";
    this.stops.setAttribute("aria-label", this.stops_name.textContent + " in stops");
    this.stops.value = this.comparer.stops;
    this.stops_value.textContent = stops_text(this.comparer.stops);
    [...this.methods.children].forEach((button, i) => {
      const on_left = i === state.a && state.layout !== "grid", on_right = i === state.b && state.layout === "split";
      button.setAttribute("aria-pressed", String(on_left));
      button.dataset.side = [on_left && "A", on_right && "B"].filter(Boolean).join("");
    });
    this.other.selectedIndex = state.b;
    this.other_label.hidden = this.handle.hidden = state.layout !== "split";
    this.handle.style.left = `${state.split * 100}%`;
    this.handle.setAttribute("aria-valuenow", Math.round(state.split * 100));
    this.show_scale();
  }

  show_scene(scene, images) {
    this.shown_scene = scene;
    this.scene.selectedIndex = this.comparer.state.scene;
    this.credit.textContent = scene.credit ?? "";
    this.methods.replaceChildren(...images.map((image, i) => el("button",
      { type: "button", title: i < 10 ? `Key ${(i + 1) % 10}` : null, click: (event) => this.choose(i, event.shiftKey) },
      el("kbd", { "aria-hidden": "true" }, i < 10 ? String((i + 1) % 10) : ""), el("span", {}, image.name),
      el("small", {}, image.label ?? (image.role === "reference" ? "reference" : "")))));
    this.other.replaceChildren(...images.map((image) => el("option", {}, image.name)));
  }

  show_scale() {
    const { mode, gain } = this.comparer.state;
    const scale = scale_of(mode, gain);
    this.scale.hidden = !scale;
    if (!scale) return;
    this.scale.replaceChildren(
      el("div", { class: "ramp", style: `background: ${scale.colours}` }),
      el("div", { class: "marks" }, scale.marks.map((mark) => el("span", {}, mark))), el("div", {}, scale.text));
  }

  /** Values of the pixel under the pointer, in the images shown and the reference. */
  show_pixel() {
    const { comparer } = this, at = comparer.pointed();
    if (!at) {
      this.pixel.textContent = "Point at a pixel to read its values.";
      return;
    }
    const shown = comparer.state.layout === "grid" ? comparer.images : comparer.panes().map((pane) => pane.image);
    const records = [...new Set([...shown, ...(comparer.reference ? [comparer.reference] : [])])];
    const reference = comparer.reference && comparer.store.ready(comparer.reference.image);
    const items = records.map((record) => {
      const image = comparer.store.ready(record.image);
      if (!image) return null;
      const values = pixel_of(image, at.x, at.y).map((v) => significant(v, 4)).join(" ");
      const error = reference && record !== comparer.reference
        ? ` · error ${significant(relative_error(image, reference, at.y * image.width + at.x), 2)}` : "";
      return el("span", {}, el("b", {}, record.name), ` ${values}${error}`);
    });
    this.pixel.replaceChildren(el("span", { class: "place" }, `x ${at.x}, y ${at.y}`), ...items.filter(Boolean));
  }

  say(text) {
    this.message.textContent = text;
    clearTimeout(this.silence);
    this.silence = setTimeout(() => { this.message.textContent = ""; }, 6000);
  }

  // ---- what the buttons do --------------------------------------------------------------------------------------------

  /** Shows image `i` at the left, or at the right of the split. */
  choose(i, right = false) {
    const { state, images } = this.comparer;
    if (i >= images.length) return;
    if (right) this.comparer.update({ b: i, layout: "split" });
    else this.comparer.update({ a: i, layout: state.layout === "grid" ? "single" : state.layout });
  }

  set_stops(stops) {
    const name = this.comparer.state.mode === "image" ? "exposure" : "gain";
    this.comparer.update({ [name]: clamp(stops, -STOPS_RANGE, STOPS_RANGE) });
  }

  zoom(factor) {
    const { comparer } = this;
    comparer.viewport.zoom_about(comparer.panes()[0], comparer.size, factor);
    comparer.update();
  }

  fit() {
    this.comparer.viewport.fit();
    this.comparer.update();
  }

  one_to_one() {
    const { comparer } = this, pane = comparer.panes()[0];
    const { x, y } = comparer.viewport.resolve(pane, comparer.size);
    comparer.viewport.set(1 / (window.devicePixelRatio || 1), x, y, comparer.size);
    comparer.update();
  }

  async save() {
    this.figure.disabled = true;
    try { await save_figure(this.comparer); } catch (error) { this.say(error.message); }
    this.figure.disabled = false;
  }

  async copy_link() {
    this.comparer.on_link(this.comparer.link());
    try {
      await navigator.clipboard.writeText(location.href);
      this.say("The link is in the clipboard.");
    } catch {
      this.say("The address bar holds the link.");
    }
  }

  full_screen() {
    if (document.fullscreenElement) document.exitFullscreen();
    else this.comparer.element.requestFullscreen?.();
  }

  move_handle(event) {
    const step = { ArrowLeft: -0.02, ArrowDown: -0.02, ArrowRight: 0.02, ArrowUp: 0.02, Home: -1, End: 1 }[event.key];
    if (!step) return;
    event.preventDefault();
    event.stopPropagation();
    this.comparer.update({ split: this.comparer.state.split + step });
  }
}
