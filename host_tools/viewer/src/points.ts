// A point of the graphics card for each robot, drawn by shaders: what all kinds of them share.

import * as three from "three";

export type Uniforms = Record<string, three.IUniform>;

// The uniforms that each kind of points has, for aim(); `own` come besides.
export function uniformsWith(own: Uniforms): Uniforms {
  return {
    part: { value: 0 },
    pixel: { value: 0.001 },
    ratio: { value: 1 },
    middle: { value: new three.Vector2() },
    scale: { value: new three.Vector2(1, 1) },
    ...own,
  };
}

// `size` points with those attributes; a higher `order` is drawn later.
export function pointsOf(
  attributes: Record<string, three.BufferAttribute>,
  size: number,
  uniforms: Uniforms,
  shaders: { vertexShader: string; fragmentShader: string },
  order: number,
): three.Points {
  const geometry = new three.BufferGeometry();
  geometry.setDrawRange(0, size);
  for (const [name, attribute] of Object.entries(attributes)) {
    geometry.setAttribute(name, attribute);
  }
  const material = new three.RawShaderMaterial({
    glslVersion: three.GLSL3,
    ...shaders,
    uniforms,
    transparent: true,
    depthTest: false,
  });
  const mesh = new three.Points(geometry, material);
  mesh.frustumCulled = false;
  mesh.renderOrder = order;
  return mesh;
}

// Has them drawn as seen from there: the arena's `middle` and scale, metres of a pixel.
export function aim(
  uniforms: Uniforms,
  middle: [number, number],
  scale: [number, number],
  pixelM: number,
): void {
  uniforms.ratio.value = window.devicePixelRatio;
  uniforms.middle.value.set(...middle);
  uniforms.scale.value.set(...scale);
  uniforms.pixel.value = pixelM;
}
