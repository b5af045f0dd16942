// The floor below the robots: arena, sites, grid cells, obstacles, objects.

import * as three from "three";
import type { Sample } from "./samples";
import { isShape, type Drawn, type Grid, type Lit, type Scene, type Shape } from "./scene";

const FLOOR = "#b9b9b9";
const OBSTACLE = "#6e5a4a";
const OBJECT = "#e5d8bd";
const OUTLINE = "#404040";
const WALL_CELL = "#7d5a5a";
const EMPTY_CELL = "#c9c9c9";
const EMPTY = [0xc9, 0xc9, 0xc9, 255];

export class Floor {
  readonly group = new three.Group();
  private readonly objects: three.Group[] = [];
  private readonly sites = new three.Group();
  private readonly light: three.Mesh | null = null;
  private cells: Cells | null = null;

  // `lit`: what cells show at a time, where that was recorded.
  constructor(scene: Scene, lit: (timeS: number) => Promise<Lit[]>) {
    this.add(scene.arena, FLOOR, 0);
    if (scene.floor) this.sites.add(picture(scene.floor, three.NearestFilter, 1));
    for (const site of scene.sites) {
      if (isShape(site)) this.sites.add(filled(site, site.colour, 2), outline(site, OUTLINE, 3));
    }
    this.group.add(this.sites);
    if (scene.light) {
      this.light = picture(scene.light, three.LinearFilter, 6);
      this.group.add(this.light);
    }
    if (scene.grid) {
      this.cells = new Cells(scene.grid, scene.sites.map((site) => site.colour), lit);
      this.group.add(this.cells.group);
    }
    for (const obstacle of scene.obstacles) this.add(obstacle, OBSTACLE, 4);
    this.group.add(outline(scene.arena, "#000000", 6));
    for (const parts of scene.objects) {
      const made = new three.Group();
      for (const part of parts) made.add(filled(part, OBJECT, 7), outline(part, OUTLINE, 8));
      made.visible = false;
      this.objects.push(made);
      this.group.add(made);
    }
  }

  // False if nothing has changed that is drawn here.
  show(from: Sample, to: Sample, part: number, timeS: number): boolean {
    const changed = this.cells?.show(timeS) ?? false;
    if (!from.objects || !to.objects) return changed;
    const [a, b] = [from.objects, to.objects];
    this.objects.forEach((made, k) => {
      made.visible = !Number.isNaN(a.x[k]);
      const turn = ((b.heading[k] - a.heading[k] + 98304) % 65536) - 32768;
      made.position.set(a.x[k] + part * (b.x[k] - a.x[k]), a.y[k] + part * (b.y[k] - a.y[k]), 0);
      made.rotation.z = ((a.heading[k] + part * turn) * 2 * Math.PI) / 65536;
    });
    return true;
  }

  showLayers(layers: { cells: boolean; floor: boolean; light: boolean }): void {
    if (this.cells) this.cells.group.visible = layers.cells;
    this.sites.visible = layers.floor;
    if (this.light) this.light.visible = layers.light;
  }

  private add(shape: Shape, colour: string, order: number): void {
    this.group.add(filled(shape, colour, order), outline(shape, OUTLINE, order + 1));
  }
}

// The cells of a Kilogrid, a pixel of a texture each, with lines between modules.
class Cells {
  readonly group = new three.Group();
  private readonly texture: three.DataTexture;
  private shown = -1;
  private asked = -1;
  private waits = false;
  private told = "";

  constructor(
    private readonly grid: Grid,
    private readonly colours: string[],
    private readonly lit: (timeS: number) => Promise<Lit[]>,
  ) {
    const [across, up] = [2 * grid.columns, 2 * grid.rows];
    this.texture = new three.DataTexture(new Uint8Array(4 * across * up), across, up);
    this.texture.magFilter = this.texture.minFilter = three.NearestFilter;
    this.texture.colorSpace = three.SRGBColorSpace;
    const [x, y] = [(across * grid.cell_m) / 2, (up * grid.cell_m) / 2];
    this.group.add(plane([-x, -y, x, y], this.texture, 3), this.lines(x, y));
    this.show(0);
  }

