// Bundles src/ and three into page.js, which cargo uses as it is, so that building the programs needs no npm.
// `--check` tests whether the committed bundle is what the sources give.

import { build } from "esbuild";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { crc32 } from "node:zlib";

const folder = new URL("./", import.meta.url);
const bundle = new URL("page.js", folder);

/** A checksum of the sources, written into the bundle: `cargo test` compares it with the sources. */
function checksumOfSources() {
    const names = readdirSync(new URL("src/", folder)).filter((name) => name.endsWith(".js")).sort();
    const files = [...names.map((name) => `src/${name}`), "package-lock.json"];
    return files.reduce((sum, file) => crc32(readFileSync(new URL(file, folder)), sum), 0);
}

function licenceOfThree() {
    const { version } = JSON.parse(readFileSync(new URL("node_modules/three/package.json", folder)));
    const text = readFileSync(new URL("node_modules/three/LICENSE", folder), "utf8").trim();
    return `three.js ${version}\n\n${text}`;
}

async function bundled() {
    const checksum = checksumOfSources().toString(16).padStart(8, "0");
    const banner = `/*! sources ${checksum}; made by npm run build\n\nHolds ${licenceOfThree()}\n*/`;
    const result = await build({
        entryPoints: [new URL("src/main.js", folder).pathname],
        bundle: true,
        minify: true,
        format: "iife",
        // The version that all browsers with DecompressionStream support.
        target: ["es2022"],
        charset: "utf8",
        legalComments: "none",
        banner: { js: banner },
        write: false,
    });
    return result.outputFiles[0].text;
}

const text = await bundled();
if (process.argv.includes("--check")) {
    if (readFileSync(bundle, "utf8") !== text) {
        console.error("page.js is not what the sources give: npm run build");
        process.exit(1);
    }
    console.log("page.js is what the sources give");
} else {
    writeFileSync(bundle, text);
    console.log(`page.js: ${text.length} bytes`);
}
