// SPDX-License-Identifier: Apache-2.0
// The image comparer: its state, what it draws, and how the state becomes a link. Controls, gestures and insets are in
// files of their own; all of them call update().

const KEEP_LINK_AFTER = 250;  // milliseconds without a change

class Comparer {
  constructor(block, store, on_link) {
    this.block = block;
    this.store = store;
    this.on_link = on_link;
    this.scene_insets = block.scenes.map((scene) => scene.insets ?? []);
    this.insets_changed = block.scenes.map(() => false);
    this.viewport = new Viewport();
    this.paintings = new Map();  // image id -> {key, canvas}
    this.failures = new Map();   // image id -> message
    this.pointer = null;         // {px, py} on the stage
    this.state = { scene: 0, a: 0, b: 0, layout: "single", mode: "image", exposure: 0, gain: 0, split: 0.5, aspect: 1 };
    this.canvas = el("canvas", { tabindex: "0", role: "application", "aria-roledescription": "image comparer",
      "aria-busy": "true" });
    this.stage = el("div", { class: "stage" }, this.canvas);
    this.controls = new Controls(this);
    this.strip = new InsetStrip(this);
    this.element = el("section", { class: "comparer", id: block.id, "aria-label": "Image comparer" },
      this.controls.head, this.stage, this.controls.foot, this.strip.element);
    this.gestures = new Gestures(this);
    this.choose_scene(0);
    new ResizeObserver(() => this.request_draw()).observe(this.stage);
    new IntersectionObserver((entries, observer) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      observer.disconnect();
      this.visible = true;
      this.request_draw();
      this.strip.request_update();
    }, { rootMargin: "200px" }).observe(this.element);
  }

  // ---- what is chosen -------------------------------------------------------------------------------------------------

  get scene() { return this.block.scenes[this.state.scene]; }
  get images() { return this.scene.images; }
  get reference() { return this.images.find((image) => image.role === "reference"); }
  get insets() { return this.scene_insets[this.state.scene]; }
  get stops() { return this.state.mode === "image" ? this.state.exposure : this.state.gain; }
  /** Width and height of the scene's images. */
  get size() {
    const [width, height] = this.store.sizes[this.images[0].image];
    return { width, height };
  }

  choose_scene(index) {
    const { images } = this.block.scenes[index];
    const find = (accept) => images.findIndex(accept);
    const a = Math.max(find((image) => !image.role), 0);
    const others = [find((i) => i.role === "baseline"), find((i) => i.role === "reference"), find((_, k) => k !== a)];
    const b = others.find((k) => k >= 0 && k !== a) ?? a;
    this.viewport.fit();
    this.paintings.clear();
    this.update({ scene: index, a, b, layout: images.length > 1 ? "split" : "single" });
  }

  /** Changes the state and everything that shows it. */
  update(changes = {}) {
    const next = { ...this.state, ...changes };
    if (!this.block.scenes[next.scene].images.some((i) => i.role === "reference")) next.mode = "image";
    next.split = clamp(next.split, 0, 1);
    this.state = next;
    this.state.aspect = this.size.width / this.size.height;
    this.stage.style.setProperty("--aspect", this.state.aspect);
    this.canvas.style.touchAction = this.viewport.is_fit ? "pan-y" : "none";
    this.controls.show();
    this.canvas.setAttribute("aria-label", this.description());
    this.request_draw();
    this.strip.request_update();
    if (this.started) this.keep_link();
  }

  /** In words, what the stage shows. */
  description() {
    const named = (image) => image.name + (image.label ? ` (${image.label})` : "");
    const { a, b, layout, mode } = this.state;
    const what = layout === "grid" ? this.images.map(named).join(", ")
      : layout === "split" ? `${named(this.images[a])} left, ${named(this.images[b])} right` : named(this.images[a]);
    const how = { image: "picture", error: "squared error", difference: "signed difference" }[mode];
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

  // ---- links ----------------------------------------------------------------------------------------------------------

  link() {
    const { a, b, layout, mode, exposure, gain, split } = this.state, { zoom, x, y } = this.viewport;
    return format_link({
      comparer: this.block.id, scene: this.scene.name, a: this.images[a].name, b: this.images[b].name, layout, mode,
      exposure, gain, split: layout === "split" ? split : null, zoom, x, y,
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
    this.choose_scene(Math.max(scene, 0));
    const index = (name, otherwise) => {
      const found = this.images.findIndex((image) => image.name === name);
      return found < 0 ? otherwise : found;
    };
    if (link.zoom > 0) this.viewport.set(link.zoom, link.x ?? this.size.width / 2, link.y ?? this.size.height / 2, this.size);
    if (link.insets) {
      this.set_insets([]);
      link.insets.forEach((inset) => this.add_inset(inset));
    }
    const given = Object.fromEntries(["layout", "mode", "exposure", "gain", "split"].filter((k) => k in link).map((k) => [k, link[k]]));
    this.update({ ...given, a: index(link.a, this.state.a), b: index(link.b, this.state.b) });
  }

  // ---- drawing --------------------------------------------------------------------------------------------------------

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

  /** The image as a canvas in the chosen view, or null while it is being decoded. */
  painting(record) {
    const image = this.store.ready(record.image), reference = this.reference && this.store.ready(this.reference.image);
    const { mode } = this.state;
    if (!image || (mode !== "image" && !reference)) {
      for (const id of [record.image, mode !== "image" && this.reference.image])
        if (id && !this.failures.has(id))
          this.store.load(id).then(() => this.request_draw(), (error) => {
            this.failures.set(id, error.message);
            this.request_draw();
          });
      return null;
    }
    const key = `${mode} ${this.stops}`, old = this.paintings.get(record.image);
    if (old?.key === key) return old.canvas;
    const canvas = painted(image, reference, mode, this.stops);
    this.paintings.set(record.image, { key, canvas });
    return canvas;
  }

  draw() {
    const width = this.stage.clientWidth, height = this.stage.clientHeight, ratio = window.devicePixelRatio || 1;
    if (!width || !height) return;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    const context = this.canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    let whole = true;
    for (const pane of this.panes()) {
      context.save();
      context.beginPath();
      context.rect(pane.clip.x, pane.clip.y, pane.clip.w, pane.clip.h);
      context.clip();
      const picture = this.painting(pane.image);
      if (picture) this.draw_picture(context, pane, picture, ratio);
      else whole = this.draw_waiting(context, pane) && whole;
      this.draw_label(context, pane);
      context.restore();
    }
    this.controls.show_pixel();
    this.canvas.setAttribute("aria-busy", String(!whole));
    if (whole) this.load_others();
  }

  draw_picture(context, pane, picture, ratio) {
    const { zoom, x, y } = this.viewport.resolve(pane, picture);
    const to_x = (image_x) => pane.x + pane.w / 2 + (image_x - x) * zoom;
    const to_y = (image_y) => pane.y + pane.h / 2 + (image_y - y) * zoom;
    context.imageSmoothingEnabled = zoom * ratio < 1;
    context.imageSmoothingQuality = "high";
    context.drawImage(picture, to_x(0), to_y(0), picture.width * zoom, picture.height * zoom);
    this.insets.forEach((inset, i) => frame_rectangle(context, INSET_COLOURS[i % INSET_COLOURS.length],
      to_x(inset.x), to_y(inset.y), inset.w * zoom, inset.h * zoom));
    const drawn = this.gestures.rectangle;
    if (drawn) frame_rectangle(context, "#fff", to_x(drawn.x), to_y(drawn.y), drawn.w * zoom, drawn.h * zoom);
    const at = this.state.layout === "grid" && this.pointed();
    if (at) draw_cross(context, to_x(at.x + 0.5), to_y(at.y + 0.5));
  }

  /** Says why there is no picture; true when that will not change. */
  draw_waiting(context, pane) {
    const failure = this.failures.get(pane.image.image) ?? (this.reference && this.failures.get(this.reference.image));
    context.fillStyle = "#c9ccd1";
    context.font = "14px system-ui, sans-serif";
    context.textAlign = "center";
    context.fillText(failure ?? "Decoding …", pane.clip.x + pane.clip.w / 2, pane.clip.y + pane.clip.h / 2);
    return Boolean(failure);
  }

  draw_label(context, pane) {
    const right = pane.side === "b", { name, label } = pane.image;
    context.font = "600 13px system-ui, sans-serif";
    const name_width = context.measureText(name).width;
    context.font = "13px system-ui, sans-serif";
    const text_width = name_width + (label ? context.measureText(label).width + 10 : 0);
    const left = right ? pane.clip.x + pane.clip.w - text_width - 26 : pane.clip.x + 8;
    context.fillStyle = "rgb(16 17 20 / 78%)";
    context.beginPath();
    context.roundRect(left, pane.clip.y + 8, text_width + 18, 26, 6);
    context.fill();
    context.textAlign = "left";
    context.textBaseline = "middle";
    context.fillStyle = "#fff";
    context.font = "600 13px system-ui, sans-serif";
    context.fillText(name, left + 9, pane.clip.y + 21.5);
    context.fillStyle = "#d5d8dd";
    context.font = "13px system-ui, sans-serif";
    if (label) context.fillText(label, left + 9 + name_width + 10, pane.clip.y + 21.5);
    context.textBaseline = "alphabetic";
  }

  /** Decodes the scene's other images while nothing else is to do, so that flipping to them is instant. */
  load_others() {
    const next = this.images.find((i) => !this.store.ready(i.image) && !this.failures.has(i.image));
    if (!next || this.loading) return;
    this.loading = true;
    const done = () => { this.loading = false; this.load_others(); };
    this.store.load(next.image).then(done, (error) => { this.failures.set(next.image, error.message); done(); });
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
