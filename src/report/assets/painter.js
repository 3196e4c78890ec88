// SPDX-License-Identifier: Apache-2.0
// Paintings of a comparer's images in the chosen view, made when they are needed and kept until the view changes.

class Painter {
  constructor(comparer) {
    this.comparer = comparer;
    this.paintings = new Map();  // name of an image -> {key, canvas}
    this.numbers = new Map();    // name of an image -> {key, values, mean}
    this.failures = new Map();   // image id -> message
  }

  get view() { return VIEWS[this.comparer.state.mode]; }

  clear() {
    this.paintings.clear();
    this.numbers.clear();
  }

  /** Ids of the images that the view of a record is made of; null where it has none. */
  ids(record, mode = this.comparer.state.mode) {
    const { reference, state } = this.comparer;
    return VIEWS[mode].ids(record, { reference, layer: state.layer });
  }

  /** Whether any image of the scene has this view; the reference beside itself does not count. */
  offers(mode) {
    const { images, reference } = this.comparer;
    return images.some((record) => this.ids(record, mode) && !(VIEWS[mode].compares && record === reference));
  }

  /** Why there is no picture and will be none; null otherwise. */
  failure(record) {
    const ids = this.ids(record);
    if (!ids) return `${this.view.missing} in ${record.name}`;
    return ids.map((id) => this.failures.get(id)).find(Boolean) ?? null;
  }

  /** The decoded images of the view, or null while one is missing; `done` is called when one has come. */
  images(record, done) {
    const { store } = this.comparer, ids = this.ids(record);
    if (!ids) return null;
    const images = ids.map((id) => store.ready(id));
    if (images.every(Boolean)) return images;
    if (done) for (const id of ids) if (!this.failures.has(id)) this.load(id).then(done);
    return null;
  }

  /** Resolves when the image is decoded or cannot be. */
  async load(id) {
    try { await this.comparer.store.load(id); } catch (error) { this.failures.set(id, error.message); }
  }

  /** Everything that the record's view needs, decoded. */
  async prepare(record) { await Promise.all((this.ids(record) ?? []).map((id) => this.load(id))); }

  /** {values, mean} of a view that shows numbers, where its images are decoded; null otherwise. */
  numbers_of(record) {
    const { view } = this, { state } = this.comparer;
    const images = view.values && this.images(record);
    if (!images) return null;
    const key = `${state.mode} ${view.depends(state)}`, old = this.numbers.get(record.name);
    if (old?.key === key) return old;
    const values = view.values(images, state), numbers = { key, values, mean: mean_of(values, images[0].width) };
    this.numbers.set(record.name, numbers);
    return numbers;
  }

  /** The image as a canvas in the chosen view, or null where that is not there (yet: then `done` is called). */
  painting(record, done) {
    const { view } = this, { state } = this.comparer;
    const images = this.images(record, done);
    if (!images) return null;
    const key = `${state.mode} ${view.depends(state)} ${view.scale ? state.gain : ""}`,
      old = this.paintings.get(record.name);
    if (old?.key === key) return old.canvas;
    const paint = view.scale ? (pixels) => paint_values(this.numbers_of(record).values, view.scale, state.gain, pixels)
      : (pixels) => paint_channels(images[0], display_tables(images[0], this.display(record), state), pixels);
    const canvas = painted(images[0], paint);
    this.paintings.set(record.name, { key, canvas });
    return canvas;
  }

  display(record) {
    const { mode, layer } = this.comparer.state;
    return (mode === "layer" && layer_of(record, layer)?.display) || "picture";
  }

  /** What stands beside an image's name: its label or, in a view of other numbers, their mean. */
  label(record) {
    const { mode, layer } = this.comparer.state, { view } = this;
    if (mode === "layer") return layer;
    if (mode === "image" || (mode === "error" && record.label)) return record.label;
    const numbers = this.numbers_of(record);
    return numbers ? `${view.label} ${view_number(view, numbers.mean)}` : record.label;
  }

  /** The text below an inset's crop: the mean of the numbers shown, or relMSE under a picture. */
  crop_label(record, rectangle) {
    const { comparer, view } = this, { reference, store } = comparer;
    if (view.values) {
      const numbers = this.numbers_of(record);
      if (!numbers) return "";
      return `${view.label} ${view_number(view, mean_of(numbers.values, comparer.size.width, rectangle), 2)}`;
    }
    if (!reference || comparer.state.mode === "layer") return "";
    if (record === reference) return "reference";
    const image = store.ready(record.image), other = store.ready(reference.image);
    return image && other ? `relMSE ${significant(relative_mse(image, other, rectangle), 2)}` : "";
  }
}
