// SPDX-License-Identifier: Apache-2.0
// The views of an image: the picture, a layer of its file, or one number per pixel on a scale.
//
// A view has `compares` (with the reference), `name`, `key`, `hint`, `words` (in the description), `missing` (what an
// image lacks that has no such view) and
//   ids(record, scene)   the images it is made of, null where one is missing; scene: {reference, layer: name}
//   depends(state)       text of the settings that change what it shows, beside the gain
// and, where it shows numbers, `short` (their name), `label` (of their mean), `scale` (colour.js), `note` and
//   values(images, state)

const RELATIVE_OFFSET = 0.01;  // of relMSE
const SQUARED_SCALE = { low: 1e-4, high: 10, logarithmic: true, ramp: "error" };
const UNIT_SCALE = { low: 0, high: 1, ramp: "error" };
const DIFFERENCE_SCALE = { low: -0.25, high: 0.25, percent: true, ramp: "difference" };

const layer_of = (record, name) => record.layers?.find((layer) => layer.name === name);
const grey = ({ halves }, n, i) =>
  (half_values[halves[i]] + half_values[halves[n + i]] + half_values[halves[2 * n + i]]) / 3;

/** Squared error of pixel i relative to the reference, mean of the channels: what relMSE is the mean of. */
function relative_error(image, reference, i) {
  const n = image.width * image.height, F = image.halves, R = reference.halves;
  let sum = 0;
  for (let k = i; k < 3 * n; k += n) sum += (half_values[F[k]] - half_values[R[k]]) ** 2;
  return sum / 3 / (grey(reference, n, i) ** 2 + RELATIVE_OFFSET);
}

/** The same as the image's standard errors predict it, with the image in place of the reference. */
function predicted_error(image, errors, i) {
  const n = image.width * image.height;
  let sum = 0;
  for (let k = i; k < 3 * n; k += n) sum += half_values[errors.halves[k]] ** 2;
  return sum / 3 / (grey(image, n, i) ** 2 + RELATIVE_OFFSET);
}

/** Difference of the grey values of pixel i relative to the reference; negative where the image is too dark. */
function relative_difference(image, reference, i) {
  const n = image.width * image.height, r = grey(reference, n, i);
  return (grey(image, n, i) - r) / Math.sqrt(r * r + RELATIVE_OFFSET);
}

const every_pixel = (value) => ([image, other]) =>
  Float32Array.from({ length: image.width * image.height }, (_, i) => value(image, other, i));

const beside_reference = (record, { reference }) => reference ? [record.image, reference.image] : null;
const nothing = () => "";

const VIEWS = {
  image: {
    name: "Picture", key: "i", hint: "Picture", words: "picture",
    ids: (record) => [record.image], depends: ({ tone, exposure }) => `${tone} ${exposure}`,
  },
  error: {
    compares: true, name: "Error", key: "x", hint: "Squared error relative to the reference", words: "squared error",
    short: "error", label: "relMSE",
    missing: "no reference", note: "squared error relative to the reference; its mean is relMSE", scale: SQUARED_SCALE,
    ids: beside_reference, depends: nothing, values: every_pixel(relative_error),
  },
  difference: {
    compares: true, name: "Difference", key: "d", hint: "Signed difference from the reference",
    words: "signed difference", short: "difference", label: "mean",
    missing: "no reference", note: "difference relative to the reference: blue too dark, red too bright",
    scale: DIFFERENCE_SCALE, ids: beside_reference, depends: nothing, values: every_pixel(relative_difference),
  },
  flip: {
    compares: true, name: "FLIP", key: "l",
    hint: "FLIP: the difference that is seen when flipping between image and reference",
    words: "FLIP", short: "FLIP", label: "FLIP", missing: "no FLIP",
    note: "HDR-FLIP, 67 pixels per degree: 0 the same, 1 the largest difference",
    scale: UNIT_SCALE, depends: nothing,
    ids(record, { reference }) {
      if (record === reference) return [record.image];
      return reference && record.flip ? [record.image, record.flip] : null;
    },
    values: ([image, map]) => Float32Array.from({ length: image.width * image.height },
      (_, i) => map ? half_values[map.halves[i]] : 0),
  },
  ssim: {
    compares: true, name: "SSIM", key: "m", hint: "Structural dissimilarity, 1 − SSIM, of the pictures as shown",
    words: "1 − SSIM", short: "1 − SSIM", label: "1 − SSIM", missing: "no reference",
    note: "1 − SSIM of the pictures at their exposure and tone curve: 0 the same",
    scale: UNIT_SCALE, ids: beside_reference, depends: ({ tone, exposure }) => `${tone} ${exposure}`,
    values: ([image, reference], state) => dissimilarity(image, reference, state),
  },
  predicted: {
    name: "Predicted", key: "u", hint: "Squared error that the file's standard errors predict",
    words: "predicted error", short: "predicted error", label: "predicted relMSE",
    missing: "no standard errors", scale: SQUARED_SCALE, depends: nothing,
    note: "squared error that the standard errors predict, relative to the image; its mean is the predicted relMSE",
    ids: (record) => layer_of(record, "StdError") ? [record.image, layer_of(record, "StdError").image] : null,
    values: every_pixel(predicted_error),
  },
  layer: {
    words: "layer", missing: "no such layer",
    ids: (record, { layer }) => layer_of(record, layer) ? [layer_of(record, layer).image] : null,
    depends: ({ tone, exposure, layer }) => `${layer} ${tone} ${exposure}`,
  },
};

/** "+1.2 %" or "0.031": a number of a view. */
const view_number = (view, value, digits = 3) =>
  view.scale.percent ? percent_text(value, digits) : significant(value, digits);

/** Mean of the finite values of a rectangle, of all pixels where none is given. */
function mean_of(values, width, { x, y, w, h } = { x: 0, y: 0, w: width, h: values.length / width }) {
  let sum = 0, count = 0;
  for (let j = y; j < y + h; j++)
    for (let i = j * width + x; i < j * width + x + w; i++) if (Number.isFinite(values[i])) sum += values[i], count++;
  return count ? sum / count : NaN;
}
