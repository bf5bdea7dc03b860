import { defineConfig } from "vitest/config";

export default defineConfig({
  test: {
    coverage: {
      include: ["static/**/*.js"],
      exclude: ["static/vendor/**", "static/protocol.js"], // made from three.js and from protocol.py
      reporter: ["text"],
      thresholds: { statements: 85, lines: 85 },
    },
  },
});
