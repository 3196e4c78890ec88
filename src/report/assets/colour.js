// SPDX-License-Identifier: Apache-2.0
// Half floats to 8-bit colours: the picture itself, the error in false colour, the signed difference.

const ERROR_RANGE = [1e-4, 10];    // relative squared error at both ends of the scale, at gain 0
const DIFFERENCE_RANGE = 0.25;     // relative difference at the ends of the scale, at gain 0
const RELATIVE_OFFSET = 0.01;      // of relMSE
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

const difference_ramp = colour_ramp([NEGATIVE_COLOUR, MIDDLE_COLOUR, POSITIVE_COLOUR]);
let error_ramp = null;
/** `colours`: 0xRRGGBB from no error to the largest. */
function set_error_colours(colours) {
  error_ramp = colour_ramp(colours.map((c) => [c >> 16, (c >> 8) & 255, c & 255]));
}

const linear_to_srgb = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);

/** 8-bit sRGB of every half float times 2^exposure. Values are clamped; not-a-number is found apart. */
const tone_table = (() => {
  let made_for = null, table = null;
  return (exposure) => {
    if (made_for === exposure) return table;
    const scale = 2 ** exposure;
    table = Uint8Array.from(half_values, (v) => Math.round(255 * linear_to_srgb(clamp(v * scale, 0, 1))));
    made_for = exposure;
    return table;
  };
})();

/** Squared error of pixel i relative to the reference, mean of the channels: what relMSE is the mean of. */
function relative_error(image, reference, i) {
  const n = image.width * image.height, F = image.halves, R = reference.halves;
  const r0 = half_values[R[i]], r1 = half_values[R[n + i]], r2 = half_values[R[2 * n + i]];
  const d0 = half_values[F[i]] - r0, d1 = half_values[F[n + i]] - r1, d2 = half_values[F[2 * n + i]] - r2;
  const mean = (r0 + r1 + r2) / 3;
  return (d0 * d0 + d1 * d1 + d2 * d2) / 3 / (mean * mean + RELATIVE_OFFSET);
}

/** Difference of the grey values of pixel i relative to the reference; negative where the image is too dark. */
function relative_difference(image, reference, i) {
  const n = image.width * image.height;
  const grey = ({ halves }) => (half_values[halves[i]] + half_values[halves[n + i]] + half_values[halves[2 * n + i]]) / 3;
  const r = grey(reference);
  return (grey(image) - r) / Math.sqrt(r * r + RELATIVE_OFFSET);
}

function paint_picture(image, exposure, pixels) {
  const n = pixels.length, halves = image.halves, tone = tone_table(exposure);
  const is_nan = (bits) => (bits & 0x7fff) > 0x7c00;
  for (let i = 0; i < n; i++) {
    const r = halves[i], g = halves[n + i], b = halves[2 * n + i];
    pixels[i] = is_nan(r) || is_nan(g) || is_nan(b) ? NOT_A_NUMBER
      : 0xff000000 | (tone[b] << 16) | (tone[g] << 8) | tone[r];
  }
}

function paint_error(image, reference, gain, pixels) {
  const low = Math.log(ERROR_RANGE[0]) - gain * Math.LN2, scale = 255 / Math.log(ERROR_RANGE[1] / ERROR_RANGE[0]);
  for (let i = 0; i < pixels.length; i++) {
    const error = relative_error(image, reference, i);
    pixels[i] = Number.isNaN(error) ? NOT_A_NUMBER : error_ramp[clamp(Math.round((Math.log(error) - low) * scale), 0, 255)];
  }
}

function paint_difference(image, reference, gain, pixels) {
  const scale = (127.5 / DIFFERENCE_RANGE) * 2 ** gain;
  for (let i = 0; i < pixels.length; i++) {
    const difference = relative_difference(image, reference, i);
    pixels[i] = Number.isNaN(difference) ? NOT_A_NUMBER
      : difference_ramp[clamp(Math.round(127.5 + difference * scale), 0, 255)];
  }
}

/** A canvas of the image's size. `mode`: "image", "error" or "difference"; `stops`: exposure or gain. */
function painted(image, reference, mode, stops) {
  const canvas = el("canvas", { width: image.width, height: image.height });
  const context = canvas.getContext("2d");
  const data = context.createImageData(image.width, image.height);
  const pixels = new Uint32Array(data.data.buffer);
  if (mode === "error") paint_error(image, reference, stops, pixels);
  else if (mode === "difference") paint_difference(image, reference, stops, pixels);
  else paint_picture(image, stops, pixels);
  context.putImageData(data, 0, 0);
  return canvas;
}

/** The scale of a view: {colours: CSS gradient, marks: texts evenly spaced, text}; null for the picture itself. */
function scale_of(mode, gain) {
  const css = (ramp) => `linear-gradient(90deg, ${[0, 32, 64, 96, 128, 160, 192, 224, 255].map((i) =>
    `rgb(${ramp[i] & 255} ${(ramp[i] >> 8) & 255} ${(ramp[i] >> 16) & 255})`).join(", ")})`;
  if (mode === "error") {
    const decades = Math.log10(ERROR_RANGE[1] / ERROR_RANGE[0]);
    const marks = Array.from({ length: decades + 1 }, (_, k) => significant(ERROR_RANGE[0] * 10 ** k * 2 ** -gain, gain ? 2 : 1));
    return { colours: css(error_ramp), marks, text: "squared error relative to the reference" };
  }
  if (mode === "difference") {
    const end = DIFFERENCE_RANGE * 2 ** -gain;
    const marks = [-1, -0.5, 0, 0.5, 1].map((t) => `${t > 0 ? "+" : ""}${significant(t * end * 100, 3)} %`);
    return { colours: css(difference_ramp), marks, text: "difference relative to the reference: blue too dark, red too bright" };
  }
  return null;
}
