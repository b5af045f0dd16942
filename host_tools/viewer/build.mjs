// Makes the viewer's page, which kilotwin/view/server.py serves. Run from the project's root, with the
// locked packages in build/viewer.

import { copyFile, mkdir } from "node:fs/promises";
import { createRequire } from "node:module";

const packages = `${process.cwd()}/build/viewer/node_modules`;
const { build } = createRequire(`${packages}/`)("esbuild");
const from = "host_tools/viewer";
const page = "host_tools/kilotwin/view/page";
await mkdir(page, { recursive: true });
await build({
  entryPoints: { viewer: `${from}/src/main.ts`, "viewer-style": `${from}/src/viewer.css` },
  outdir: page,
  nodePaths: [packages],
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  logLevel: "warning",
});
await copyFile(`${from}/index.html`, `${page}/index.html`);
