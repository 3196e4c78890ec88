// SPDX-License-Identifier: Apache-2.0
// Images of the page: decoded from their text blocks when first needed, and kept while memory allows.

const CACHE_BYTES = 384e6;

/** Half-float bits to numbers. */
const half_values = (() => {
  const values = new Float32Array(65536);
  for (let bits = 0; bits < 65536; bits++) {
    const exponent = (bits >> 10) & 31, fraction = bits & 1023;
    const size = exponent === 31 ? (fraction ? NaN : Infinity)
      : exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15);
    values[bits] = bits >> 15 ? -size : size;
  }
  return values;
})();

function base64_bytes(text) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return bytes;
}

const is_nan = (bits) => (bits & 0x7fff) > 0x7c00;

/** Undoes predicted_halves() of src/report/image_block.h: a plane of half-float bits for each channel. */
function unpredicted(bytes, width, height, channels) {
  const plane = width * height, n = plane * channels;
  const halves = new Uint16Array(n);
  let row = new Int16Array(width), above = new Int16Array(width);
  let i = 0;
  for (let channel = 0; channel < channels; channel++)
    for (let y = 0; y < height; y++) {
      for (let x = 0; x < width; x++, i++) {
        const z = (bytes[i] << 8) | bytes[n + i];
        const suggested = x > 0 && y > 0 ? (row[x - 1] + above[x]) >> 1 : x > 0 ? row[x - 1] : y > 0 ? above[x] : 0;
        row[x] = suggested + (z & 1 ? -(z + 1) >> 1 : z >> 1);
        halves[i] = row[x] + (channel > 0 ? halves[i - plane] : 0);
      }
      [row, above] = [above, row];
    }
  return halves;
}

const ARRIVAL_CHECK = 50;  // milliseconds

class ImageStore {
  /** `sizes`: id -> [width, height, channels], known before the images have arrived. */
  constructor(sizes) {
    this.sizes = sizes;
    this.cache = new Map();  // id -> promise of an image; the least recently used first
    this.loaded = new Map();  // id -> image
  }

  /** The promise of {id, width, height, channels, halves}; `halves`: the channels' planes of half-float bits. */
  load(id) {
    const promise = this.cache.get(id) ?? this.decode(id);
    this.cache.delete(id);
    this.cache.set(id, promise);
    return promise;
  }

  /** The image where it is decoded already. */
  ready(id) { return this.loaded.get(id); }

  async decode(id) {
    let block = this.find(id);
    while (document.readyState === "loading" && !block?.nextElementSibling) {  // the page is still arriving
      await new Promise((resolve) => setTimeout(resolve, ARRIVAL_CHECK));
      block = this.find(id);
    }
    if (!block) throw new Error(`The page lacks the image '${id}'.`);
    const [width, height, channels] = this.sizes[id];
    const stream = new Blob([base64_bytes(block.textContent)]).stream().pipeThrough(new DecompressionStream("deflate"));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    const image = { id, width, height, channels, halves: unpredicted(bytes, width, height, channels) };
    this.loaded.set(id, image);
    this.drop_old(id);
    return image;
  }

  find(id) { return document.querySelector(`script[data-image="${CSS.escape(id)}"]`); }

  drop_old(newest) {
    let bytes = 0;
    for (const image of this.loaded.values()) bytes += image.halves.byteLength;
    for (const id of [...this.cache.keys()]) {
      if (bytes <= CACHE_BYTES) return;
      const image = this.loaded.get(id);
      if (!image || id === newest) continue;
      bytes -= image.halves.byteLength;
      this.loaded.delete(id);
      this.cache.delete(id);
    }
  }
}

/** The values of a pixel's channels. */
function pixel_of(image, x, y) {
  const n = image.width * image.height, i = y * image.width + x;
  return Array.from({ length: image.channels }, (_, c) => half_values[image.halves[c * n + i]]);
}

/** Mean relMSE of a rectangle, over its pixels that are finite in both images. */
function relative_mse(image, reference, { x, y, w, h }) {
  let sum = 0, count = 0;
  for (let j = y; j < y + h; j++)
    for (let i = x; i < x + w; i++) {
      const error = relative_error(image, reference, j * image.width + i);
      if (Number.isFinite(error)) sum += error, count++;
    }
  return count ? sum / count : NaN;
}
