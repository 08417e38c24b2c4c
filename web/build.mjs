// Builds the page that ships in the wheel: `node build.mjs`; `--out FOLDER` builds elsewhere, `--tests` bundles the unit tests.
import { createHash } from "node:crypto";
import { mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join, relative } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const ROOM = dirname(fileURLToPath(import.meta.url));
const PAGE = join(ROOM, "..", "mvcodec", "web_player", "dist");
const TESTS = join(ROOM, "..", "build", "web-tests");

/** What the page is built from: the same list that `tests/test_web_build.py` looks at. */
const SOURCES = ["build.mjs", "package.json", "package-lock.json", "tsconfig.json", "src"];

const SHARED = {
  bundle: true,
  format: "esm",
  target: "es2022",
  loader: { ".glsl": "text", ".css": "text", ".svg": "text" },
  legalComments: "none",
  logLevel: "warning",
};

function filesUnder(path) {
  const whole = join(ROOM, path);
  if (/\.\w+$/.test(path)) return [path];
  return readdirSync(whole, { recursive: true, withFileTypes: true })
    .filter((entry) => entry.isFile())
    .map((entry) => relative(ROOM, join(entry.parentPath ?? entry.path, entry.name)));
}

/** One digest over names and contents, by which a test tells that the page is up to date. */
function digestOfSources() {
  const digest = createHash("sha256");
  for (const name of SOURCES.flatMap(filesUnder).map((path) => path.replaceAll("\\", "/")).sort()) {
    digest.update(`${name}\0`).update(readFileSync(join(ROOM, name))).update("\0");
  }
  return digest.digest("hex");
}

/** The licences of the libraries whose code is in the bundle. */
function licences(metafile) {
  const packages = new Set();
  for (const input of Object.keys(metafile.inputs)) {
    const found = /node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(input);
    if (found) packages.add(found[1]);
  }
  return [...packages].sort().map((name) => {
    const folder = join(ROOM, "node_modules", name);
    const { version, license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
    const file = readdirSync(folder).find((entry) => /^licen[cs]e/i.test(entry));
    const text = file ? readFileSync(join(folder, file), "utf8").trim() : `Licence: ${license}`;
    return `${name} ${version}\n\n${text}\n`;
  }).join(`\n${"-".repeat(72)}\n\n`);
}

async function buildPage(out) {
  rmSync(out, { recursive: true, force: true });
  mkdirSync(out, { recursive: true });
  const result = await build({
    ...SHARED,
    entryPoints: [join(ROOM, "src", "main.ts")],
    outfile: join(out, "player.js"),
    absWorkingDir: ROOM,
    minify: true,
    charset: "utf8",
    metafile: true,
  });
  for (const name of ["index.html", "page.css"]) {
    writeFileSync(join(out, name), readFileSync(join(ROOM, "src", name)));
  }
  writeFileSync(join(out, "licences.txt"), licences(result.metafile));
  writeFileSync(join(out, "sources.sha256"), `${digestOfSources()}\n`);
}

async function bundleTests() {
  const folder = join(ROOM, "test");
  rmSync(TESTS, { recursive: true, force: true });
  const names = readdirSync(folder).filter((name) => name.endsWith(".test.ts"));
  await build({
    ...SHARED,
    entryPoints: names.map((name) => join(folder, name)),
    outdir: TESTS,
    outExtension: { ".js": ".mjs" },
    platform: "node",
    absWorkingDir: ROOM,
  });
}

const [, , flag, value] = process.argv;
if (flag === "--tests") await bundleTests();
else await buildPage(flag === "--out" ? value : PAGE);
