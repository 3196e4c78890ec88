// SPDX-License-Identifier: Apache-2.0
// Draws the panes of a comparer on its canvas.

const LABEL_FONT = "13px system-ui, sans-serif";

/** Draws everything; true when nothing is missing that will still come. */
function draw_stage(comparer) {
  const { canvas, stage, painter } = comparer, ratio = window.devicePixelRatio || 1;
  const width = stage.clientWidth, height = stage.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  let whole = true;
  for (const pane of comparer.panes()) {
    context.save();
    context.beginPath();
    context.rect(pane.clip.x, pane.clip.y, pane.clip.w, pane.clip.h);
    context.clip();
    const picture = painter.painting(pane.image, () => comparer.request_draw());
    if (picture) draw_picture(comparer, context, pane, picture, ratio);
    else whole = draw_waiting(context, pane, painter.failure(pane.image)) && whole;
    draw_label(context, pane, painter.label(pane.image));
    context.restore();
  }
  return whole;
}

function draw_picture(comparer, context, pane, picture, ratio) {
  const { viewport, insets, gestures, state } = comparer;
  const { zoom, x, y } = viewport.resolve(pane, picture);
  const to_x = (image_x) => pane.x + pane.w / 2 + (image_x - x) * zoom;
  const to_y = (image_y) => pane.y + pane.h / 2 + (image_y - y) * zoom;
  context.imageSmoothingEnabled = zoom * ratio < 1;
  context.imageSmoothingQuality = "high";
  context.drawImage(picture, to_x(0), to_y(0), picture.width * zoom, picture.height * zoom);
  const frame = (colour, { x, y, w, h }) => frame_rectangle(context, colour, to_x(x), to_y(y), w * zoom, h * zoom);
  insets.forEach((inset, i) => frame(INSET_COLOURS[i % INSET_COLOURS.length], inset));
  if (gestures.rectangle) frame("#fff", gestures.rectangle);
  const at = state.layout === "grid" && comparer.pointed();
  if (at) draw_cross(context, to_x(at.x + 0.5), to_y(at.y + 0.5));
}

/** Says why there is no picture; true when that will not change. */
function draw_waiting(context, pane, failure) {
  context.fillStyle = "#c9ccd1";
  context.font = LABEL_FONT;
  context.textAlign = "center";
  const { x, y, w, h } = pane.clip;
  context.fillText(failure ?? "Decoding …", x + w / 2, y + h / 2, Math.max(w - 24, 1));
  return Boolean(failure);
}

function draw_label(context, pane, label) {
  const right = pane.side === "b", { name } = pane.image, space = pane.clip.w - 34;
  context.font = `600 ${LABEL_FONT}`;
  const name_width = context.measureText(name).width;
  context.font = LABEL_FONT;
  const label_width = label ? context.measureText(label).width : 0, gap = label ? 10 : 0;
  const below = name_width + gap + label_width > space;  // where both do not fit side by side
  const whole = below ? Math.max(name_width, label_width) : name_width + gap + label_width;
  const width = Math.min(whole, Math.max(space, 1));
  const left = right ? pane.clip.x + pane.clip.w - width - 26 : pane.clip.x + 8;
  context.fillStyle = "rgb(16 17 20 / 78%)";
  context.beginPath();
  context.roundRect(left, pane.clip.y + 8, width + 18, below && label ? 44 : 26, 6);
  context.fill();
  context.textAlign = "left";
  context.textBaseline = "middle";
  context.fillStyle = "#fff";
  context.font = `600 ${LABEL_FONT}`;
  context.fillText(name, left + 9, pane.clip.y + 21.5, width);
  context.fillStyle = "#d5d8dd";
  context.font = LABEL_FONT;
  if (label && below) context.fillText(label, left + 9, pane.clip.y + 39.5, width);
  else if (label) context.fillText(label, left + 9 + name_width + gap, pane.clip.y + 21.5);
  context.textBaseline = "alphabetic";
}
