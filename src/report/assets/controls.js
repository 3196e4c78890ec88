// SPDX-License-Identifier: Apache-2.0
// Buttons and sliders above the stage, the help.

const STOPS_RANGE = 10;

const VIEW_BUTTONS = Object.keys(VIEWS).filter((mode) => VIEWS[mode].name);

const KEYS = [
  ["1 … 9, 0", "show an image: in split on the pointer's side; in the grid alone, and again for the grid"],
  ["Shift + 1 … 0", "image on the right of the split"],
  ["Space", "exchange the two images"],
  ["S, G", "split, grid (again: one image)"],
  [VIEW_BUTTONS.map((mode) => VIEWS[mode].key.toUpperCase()).join(", "),
    VIEW_BUTTONS.map((mode) => VIEWS[mode].name).join(", ")],
  ["V, Shift + V", "next, previous layer of the file"],
  ["T", "next tone curve"],
  ["H", "histogram"],
  ["E, Shift + E", "half a stop brighter, darker"],
  ["R", "reset the exposure"],
  ["+, −, wheel", "zoom (the wheel after a click, or with Ctrl)"],
  ["F, O", "fit the stage, one pixel to one pixel"],
  ["arrows, drag", "pan"],
  ["[, ]", "move the split"],
  ["N", "draw an inset; Enter takes the middle of the view, Esc gives up"],
  ["P", "save the figure with all insets as PNG"],
  ["K", "play or stop the frames of a sequence"],
];

const label_with_note = ({ label, note }) => [label, note].filter(Boolean).join(", ");
const view_hint = ({ hint, key }) => `${hint} (${key.toUpperCase()})`;

class Controls {
  constructor(comparer) {
    this.comparer = comparer;
    const update = (changes) => comparer.update(changes);
    this.player = comparer.block.fps ? new FramePlayer(comparer) : null;
    const choose_scene = (index) => (this.player ? comparer.show_frame(index) : comparer.choose_scene(index));
    this.scene = el("select", { "aria-label": "Scene", change: () => choose_scene(this.scene.selectedIndex) },
      comparer.block.scenes.map((scene) => el("option", {}, scene.name)));
    this.mode = segmented("View", VIEW_BUTTONS.map((mode) => [mode, VIEWS[mode].name, view_hint(VIEWS[mode])]),
      (mode) => update({ mode }));
    this.layer = el("select", { "aria-label": "Layer of the file", title: "Layer of the file (V)",
      change: () => this.choose_layer(this.layer.value) });
    this.tone = el("select", { "aria-label": "Tone curve", title: "Tone curve (T)",
      change: () => update({ tone: this.tone.value }) },
      Object.entries(TONES).map(([tone, { name, hint }]) => el("option", { value: tone, title: hint }, name)));
    this.layout = segmented("Layout", [["single", "One", "One image"],
      ["split", "Split", "Two images with a slider (S)"], ["grid", "Grid", "All images (G)"]],
      (layout) => update({ layout }));
    this.stops = el("input", { type: "range", min: -STOPS_RANGE, max: STOPS_RANGE, step: 0.25,
      input: () => this.set_stops(Number(this.stops.value)) });
    this.stops_value = el("output");
    this.stops_name = el("span");
    const button = (text, hint, click) =>
      el("button", { type: "button", title: hint, "aria-label": hint, click }, text);
    const tools = el("div", { class: "tools" },
      button("−", "Zoom out (−)", () => this.zoom(0.5)), button("+", "Zoom in (+)", () => this.zoom(2)),
      button("Fit", "Fit the stage (F)", () => this.fit()),
      button("1:1", "One pixel to one pixel (O)", () => this.one_to_one()),
      this.inset = button("Inset", "Draw an inset (N)", () => comparer.gestures.toggle_drawing()),
      this.histogram = button("Histogram", "Histogram (H)", () => this.toggle_histogram()),
      this.figure = button("Figure", "Save a figure with all insets as PNG (P)", () => this.save()),
      button("Link", "Copy a link to this view", () => this.copy_link()),
      button("Full", "Full screen", () => this.full_screen()), button("?", "Keys", () => this.help.showModal()));
    this.help = el("dialog", { class: "keys", "aria-label": "Keys",
      click: (event) => event.target === this.help && this.help.close() },
      el("table", {}, KEYS.map(([keys, text]) => el("tr", {}, el("th", { scope: "row" }, keys), el("td", {}, text)))),
      el("form", { method: "dialog" }, el("button", { autofocus: "" }, "Close")));
    this.methods = el("div", { class: "methods", role: "group", "aria-label": "Images" });
    this.other = el("select", { "aria-label": "Image on the right",
      change: () => update({ b: this.other.selectedIndex }) });
    this.other_label = el("label", { class: "other" }, "Right: ", this.other);
    this.head = el("div", { class: "head" },
      el("div", { class: "bar" }, comparer.block.scenes.length > 1 && this.scene || null, this.player?.element,
        this.layout.group, this.methods, this.other_label),
      el("div", { class: "bar" }, this.mode.group, this.layer, this.tone,
        el("label", { class: "stops" }, this.stops_name, this.stops, this.stops_value), tools), this.help);
    this.handle = el("div", { class: "handle", role: "slider", tabindex: "0", "aria-label": "Split position",
      "aria-valuemin": 0, "aria-valuemax": 100, keydown: (event) => this.move_handle(event) });
    comparer.stage.append(this.handle);
  }

