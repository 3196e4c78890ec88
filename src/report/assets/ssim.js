// SPDX-License-Identifier: Apache-2.0
// Structural similarity [Wang2004] of two pictures as the screen shows them: luma of their sRGB values at the chosen
// exposure and tone curve, Gaussian window of 11 x 11 pixels, standard deviation 1.5.

const SSIM = { radius: 5, sigma: 1.5, c1: 0.01 ** 2, c2: 0.03 ** 2 };  // K1 = 0.01, K2 = 0.03, L = 1
const LUMA = [0.2126, 0.7152, 0.0722];

/** Luma in [0, 1] of every pixel as shown; not-a-number stays. */
function shown_luma(image, tone, exposure) {
  const n = image.width * image.height, table = tone_table(tone, exposure);
  return Float32Array.from({ length: n }, (_, i) => LUMA.reduce((sum, weight, c) => {
    const bits = image.halves[c * n + i];
    return sum + (is_nan(bits) ? NaN : weight * table[bits] / 255);
  }, 0));
}

/** Gaussian means of a window about each pixel; at the border the weights inside the image are scaled to sum to one. */
function window_means(values, width, height) {
  const { radius, sigma } = SSIM;
  const weights = Float32Array.from({ length: 2 * radius + 1 },
    (_, k) => Math.exp(-((k - radius) ** 2) / (2 * sigma * sigma)));
  const along = (source, length, count, step, stride) => {
    const result = new Float32Array(source.length);
    for (let line = 0; line < count; line++)
      for (let at = 0; at < length; at++) {
        const first = Math.max(at - radius, 0), last = Math.min(at + radius, length - 1);
        let sum = 0, total = 0;
        for (let k = first, i = line * stride + first * step; k <= last; k++, i += step) {
          const weight = weights[k - at + radius];
          sum += weight * source[i];
          total += weight;
        }
        result[line * stride + at * step] = sum / total;
      }
    return result;
  };
  return along(along(values, width, height, 1, width), height, width, width, 1);
}

/** 1 - SSIM of each pixel, from 0 (the same) to 2. */
function dissimilarity(image, reference, { tone, exposure }) {
  const { width, height } = image, { c1, c2 } = SSIM;
  const x = shown_luma(image, tone, exposure), y = shown_luma(reference, tone, exposure);
  const mean = (values) => window_means(values, width, height);
  const mx = mean(x), my = mean(y), xx = mean(x.map((v) => v * v)), yy = mean(y.map((v) => v * v));
  const xy = mean(x.map((v, i) => v * y[i]));
  return xy.map((product, i) => {
    const vx = Math.max(xx[i] - mx[i] * mx[i], 0), vy = Math.max(yy[i] - my[i] * my[i], 0);
    const luminance = (2 * mx[i] * my[i] + c1) / (mx[i] * mx[i] + my[i] * my[i] + c1);
    return 1 - luminance * (2 * (product - mx[i] * my[i]) + c2) / (vx + vy + c2);  // [Wang2004] Eq. (13)
  });
}
