// SPDX-License-Identifier: Apache-2.0
// A figure as papers print it: the whole picture with framed insets at the left, the insets of all images at the right,
// names above and errors below each crop. A PNG with a white ground.

const FIGURE = { scale: 2, crop: 150, gap: 6, line: 18, font: "system-ui, 'Helvetica Neue', Arial, sans-serif" };

/** The canvas of the figure. `picture`: painting of the image at the left; `rows`: as of InsetStrip.rows(). */
function draw_figure(picture, name, images, rows) {
  const { scale, crop, gap, line } = FIGURE;
  const heights = rows.map(({ inset }) => (crop * inset.h) / inset.w);
  const rows_height = heights.reduce((sum, h) => sum + h + line + gap, 0);
  const left_height = rows.length ? Math.max(rows_height - line - gap, crop * 1.5) : 480;
  const left_width = (left_height * picture.width) / picture.height;
  const width = left_width + (rows.length ? (gap + crop) * images.length : 0);
  const height = line + Math.max(left_height + 2 * line, rows_height + line) + gap;
  const canvas = el("canvas", { width: Math.ceil(width * scale), height: Math.ceil(height * scale) });
  const context = canvas.getContext("2d");
  context.scale(scale, scale);
  context.fillStyle = "#fff";
  context.fillRect(0, 0, width, height);

  const text = (words, x, y, space, bold) => {
    context.fillStyle = "#111";
    context.textAlign = "center";
    context.font = `${bold ? 600 : 400} 12px ${FIGURE.font}`;
    context.fillText(words, x + space / 2, y + 13, space);
  };
  const paste = (source, x, y, w, h) => {
    context.imageSmoothingEnabled = source.width > w * scale;
    context.imageSmoothingQuality = "high";
    context.drawImage(source, x, y, w, h);
  };

  text(name, 0, 0, left_width, true);
  paste(picture, 0, line, left_width, left_height);
  const zoom = left_width / picture.width;
  for (const { inset, colour } of rows)
    frame_rectangle(context, colour, inset.x * zoom, line + inset.y * zoom, inset.w * zoom, inset.h * zoom);
  images.forEach((image, k) => {
    const x = left_width + gap + k * (crop + gap);
    let y = line;
    if (!rows.length) return;
    text(image.name, x, 0, crop, true);
    rows.forEach(({ colour, crops }, i) => {
      if (crops[k].canvas) paste(crops[k].canvas, x, y, crop, heights[i]);
      context.lineWidth = 2;
      context.strokeStyle = colour;
      context.strokeRect(x + 1, y + 1, crop - 2, heights[i] - 2);
      text(image.role === "reference" ? "" : crops[k].label, x, y + heights[i], crop);
      y += heights[i] + line + gap;
    });
    text(image.label ?? "", x, y - gap, crop, true);
  });
  return canvas;
}

/** Draws the comparer's figure and offers it as a file. */
async function save_figure(comparer) {
  const { images, state, scene, painter } = comparer;
  const rows = await comparer.strip.rows();
  const record = images[state.a];
  const picture = painter.painting(record);
  if (!picture) throw new Error(painter.failure(record));
  const canvas = draw_figure(picture, `${scene.name}: ${record.name}`, images, rows);
  const blob = await new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
  download(blob, `${file_name(scene.name)}-${state.mode}.png`);
}
