// A measuring tape between two places, or robots: it follows these as they go.

// A robot's place in a sample, or where on the table, m.
type End = number | [number, number];

export class Tape {
  on = false;
  private ends: End[] = [];

  toggle(): void {
    this.on = !this.on;
    this.ends = [];
  }

  // The first end, then the second; a third one begins anew.
  put(end: End): void {
    this.ends = this.ends.length === 1 ? [this.ends[0], end] : [end];
  }

  // `placeOf`: where a robot is, m; `pixelOf`: where that is in the picture.
  draw(
    context: CanvasRenderingContext2D,
    placeOf: (robot: number) => [number, number],
    pixelOf: (x: number, y: number) => [number, number],
  ): void {
    const places = this.ends.map((end) => (typeof end === "number" ? placeOf(end) : end));
    const pixels = places.map(([x, y]) => pixelOf(x, y));
    if (!this.on || !pixels.length) return;
    const [from, to] = [pixels[0], pixels.at(-1)!];
    for (const [width, colour] of [[4, "#fff"], [2, "#d55e00"]] as const) {
      context.lineWidth = width;
      context.strokeStyle = colour;
      context.beginPath();
      for (const [x, y] of pixels) {
        context.moveTo(x + 4, y);
        context.arc(x, y, 4, 0, 2 * Math.PI);
      }
      context.moveTo(...from);
      context.lineTo(...to);
      context.stroke();
    }
    if (places.length < 2) return;
    const text = lengthOf(places[0], places[1]);
    const middle = [(from[0] + to[0]) / 2, (from[1] + to[1]) / 2 - 8] as const;
    document.body.dataset.measured = text;
    context.font = "bold 13px system-ui, sans-serif";
    context.textAlign = "center";
    context.lineWidth = 4;
    context.strokeStyle = "#fff";
    context.strokeText(text, ...middle);
    context.fillStyle = "#000";
    context.fillText(text, ...middle);
  }
}

function lengthOf([x, y]: [number, number], [toX, toY]: [number, number]): string {
  return `${(1000 * Math.hypot(toX - x, toY - y)).toFixed(1)} mm`;
}