  // ---- showing the state ------------------------------------------------------------------------------------------

  show() {
    const { state, images, scene, painter } = this.comparer;
    if (this.shown_scene !== scene) this.show_scene(scene, images);
    this.player?.show();
    this.layout.show(state.layout);
    this.mode.show(state.mode);
    this.mode.buttons.forEach((button) => {
      const view = VIEWS[button.dataset.value];
      button.disabled = !painter.offers(button.dataset.value);
      button.title = view_hint(view) + (button.disabled ? `: ${view.missing} in this page` : "");
    });
    this.layer.value = state.mode === "layer" ? state.layer : "";
    this.tone.value = state.tone;
    this.tone.disabled = VIEWS[state.mode].scale !== undefined && state.mode !== "ssim";
    this.histogram.setAttribute("aria-pressed", String(Boolean(state.histogram)));
    this.stops_name.textContent = this.comparer.stops_name === "gain" ? "Gain" : "Exposure";
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
  }

  show_scene(scene, images) {
    this.shown_scene = scene;
    this.scene.selectedIndex = this.comparer.state.scene;
    this.methods.replaceChildren(...images.map((image, i) => el("button",
      { type: "button", title: i < 10 ? `Key ${(i + 1) % 10}` : null,
        click: (event) => this.choose(i, event.shiftKey) },
      el("kbd", { "aria-hidden": "true" }, i < 10 ? String((i + 1) % 10) : ""), el("span", {}, image.name),
      el("small", {}, label_with_note(image) || (image.role === "reference" ? "reference" : "")))));
    this.other.replaceChildren(...images.map((image) => el("option", {}, image.name)));
    this.layers = [...new Set(images.flatMap((image) => (image.layers ?? []).map((layer) => layer.name)))];
    this.layer.replaceChildren(el("option", { value: "" }, "Layer: image"),
      ...this.layers.map((name) => el("option", { value: name }, name)));
    this.layer.hidden = !this.layers.length;
  }

  // ---- what the buttons do ----------------------------------------------------------------------------------------

  /** Shows image `i` at the left, or at the right of the split; from the grid alone, and once more leads back. */
  choose(i, right = false) {
    const { state, images } = this.comparer;
    if (i >= images.length) return;
    const back = this.from_grid && !right && state.layout === "single" && state.a === i;
    this.from_grid = state.layout === "grid" || (this.from_grid && state.layout === "single" && !back);
    if (right) this.comparer.update({ b: i, layout: "split" });
    else this.comparer.update({ a: i, layout: back ? "grid" : state.layout === "grid" ? "single" : state.layout });
  }

  /** A layer by name, "" for the image itself. */
  choose_layer(layer) { this.comparer.update(layer ? { mode: "layer", layer } : { mode: "image" }); }

  /** The layer that comes `step` after the one shown, the image itself among them. */
  next_layer(step) {
    const { mode, layer } = this.comparer.state, all = ["", ...this.layers];
    const at = mode === "layer" ? all.indexOf(layer) : 0;
    this.choose_layer(all[(at + step + all.length) % all.length]);
  }

  next_tone() {
    const all = Object.keys(TONES);
    this.comparer.update({ tone: all[(all.indexOf(this.comparer.state.tone) + 1) % all.length] });
  }

  toggle_histogram() { this.comparer.update({ histogram: this.comparer.state.histogram ? 0 : 1 }); }

  set_stops(stops) { this.comparer.update({ [this.comparer.stops_name]: clamp(stops, -STOPS_RANGE, STOPS_RANGE) }); }

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
    try { await save_figure(this.comparer); } catch (error) { this.comparer.readout.say(error.message); }
    this.figure.disabled = false;
  }

  async copy_link() {
    this.comparer.on_link(this.comparer.link());
    try {
      await navigator.clipboard.writeText(location.href);
      this.comparer.readout.say("The link is in the clipboard.");
    } catch {
      this.comparer.readout.say("The address bar holds the link.");
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