  // The colours that cells have at a time; false if they are those that are shown.
  show(timeS: number): boolean {
    if (this.grid.recorded) this.ask(timeS);
    const number = this.grid.maps.findLastIndex(([atS]) => atS <= timeS);
    if (number === this.shown) return false;
    this.shown = number;
    const data = this.texture.image.data as Uint8Array;
    const sites = this.grid.maps[Math.max(0, number)]?.[1] ?? [];
    const walls = new Set(this.grid.walls);
    for (let cell = 0; cell < data.length / 4; cell++) {
      const site = sites[cell] ?? 0;
      const none = walls.has(cell) ? WALL_CELL : EMPTY_CELL;
      const value = parseInt((site ? this.colours[site - 1] : none).slice(1), 16);
      data.set([value >> 16, (value >> 8) & 255, value & 255, 255], 4 * cell);
    }
    this.texture.needsUpdate = true;
    return true;
  }

  // One answer at a time; what is shown is the last one's.
  private async ask(timeS: number): Promise<void> {
    if (this.asked === timeS || this.waits) return;
    [this.asked, this.waits] = [timeS, true];
    const lit = await this.lit(timeS).catch(() => null);
    this.waits = false;
    if (!lit || (!lit.length && !this.told)) return; // dark, or not recorded
    const told = JSON.stringify(lit);
    if (told === this.told) return;
    this.told = told;
    const data = this.texture.image.data as Uint8Array;
    for (let cell = 0; cell < data.length / 4; cell++) data.set(EMPTY, 4 * cell);
    for (const [cell, colour, brightness] of lit) {
      const value = Math.round(255 * Math.min(1, 0.35 + Math.sqrt(brightness / 255)));
      const part = (bit: number) => (colour & bit ? value : 0);
      data.set([part(1), part(2), part(4), 255], 4 * cell);
    }
    this.texture.needsUpdate = true;
    window.dispatchEvent(new Event("redraw"));
  }

  private lines(x: number, y: number): three.LineSegments {
    const points: number[] = [];
    const step = 2 * this.grid.cell_m;
    for (let k = 1; k < this.grid.columns; k++) points.push(k * step - x, -y, 0, k * step - x, y, 0);
    for (let k = 1; k < this.grid.rows; k++) points.push(-x, k * step - y, 0, x, k * step - y, 0);
    return segments(new Float32Array(points), "#888888", 0.5, 4);
  }
}

function picture(drawn: Drawn, filter: three.MagnificationTextureFilter, order: number): three.Mesh {
  const texture = new three.TextureLoader().load(`data:image/png;base64,${drawn.png}`, () =>
    window.dispatchEvent(new Event("redraw")),
  );
  texture.magFilter = texture.minFilter = filter;
  texture.generateMipmaps = false;
  texture.colorSpace = three.SRGBColorSpace;
  return plane(drawn.box, texture, order);
}

function plane(
  [left, low, right, top]: [number, number, number, number],
  map: three.Texture,
  order: number,
): three.Mesh {
  const made = new three.Mesh(
    new three.PlaneGeometry(right - left, top - low),
    new three.MeshBasicMaterial({ map, transparent: true, depthTest: false }),
  );
  made.position.set((left + right) / 2, (low + top) / 2, 0);
  made.renderOrder = order;
  return made;
}

function path(shape: Shape): three.Shape {
  const made = new three.Shape();
  if ("circle" in shape) {
    const [x, y, radius] = shape.circle;
    made.absarc(x, y, radius, 0, 2 * Math.PI, false);
  } else {
    shape.polygon.forEach(([x, y], k) => (k ? made.lineTo(x, y) : made.moveTo(x, y)));
    made.closePath();
  }
  return made;
}

function filled(shape: Shape, colour: string, order: number): three.Mesh {
  const made = new three.Mesh(
    new three.ShapeGeometry(path(shape), 96),
    new three.MeshBasicMaterial({ color: colour, depthTest: false }),
  );
  made.renderOrder = order;
  return made;
}

function outline(shape: Shape, colour: string, order: number): three.LineLoop {
  const geometry = new three.BufferGeometry().setFromPoints(path(shape).getPoints(96));
  const made = new three.LineLoop(
    geometry,
    new three.LineBasicMaterial({ color: colour, depthTest: false }),
  );
  made.renderOrder = order;
  return made;
}

// Lines between pairs of points, x, y and 0 each.
export function segments(
  points: Float32Array,
  colour: string,
  opacity: number,
  order: number,
): three.LineSegments {
  const geometry = new three.BufferGeometry();
  geometry.setAttribute("position", new three.BufferAttribute(points, 3));
  const made = new three.LineSegments(
    geometry,
    new three.LineBasicMaterial({ color: colour, transparent: true, opacity, depthTest: false }),
  );
  made.renderOrder = order;
  made.frustumCulled = false;
  return made;
}
