'use strict';
const heightStops = [[72, 35, 116], [63, 74, 138], [47, 108, 142], [33, 144, 141], [53, 183, 121], [134, 206, 76], [225, 205, 40]];
// The colour of a height: red, green and blue from 0 to 1. `share` is 0 at the lowest height and 1 at the highest.
const heightColour = share => {
  const at = Math.min(1, Math.max(0, share)) * (heightStops.length - 1);
  const k = Math.min(heightStops.length - 2, Math.floor(at));
  return heightStops[k].map((low, c) => (low + (heightStops[k + 1][c] - low) * (at - k)) / 255);
};
