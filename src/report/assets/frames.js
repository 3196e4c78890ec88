// SPDX-License-Identifier: Apache-2.0
// Frames of a sequence, which are the scenes of a comparer: played, or looked for by a slider. View, split and zoom
// stay.

class FramePlayer {
  constructor(comparer) {
    this.comparer = comparer;
    const { scenes } = comparer.block;
    this.button = el("button", { type: "button", title: "Play the frames (K)", click: () => this.toggle() }, "Play");
    this.slider = el("input", { type: "range", min: 0, max: scenes.length - 1, step: 1, "aria-label": "Frame",
      input: () => { this.stop(); this.comparer.show_frame(Number(this.slider.value)); } });
    this.element = el("span", { class: "stops" }, this.button, this.slider);
  }

  show() { this.slider.value = this.comparer.state.scene; }

  toggle() { if (this.playing) this.stop(); else this.play(); }

  stop() {
    this.playing = false;
    this.button.textContent = "Play";
  }

  /** Shows frame after frame, none before it is decoded, and begins again after the last one. */
  async play() {
    const { block, state } = this.comparer, interval = 1000 / block.fps;
    this.playing = true;
    this.button.textContent = "Stop";
    for (let frame = state.scene, due = performance.now(); this.playing;) {
      frame = (frame + 1) % block.scenes.length;
      await this.prepare(frame);
      due = Math.max(due + interval, performance.now());
      await new Promise((resolve) => setTimeout(resolve, due - performance.now()));
      if (this.playing) this.comparer.show_frame(frame);
    }
  }

  /** Decodes what the view shows of a frame. */
  async prepare(frame) {
    const { block, state, painter } = this.comparer, { images } = block.scenes[frame];
    const reference = images.find((image) => image.role === "reference");
    const shown = state.layout === "grid" ? images : [images[state.a], images[state.b]];
    const ids = shown.flatMap((record) => VIEWS[state.mode].ids(record, { reference, layer: state.layer }) ?? []);
    await Promise.all(ids.map((id) => painter.load(id)));
  }
}
