// SPDX-License-Identifier: Apache-2.0
// Pointer, wheel and keyboard on the stage.

const PAN_STEP = 60;         // screen pixels per arrow key
const WHEEL_RATE = 0.0016;   // of the logarithm of the zoom, per wheel pixel
const LEAST_INSET = 4;       // image pixels

class Gestures {
  constructor(comparer) {
    this.comparer = comparer;
    this.rectangle = null;     // the inset being drawn, in image pixels
    this.drawing = false;
    this.touches = new Map();  // pointer id -> {px, py}
    const { canvas, stage, element } = comparer;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => this.up(event));
    canvas.addEventListener("pointerleave", () => this.point(null));
    canvas.addEventListener("dblclick", (event) => this.zoom(2, this.place(event)));
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    element.addEventListener("pointerenter", () => { Gestures.hovered = this; });
    element.addEventListener("pointerleave", () => { if (Gestures.hovered === this) Gestures.hovered = null; });
    const { handle } = comparer.controls;
    handle.addEventListener("pointerdown", (event) => handle.setPointerCapture(event.pointerId));
    handle.addEventListener("pointermove", (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      const box = stage.getBoundingClientRect();
      comparer.update({ split: (event.clientX - box.left) / box.width });
    });
    Gestures.all.push(this);
  }

  place(event) {
    const box = this.comparer.canvas.getBoundingClientRect();
    return { px: event.clientX - box.left, py: event.clientY - box.top };
  }

  point(place) {
    this.comparer.pointer = place;
    if (this.comparer.state.layout === "grid") this.comparer.request_draw();
    else this.comparer.readout.show_pixel();
  }

  zoom(factor, { px, py }) {
    const { comparer } = this, pane = comparer.pane_at(px, py);
    if (!pane) return;
    comparer.viewport.zoom_about(pane, comparer.size, factor, px, py);
    comparer.update();
  }

  /** Zooms where the stage has the focus; elsewhere the page scrolls. */
  wheel(event) {
    const { comparer } = this;
    if (!event.ctrlKey && document.activeElement !== comparer.canvas && !document.fullscreenElement) return;
    event.preventDefault();
    const pixels = event.deltaY * (event.deltaMode === 1 ? 30 : 1);
    this.zoom(Math.exp(-pixels * WHEEL_RATE), this.place(event));
  }

  // ---- pointers ---------------------------------------------------------------------------------------------------

  down(event) {
    const place = this.place(event);
    this.comparer.canvas.focus({ preventScroll: true });
    this.comparer.canvas.setPointerCapture(event.pointerId);
    this.touches.set(event.pointerId, place);
    if (this.drawing) this.start = this.image_place(place);
    this.point(place);
  }

  move(event) {
    const { comparer } = this, place = this.place(event), before = this.touches.get(event.pointerId);
    if (before && this.drawing) {
      this.rectangle = spanned(this.start, this.image_place(place), comparer.size);
      comparer.request_draw();
    } else if (before && this.touches.size === 2) {
      const [other] = [...this.touches].filter(([id]) => id !== event.pointerId).map(([, p]) => p);
      const distance = (p) => Math.hypot(p.px - other.px, p.py - other.py);
      this.zoom(distance(place) / Math.max(distance(before), 1),
        { px: (place.px + other.px) / 2, py: (place.py + other.py) / 2 });
    } else if (before && !(event.pointerType === "touch" && comparer.viewport.is_fit)) {
      const pane = comparer.pane_at(place.px, place.py) ?? comparer.panes()[0];
      comparer.viewport.pan(pane, comparer.size, place.px - before.px, place.py - before.py);
      comparer.update();
    }
    if (before) this.touches.set(event.pointerId, place);
    this.point(place);
  }

  up(event) {
    this.touches.delete(event.pointerId);
    if (!this.drawing || !this.start) return;
    const { rectangle } = this;
    if (rectangle && rectangle.w >= LEAST_INSET && rectangle.h >= LEAST_INSET) {
      this.toggle_drawing();
      this.comparer.add_inset(rectangle);
    } else {
      this.rectangle = this.start = null;
    }
  }

  image_place({ px, py }) {
    const { comparer } = this, pane = comparer.pane_at(px, py) ?? comparer.panes()[0];
    return comparer.viewport.to_image(pane, comparer.size, px, py);
  }

  /** Starts or ends the drawing of an inset. */
  toggle_drawing() {
    const { comparer } = this;
    this.drawing = !this.drawing;
    this.rectangle = this.start = null;
    comparer.stage.classList.toggle("drawing", this.drawing);
    comparer.controls.inset.setAttribute("aria-pressed", String(this.drawing));
    if (this.drawing) comparer.readout.say("Drag over the picture, or press Enter for its middle.");
    comparer.request_draw();
  }

  /** The inset that a keyboard makes: the middle quarter of what the first pane shows. */
  middle_inset() {
    const { comparer } = this, pane = comparer.panes()[0];
    const { zoom, x, y } = comparer.viewport.resolve(pane, comparer.size);
    const w = Math.min(pane.w / zoom, comparer.size.width) / 4, h = Math.min(pane.h / zoom, comparer.size.height) / 4;
    return { x: x - w / 2, y: y - h / 2, w, h };
  }

  // ---- keys -------------------------------------------------------------------------------------------------------

  /** Does what the key says; false for keys without a meaning. */
  key(event) {
    const { comparer } = this, { state, controls } = comparer;
    const digit = /^(?:Digit|Numpad)(\d)$/.exec(event.code);
    if (digit && !(event.code.startsWith("Numpad") && !/\d/.test(event.key))) {
      const right = event.shiftKey || (state.layout === "split" && comparer.pointed()?.pane.side === "b");
      controls.choose((Number(digit[1]) + 9) % 10, right);
      return true;
    }
    const pan = (dx, dy) => {
      comparer.viewport.pan(comparer.panes()[0], comparer.size, dx * PAN_STEP, dy * PAN_STEP);
      comparer.update();
    };
    const layout = (name) => comparer.update({ layout: state.layout === name ? "single" : name });
    const stops = (step) => controls.set_stops(comparer.stops + step);
    const actions = {
      " ": () => comparer.update({ a: state.b, b: state.a }),
      s: () => layout("split"), g: () => layout("grid"),
      v: () => controls.next_layer(event.shiftKey ? -1 : 1), t: () => controls.next_tone(),
      h: () => controls.toggle_histogram(),
      e: () => stops(event.shiftKey ? -0.5 : 0.5), r: () => controls.set_stops(0),
      "+": () => controls.zoom(2), "=": () => controls.zoom(2), "-": () => controls.zoom(0.5),
      "−": () => controls.zoom(0.5),
      f: () => controls.fit(), o: () => controls.one_to_one(),
      arrowleft: () => pan(1, 0), arrowright: () => pan(-1, 0), arrowup: () => pan(0, 1), arrowdown: () => pan(0, -1),
      "[": () => comparer.update({ split: state.split - 0.02 }),
      "]": () => comparer.update({ split: state.split + 0.02 }),
      n: () => this.toggle_drawing(), k: () => controls.player?.toggle(),
      p: () => controls.save(), "?": () => controls.help.showModal(),
    };
    for (const mode of VIEW_BUTTONS) actions[VIEWS[mode].key] = () => comparer.update({ mode });
    if (this.drawing) {
      actions.escape = () => this.toggle_drawing();
      actions.enter = () => { this.toggle_drawing(); comparer.add_inset(this.middle_inset()); };
    }
    const action = actions[event.key.toLowerCase()];
    action?.();
    return Boolean(action);
  }
}

