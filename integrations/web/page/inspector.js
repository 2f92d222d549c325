// Slices of a grid as pictures: the occluded fraction, and the direction of the occlusion.

import { channelValue, fraction } from './aogrid/grid.js';

/** The axes of a slice across each axis, to the right and upwards. */
const SIDES = [[2, 1], [0, 2], [0, 1]];

/** Draws the slice `idx` across an axis. */
export function drawSlice(grid, across, idx, fractionCanvas, axisCanvas) {
  const [right, up] = SIDES[across];
  const width = grid.resolution[right];
  const height = grid.resolution[up];
  const [fractions, axes] = [fractionCanvas, axisCanvas].map((canvas) => {
    canvas.width = width;
    canvas.height = height;
    canvas.style.aspectRatio = `${width} / ${height}`;
    return new ImageData(width, height);
  });
  const cell = [0, 0, 0];
  cell[across] = idx;
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      cell[right] = x;
      // z points towards the viewer from above, so that it runs downwards there.
      cell[up] = across === 1 ? y : height - 1 - y;
      const at = (cell[2] * grid.resolution[1] + cell[1]) * grid.resolution[0] + cell[0];
      const light = 255 * (1 - fraction(grid, at));
      const color = [0, 1, 2].map((channel) => 127.5 + 127.5 * channelValue(grid, at, channel));
      fractions.data.set([light, light, light, 255], 4 * (y * width + x));
      axes.data.set([...color, 255], 4 * (y * width + x));
    }
  }
  fractionCanvas.getContext('2d').putImageData(fractions, 0, 0);
  axisCanvas.getContext('2d').putImageData(axes, 0, 0);
}
