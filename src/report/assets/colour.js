// SPDX-License-Identifier: Apache-2.0
// Colours of pixels: the picture itself, and numbers on a scale.
//
// A scale is {low, high: values at its ends at gain 0; ramp: name in RAMPS; logarithmic; percent}.

const NOT_A_NUMBER = 0xff00ff00;   // green; colours are 0xAABBGGRR as canvases store them
const NEGATIVE_COLOUR = [33, 102, 172], POSITIVE_COLOUR = [178, 24, 43], MIDDLE_COLOUR = [247, 247, 245];

const packed = (r, g, b) => ((255 << 24) | (b << 16) | (g << 8) | r) >>> 0;

/** 256 colours between evenly spaced ones, each [r, g, b]. */
function colour_ramp(colours) {
  return Uint32Array.from({ length: 256 }, (_, i) => {
    const at = (i / 255) * (colours.length - 1), k = Math.min(Math.floor(at), colours.length - 2), t = at - k;
    return packed(...[0, 1, 2].map((c) => Math.round(colours[k][c] * (1 - t) + colours[k + 1][c] * t)));
  });
}

const RAMPS = { error: null, difference: colour_ramp([NEGATIVE_COLOUR, MIDDLE_COLOUR, POSITIVE_COLOUR]) };
/** `colours`: 0xRRGGBB from no error to the largest. */
function set_error_colours(colours) {
  RAMPS.error = colour_ramp(colours.map((c) => [c >> 16, (c >> 8) & 255, c & 255]));
}

/** Value to place on the scale: 0 at its low end, 1 at its high end; `gain` in stops. */
function scale_position({ low, high, logarithmic }, gain) {
  const factor = 2 ** gain;
  if (logarithmic) return (v) => Math.log(v * factor / low) / Math.log(high / low);
  return (v) => (v * factor - low) / (high - low);
}

/** The values at `n` places from one end of the scale to the other. */
function scale_values({ low, high, logarithmic }, gain, n) {
  return Array.from({ length: n }, (_, k) => {
    const t = k / (n - 1);
    return (logarithmic ? low * (high / low) ** t : low + t * (high - low)) * 2 ** -gain;
  });
}

/** Texts of the scale's marks, evenly spaced. */
function scale_marks(scale, gain) {
  const n = scale.logarithmic ? Math.round(Math.log10(scale.high / scale.low)) + 1 : 5;
  return scale_values(scale, gain, n).map((v) => (scale.percent ? percent_text(v) : short_text(v, 2)));
}

function css_ramp(ramp) {
  const css = (c) => `rgb(${c & 255} ${(c >> 8) & 255} ${(c >> 16) & 255})`;
  const colours = [0, 32, 64, 96, 128, 160, 192, 224, 255].map((i) => css(RAMPS[ramp][i]));
  return `linear-gradient(90deg, ${colours.join(", ")})`;
}

function paint_values(values, scale, gain, pixels) {
  const place = scale_position(scale, gain), ramp = RAMPS[scale.ramp];
  for (let i = 0; i < pixels.length; i++)
    pixels[i] = Number.isNaN(values[i]) ? NOT_A_NUMBER : ramp[clamp(Math.round(place(values[i]) * 255), 0, 255)];
}

/** `byte_of`: for each channel, 8 bits of every half float. */
function paint_channels({ halves }, byte_of, pixels) {
  const n = pixels.length, last = halves.length / n - 1;  // grey images have one channel
  const channel = (c) => halves.subarray(Math.min(c, last) * n);
  const [red, green, blue] = [0, 1, 2].map(channel);
  for (let i = 0; i < n; i++) {
    const r = red[i], g = green[i], b = blue[i];
    pixels[i] = is_nan(r) || is_nan(g) || is_nan(b) ? NOT_A_NUMBER
      : 0xff000000 | (byte_of[2][b] << 16) | (byte_of[1][g] << 8) | byte_of[0][r];
  }
}

/** Directions, each component from -1 (black) to 1 (white). */
const direction_table = () => Uint8Array.from(half_values, (v) => Math.round(127.5 * (clamp(v, -1, 1) + 1)));

/** From black at the smallest to white at the largest finite value of a channel. */
function range_table(plane) {
  let low = Infinity, high = -Infinity;
  for (const bits of plane) {
    const v = half_values[bits];
    if (Number.isFinite(v)) low = Math.min(low, v), high = Math.max(high, v);
  }
  const scale = high > low ? 255 / (high - low) : 0;
  return Uint8Array.from(half_values, (v) => clamp(Math.round((v - low) * scale), 0, 255));
}

/** Tables for paint_channels: `display` of a layer (docs/report.md), "picture" for images. */
function display_tables(image, display, { tone, exposure }) {
  if (display === "range") {
    const n = image.width * image.height;
    return [0, 1, 2].map((c) => Math.min(c, image.channels - 1)).map((c) =>
      range_table(image.halves.subarray(c * n, (c + 1) * n)));
  }
  const table = display === "direction" ? direction_table() : tone_table(tone, exposure);
  return [table, table, table];
}

/** A canvas of this size, coloured by `paint(pixels)`. */
function painted({ width, height }, paint) {
  const canvas = el("canvas", { width, height }), context = canvas.getContext("2d");
  const data = context.createImageData(width, height);
  paint(new Uint32Array(data.data.buffer));
  context.putImageData(data, 0, 0);
  return canvas;
}
