// Reads the maps that build_map has written beside the page.

import { readFileSync } from "node:fs";
import { dirname, join } from "node:path";

export function readMaps(pageFile) {
    const folder = dirname(pageFile);
    const json = (name) => JSON.parse(readFileSync(join(folder, name), "utf8"));
    return {
        planes: json("planes.json").planes,
        objects: json("objects.json").objects,
        report: json("report.json"),
        cloud: readPly(join(folder, "cloud.ply")),
    };
}

/** Points of a binary PLY with x y z as floats at the beginning of each vertex. */
function readPly(file) {
    const bytes = readFileSync(file);
    const end = bytes.indexOf("end_header\n") + "end_header\n".length;
    const header = bytes.toString("latin1", 0, end);
    const count = Number(/element vertex (\d+)/.exec(header)[1]);
    const sizes = { float: 4, float32: 4, uchar: 1, uint8: 1 };
    const properties = [...header.matchAll(/property (\w+) (\w+)/g)];
    const stride = properties.reduce((sum, [, type]) => sum + sizes[type], 0);
    if (properties.slice(0, 3).map(([, , name]) => name).join("") !== "xyz" || !header.includes("binary_little_endian")) {
        throw new Error(`${file}: not the PLY that build_map writes`);
    }
    return Array.from({ length: count }, (_, index) =>
        [0, 1, 2].map((axis) => bytes.readFloatLE(end + index * stride + 4 * axis)));
}
