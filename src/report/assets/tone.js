// SPDX-License-Identifier: Apache-2.0
// Tone curves, for each channel alone: linear light in, light of the screen in [0, 1] out, before the encoding of sRGB.

const TONES = {
  srgb: { name: "sRGB", hint: "Values above 1 are white", curve: (v) => v },
  reinhard: { name: "Reinhard", hint: "v / (1 + v)", curve: (v) => v / (1 + v) },  // [Reinhard2002] Eq. (3)
  // The rational approximation that HDR-FLIP uses, too (src/metrics/flip.cpp), [Andersson2021].
  aces: { name: "ACES", hint: "Approximation of the ACES film curve",
    curve: (v) => (0.9036 * v * v + 0.018 * v) / (0.8748 * v * v + 0.354 * v + 0.14) },
};

const linear_to_srgb = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);

/** sRGB in [0, 1] of a linear value: negative ones are black, infinity is white. */
function displayed(value, tone, scale) {
  if (!(value > 0)) return 0;
  return value === Infinity ? 1 : linear_to_srgb(clamp(TONES[tone].curve(value * scale), 0, 1));
}

/** 8-bit sRGB of every half float times 2^exposure; not-a-number has no meaning here. */
const tone_table = (() => {
  let made_for = null, table = null;
  return (tone, exposure) => {
    const key = `${tone} ${exposure}`;
    if (made_for === key) return table;
    const scale = 2 ** exposure;
    table = Uint8Array.from(half_values, (v) => Math.round(255 * displayed(v, tone, scale)));
    made_for = key;
    return table;
  };
})();
