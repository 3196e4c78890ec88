// SPDX-License-Identifier: Apache-2.0
// The image comparer: its state, and how the state becomes a link. Controls, gestures, insets and what draws are in
// files of their own; all of them call update().

const KEEP_LINK_AFTER = 250;  // milliseconds without a change
const LEAST_STAGE = 190;      // CSS pixels
const MOST_HISTOGRAM = 220;   // of the histograms' height that is kept in view with the stage
const MOST_LEAD = 0.2;        // of the window: what stands above the comparer and is kept in view with it

class Comparer {
  constructor(block, store, on_link) {
    this.block = block;
    this.store = store;
    this.on_link = on_link;
    this.scene_insets = block.scenes.map((scene) => scene.insets ?? []);
    this.insets_changed = block.scenes.map(() => false);
    this.viewport = new Viewport();
    this.painter = new Painter(this);
    this.pointer = null;  // {px, py} on the stage
    this.state = { scene: 0, a: 0, b: 0, layout: "single", mode: "image", layer: "", tone: "srgb", exposure: 0, gain: 0,
      split: 0.5, histogram: 0, aspect: 1 };
    this.canvas = el("canvas", { tabindex: "0", role: "application", "aria-roledescription": "image comparer",
      "aria-busy": "true" });
    this.stage = el("div", { class: "stage" }, this.canvas);
    this.readout = new Readout(this);
    this.controls = new Controls(this);
    this.strip = new InsetStrip(this);
    this.histograms = new HistogramPanel(this);
    this.element = el("section", { class: "comparer", id: block.id, "aria-label": "Image comparer" },
      this.controls.head, this.stage, this.readout.element, this.histograms.element, this.readout.more,
      this.strip.element);
    this.gestures = new Gestures(this);
    this.choose_scene(0);
    const fit = () => { this.fit_stage(); this.request_draw(); };
    const observer = new ResizeObserver(fit);
    const { head } = this.controls;
    [this.element, this.stage, head, this.readout.element, this.histograms.element].forEach((e) => observer.observe(e));
    window.addEventListener("resize", fit);
    new IntersectionObserver((entries, observer) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      observer.disconnect();
      this.visible = true;
      this.request_draw();
      this.strip.request_update();
    }, { rootMargin: "200px" }).observe(this.element);
  }

  // ---- what is chosen ---------------------------------------------------------------------------------------------

  get scene() { return this.block.scenes[this.state.scene]; }
  get images() { return this.scene.images; }
  get reference() { return this.images.find((image) => image.role === "reference"); }
  get insets() { return this.scene_insets[this.state.scene]; }
  /** The name of the slider's value in the state. */
  get stops_name() { return VIEWS[this.state.mode].scale ? "gain" : "exposure"; }
  get stops() { return this.state[this.stops_name]; }
  /** Width and height of the scene's images. */
  get size() {
    const [width, height] = this.store.sizes[this.images[0].image];
    return { width, height };
  }

  choose_scene(index) {
    const { images } = this.block.scenes[index];
    const first = (...accepts) => accepts.map((accept) => images.findIndex(accept)).find((k) => k >= 0);
    const a = first((i) => i.role === "best", (i) => !i.role) ?? 0;
    const b = first((i) => i.role === "baseline", (i) => i.role === "reference", (_, k) => k !== a) ?? a;
    this.viewport.fit();
    this.painter.clear();
    this.loaded_ahead = new Set();
    this.update({ scene: index, a, b, layout: images.length > 1 ? "split" : "single" });
  }

  /** Another frame of the same images: what else is chosen stays. */
  show_frame(index) {
    this.painter.clear();
    this.loaded_ahead = new Set();
    this.update({ scene: index });
  }

  /** Changes the state and everything that shows it. */
  update(changes = {}) {
    const next = { ...this.state, ...changes };
    next.split = clamp(next.split, 0, 1);
    this.state = next;
    if (!this.painter.offers(next.mode)) next.mode = "image";
    const has = (k) => this.painter.ids(this.images[k]);
    if ("mode" in changes && !("a" in changes) && !has(next.a)) next.a = this.images.findIndex((_, k) => has(k));
    this.state.aspect = this.size.width / this.size.height;
    this.canvas.style.touchAction = this.viewport.is_fit ? "pan-y" : "none";
    this.controls.show();
    this.readout.show();
    this.fit_stage();
    this.canvas.setAttribute("aria-label", this.description());
    this.request_draw();
    this.strip.request_update();
    if (this.started) this.keep_link();
  }

  /** In words, what the stage shows. */
  description() {
    const named = (image) => image.name + (label_with_note(image) ? ` (${label_with_note(image)})` : "");
    const { a, b, layout, mode, layer } = this.state;
    const what = layout === "grid" ? this.images.map(named).join(", ")
      : layout === "split" ? `${named(this.images[a])} left, ${named(this.images[b])} right` : named(this.images[a]);
    const how = VIEWS[mode].words + (mode === "layer" ? ` ${layer}` : "");
    return `${this.scene.name}: ${what}; ${how}, ${stops_text(this.stops)} stops`;
  }

  add_inset(rectangle) {
    const { width, height } = this.size;
    const x = clamp(Math.round(rectangle.x), 0, width - 1), y = clamp(Math.round(rectangle.y), 0, height - 1);
    const w = clamp(Math.round(rectangle.w), 1, width - x), h = clamp(Math.round(rectangle.h), 1, height - y);
    this.set_insets([...this.insets, { x, y, w, h }]);
  }

  remove_inset(index) { this.set_insets(this.insets.filter((_, i) => i !== index)); }

  set_insets(insets) {
    this.scene_insets[this.state.scene] = insets;
    this.insets_changed[this.state.scene] = true;
    this.update();
  }

  // ---- links ------------------------------------------------------------------------------------------------------

  link() {
    const { a, b, layout, mode, layer, tone, exposure, gain, split, histogram } = this.state;
    const { zoom, x, y } = this.viewport;
    return format_link({
      comparer: this.block.id, scene: this.scene.name, a: this.images[a].name, b: this.images[b].name, layout, mode,
      layer: mode === "layer" ? layer : null, tone: tone === "srgb" ? null : tone,
      exposure, gain, split: layout === "split" ? split : null, zoom, x, y, histogram: histogram || null,
      insets: this.insets_changed[this.state.scene] ? this.insets : null,
    });
  }

  keep_link() {
    clearTimeout(this.link_timer);
    this.link_timer = setTimeout(() => this.on_link(this.link()), KEEP_LINK_AFTER);
  }

  /** Shows what a link says; names that the page does not have are passed over. */
  open(link) {
    const scene = this.block.scenes.findIndex((s) => s.name === link.scene);
    if (link.scene !== undefined) this.choose_scene(Math.max(scene, 0));
    const index = (name, otherwise) => {
      const found = this.images.findIndex((image) => image.name === name);
      return found < 0 ? otherwise : found;
    };
    const { size } = this;
    if (link.zoom > 0) this.viewport.set(link.zoom, link.x ?? size.width / 2, link.y ?? size.height / 2, size);
    if (link.insets) {
      this.set_insets([]);
      link.insets.forEach((inset) => this.add_inset(inset));
    }
    const settings = ["layout", "mode", "layer", "tone", "exposure", "gain", "split", "histogram"];
    const given = Object.fromEntries(settings.filter((k) => k in link).map((k) => [k, link[k]]));
    this.update({ ...given, a: index(link.a, this.state.a), b: index(link.b, this.state.b) });
  }

  // ---- drawing ----------------------------------------------------------------------------------------------------

  panes() {
    return layout_panes({ width: this.stage.clientWidth, height: this.stage.clientHeight }, this.state, this.images);
  }

  pane_at(px, py) {
    const inside = ({ clip }) => px >= clip.x && py >= clip.y && px < clip.x + clip.w && py < clip.y + clip.h;
    return this.panes().find(inside);
  }

  request_draw() {
    if (!this.visible || this.frame) return;
    this.canvas.setAttribute("aria-busy", "true");
    this.frame = requestAnimationFrame(() => {
      this.frame = null;
      this.draw();
    });
  }

  draw() {
    if (!this.stage.clientWidth || !this.stage.clientHeight) return;
    const whole = draw_stage(this);
    this.readout.show_pixel();
    this.histograms.update();
    this.canvas.setAttribute("aria-busy", String(!whole));
    if (whole) this.load_others();
  }

  /** Gives the stage the largest height with which controls, pixel values and scale are in the window with it. */
  fit_stage() {
    const { head } = this.controls, { element: foot } = this.readout, width = this.stage.clientWidth;
    if (!width) return;
    this.readout.reserve(width);
    const full = document.fullscreenElement === this.element;
    const lead = full ? 0 : this.element.getBoundingClientRect().top + window.scrollY;
    const above = lead < MOST_LEAD * window.innerHeight ? lead : 0;
    const below = foot.offsetHeight + Math.min(this.histograms.element.offsetHeight, MOST_HISTOGRAM);
    const most = Math.max(window.innerHeight - above - head.offsetHeight - below - (full ? 26 : 10), LEAST_STAGE);
    const height = natural_height(width, most, this.state.layout, this.images.length, this.state.aspect);
    this.stage.style.height = `${Math.round(Math.max(height, Math.min(LEAST_STAGE, width / this.state.aspect)))}px`;
  }

  /** Decodes the scene's other images while nothing else is to do, so that flipping to them is instant. */
  load_others() {
    const { painter } = this;
    const ids = this.images.flatMap((record) => [record.image, ...(painter.ids(record) ?? [])]);
    const next = ids.find((id) => !this.store.ready(id) && !this.loaded_ahead.has(id));
    if (!next || this.loading) return;
    this.loading = true;
    this.loaded_ahead.add(next);  // once only: memory may not hold all
    painter.load(next).then(() => { this.loading = false; this.load_others(); });
  }

  /** The image position under the pointer, {x, y, pane} in whole pixels, or null outside. */
  pointed() {
    if (!this.pointer) return null;
    const pane = this.pane_at(this.pointer.px, this.pointer.py);
    if (!pane) return null;
    const at = this.viewport.to_image(pane, this.size, this.pointer.px, this.pointer.py);
    const x = Math.floor(at.x), y = Math.floor(at.y);
    return x < 0 || y < 0 || x >= this.size.width || y >= this.size.height ? null : { x, y, pane };
  }
}
