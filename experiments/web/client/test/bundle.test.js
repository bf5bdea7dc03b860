// @ts-nocheck: Node's type declarations are not installed
import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { execPath } from "node:process";
import { gzipSync } from "node:zlib";
import { expect, onTestFinished, test } from "vitest";

const folder = join("static", "vendor");
const bundle = readFileSync(join(folder, "three.js"));

test("building three.js from the locked packages reproduces the committed bundle", () => {
  const fresh = mkdtempSync(join(tmpdir(), "bundle-"));
  onTestFinished(() => rmSync(fresh, { recursive: true }));
  execFileSync(execPath, ["bundle.js", fresh]);
  expect(readFileSync(join(fresh, "three.js")).equals(bundle)).toBe(true);
});

test("the bundle is small, contains its licence, and matches its hash file", () => {
  expect(gzipSync(bundle).length).toBeLessThan(220_000);
  expect(bundle.toString()).toContain("The MIT License");
  const hash = createHash("sha256").update(bundle).digest("hex");
  expect(readFileSync(join(folder, "three.js.sha256"), "utf8")).toBe(`${hash}  three.js\n`);
});
