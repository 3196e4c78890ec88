// SPDX-License-Identifier: Apache-2.0
// Sums over the cells around a pixel that look like it (filters/guided_cells.h). The first three planes of cells hold
// their guides. Needs pixels.h before it.

#define CELL 4
#define CELL_RADIUS 7  // of the window, in cells
#define BANDWIDTH 0.5f
#define LEAST_SQUARE 1e-4f

// sums[k]: of plane 3 + k, k < n, weighted by likeness to the guide of pixel x, y.
FUNCTION void sum_alike(GLOBAL const float* cells, GLOBAL const float* guide, int x, int y, int width, int height,
                        int n, float* sums) {
  const int columns = (width + CELL - 1) / CELL, rows = (height + CELL - 1) / CELL, i = y * width + x;
  const size_t plane = (size_t)rows * columns;
  const float r = guide[3 * i], g = guide[3 * i + 1], b = guide[3 * i + 2];
  const float bandwidth = square((r + g + b) * (BANDWIDTH / 3)) + LEAST_SQUARE;
  for (int k = 0; k < n; ++k) sums[k] = 0;
  for (int v = max(0, y / CELL - CELL_RADIUS); v <= min(rows - 1, y / CELL + CELL_RADIUS); ++v)
    for (int u = max(0, x / CELL - CELL_RADIUS); u <= min(columns - 1, x / CELL + CELL_RADIUS); ++u) {
      GLOBAL const float* cell = cells + (size_t)v * columns + u;
      const float w = alike(cell[0] - r, cell[plane] - g, cell[2 * plane] - b, bandwidth);
      for (int k = 0; k < n; ++k) sums[k] = fma(w, cell[(3 + k) * plane], sums[k]);
    }
}
