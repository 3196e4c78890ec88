// SPDX-License-Identifier: Apache-2.0
// Which part of an image a pane shows. All panes of a comparer share one viewport, so that they zoom and pan together.

const MOST_ZOOM = 128;  // screen pixels per image pixel

class Viewport {
  constructor() { this.fit(); }

  /** The whole image. */
  fit() { this.zoom = null; this.x = this.y = null; }

  get is_fit() { return this.zoom === null; }

  /** {zoom, x, y} for a pane and an image: screen pixels per image pixel, image position in the middle. */
  resolve(pane, image) {
    const fit = Math.min(pane.w / image.width, pane.h / image.height);
    const zoom = this.zoom === null ? fit : clamp(this.zoom, Math.min(fit, 1) / 4, MOST_ZOOM);
    return { zoom, x: this.x ?? image.width / 2, y: this.y ?? image.height / 2 };
  }

  to_image(pane, image, px, py) {
    const { zoom, x, y } = this.resolve(pane, image);
    return { x: x + (px - pane.x - pane.w / 2) / zoom, y: y + (py - pane.y - pane.h / 2) / zoom };
  }

  pan(pane, image, dx, dy) {
    const { zoom, x, y } = this.resolve(pane, image);
    this.set(zoom, x - dx / zoom, y - dy / zoom, image);
  }

  /** Zooms so that what lies under (px, py) stays there. */
  zoom_about(pane, image, factor, px = pane.x + pane.w / 2, py = pane.y + pane.h / 2) {
    const fixed = this.to_image(pane, image, px, py);
    this.zoom = this.resolve(pane, image).zoom * factor;
    const { zoom } = this.resolve(pane, image);
    this.set(zoom, fixed.x - (px - pane.x - pane.w / 2) / zoom, fixed.y - (py - pane.y - pane.h / 2) / zoom, image);
  }

  set(zoom, x, y, image) {
    this.zoom = zoom;
    this.x = clamp(x, 0, image.width);
    this.y = clamp(y, 0, image.height);
  }
}

/** The panes of a layout on a stage: {x, y, w, h, clip, image}; `clip` is the part of the pane that is drawn. */
function layout_panes(stage, state, images) {
  const whole = { x: 0, y: 0, w: stage.width, h: stage.height };
  if (state.layout === "split") {
    const cut = Math.round(stage.width * state.split);
    return [
      { ...whole, clip: { ...whole, w: cut }, image: images[state.a], side: "a" },
      { ...whole, clip: { ...whole, x: cut, w: stage.width - cut }, image: images[state.b], side: "b" },
    ];
  }
  if (state.layout === "grid") {
    const columns = best_columns(stage, images.length, state.aspect), rows = Math.ceil(images.length / columns);
    const w = stage.width / columns, h = stage.height / rows;
    return images.map((image, i) => {
      const cell = { x: (i % columns) * w, y: Math.floor(i / columns) * h, w: w - 2, h: h - 2 };
      return { ...cell, clip: cell, image };
    });
  }
  return [{ ...whole, clip: whole, image: images[state.a], side: "a" }];
}

/** The height of a stage of this width that its panes fill, `most` where that is less. */
function natural_height(width, most, layout, n, aspect) {
  if (layout !== "grid") return Math.min(width / aspect, most);
  const columns = best_columns({ width, height: most }, n, aspect);
  return Math.min(Math.ceil(n / columns) * (width / columns / aspect), most);
}

/** The number of columns with which `n` images of this aspect are largest. */
function best_columns(stage, n, aspect) {
  let best = 1, best_width = 0;
  for (let columns = 1; columns <= n; columns++) {
    const rows = Math.ceil(n / columns);
    const width = Math.min(stage.width / columns, (stage.height / rows) * aspect);
    if (width > best_width * 1.001) best = columns, best_width = width;
  }
  return best;
}
