// Where robots are, as a file that an experiment's `poses = "file.csv"` takes.

import type { Sample } from "./samples";

const TURN = 65536;

// A row for each robot whose place is known, in the order of the samples.
export function posesOf({ x, y, heading }: Sample): string {
  const rows = ["x_m,y_m,heading_rad"];
  for (let k = 0; k < x.length; k++) {
    if (Number.isNaN(x[k]) || Number.isNaN(y[k])) continue;
    const turn = heading[k] < TURN / 2 ? heading[k] : heading[k] - TURN;
    const angle = ((turn / TURN) * 2 * Math.PI).toFixed(5);
    rows.push(`${x[k].toFixed(6)},${y[k].toFixed(6)},${angle}`);
  }
  return rows.join("\n") + "\n";
}
