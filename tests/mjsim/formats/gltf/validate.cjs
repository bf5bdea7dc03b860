// Prints the errors and warnings of GLB files, a list for each.
const { readFileSync } = require("node:fs");
const { validateBytes } = require("gltf-validator");

const HINT = 2; // severity from which issues are only remarks
const check = async (path) => {
  const { issues } = await validateBytes(new Uint8Array(readFileSync(path)));
  return issues.messages.filter(({ severity }) => severity < HINT);
};
Promise.all(process.argv.slice(2).map(check)).then((found) => console.log(JSON.stringify(found)));
