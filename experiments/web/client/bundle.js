// Makes static/vendor/three.js: what the client uses of three.js, in one file, with its licence and SHA-256.
// `node bundle.js FOLDER` writes into another folder.

import { createHash } from "node:crypto";
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { argv } from "node:process";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = fileURLToPath(new URL(".", import.meta.url));
const folder = argv[2] ?? join(here, "static", "vendor");
const read = (/** @type {string} */ name) => readFile(join(here, "node_modules", "three", name), "utf8");
const { version } = JSON.parse(await read("package.json"));
const { outputFiles: [bundle] } = await build({
  absWorkingDir: here,
  entryPoints: ["bundle_parts.js"],
  bundle: true,
  minify: true,
  write: false,
  format: "esm",
  target: "es2022",
  legalComments: "none",
  banner: { js: `/*!\nthree.js ${version}, the parts that this client uses.\n\n${(await read("LICENSE")).trim()}\n*/` },
});
await mkdir(folder, { recursive: true });
await writeFile(join(folder, "three.js"), bundle.contents);
const hash = createHash("sha256").update(bundle.contents).digest("hex");
await writeFile(join(folder, "three.js.sha256"), `${hash}  three.js\n`);