Gestures.all = [];
Gestures.hovered = null;

/** The rectangle of whole pixels between two places, inside the image. */
function spanned(from, to, size) {
  const low = (a, b) => Math.max(Math.floor(Math.min(a, b)), 0);
  const x = low(from.x, to.x), y = low(from.y, to.y);
  const right = Math.min(Math.ceil(Math.max(from.x, to.x)), size.width);
  const bottom = Math.min(Math.ceil(Math.max(from.y, to.y)), size.height);
  return { x, y, w: right - x, h: bottom - y };
}

/** Whose keys they are where nothing has the focus: of the comparer under the pointer, or the only one in sight. */
function comparer_in_sight() {
  if (Gestures.hovered) return Gestures.hovered;
  const seen = Gestures.all.filter(({ comparer }) => {
    const { top, bottom } = comparer.stage.getBoundingClientRect();
    return top < window.innerHeight && bottom > 0;
  });
  return seen.length === 1 ? seen[0] : null;
}

// A key goes to the comparer that has the focus or, where nothing has it, the one in sight. On buttons the space bar
// presses them, and in form fields all keys are theirs. Keys that scroll the page need the focus or the pointer.
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
  const { target } = event;
  if (target.closest("select, dialog, input:not([type=range])")) return;
  if (target.closest("input") && event.key.startsWith("Arrow")) return;
  if (target.closest("button, summary, a") && [" ", "Enter"].includes(event.key)) return;
  const focused = Gestures.all.find((g) => g.comparer.element.contains(target));
  const scrolls = event.key === " " || event.key.startsWith("Arrow");
  const gestures = focused ?? (target !== document.body ? null : scrolls ? Gestures.hovered : comparer_in_sight());
  if (gestures?.key(event)) event.preventDefault();
});
