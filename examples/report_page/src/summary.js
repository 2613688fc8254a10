// Tables: the contents of the maps, the times of the steps, and the settings.

import { element } from "./elements.js";
import { count, megabytes, milliseconds, words } from "./format.js";

export function addSummary({ counts, times, settings }, { report, frames }) {
    counts.append(...rows(countRows(report)));
    const names = frames.stages.map(({ name }) => name).filter((name) => name in report.stages);
    times.append(...timeRows(report.stages, [...names, "insert"]));
    settings.textContent = JSON.stringify(report.config, null, 2);
}

function countRows(report) {
    const { counts, memory_bytes: memory } = report;
    const corrected = [["corrected", report.corrections], ["refined", report.refinement]]
        .filter(([, cost]) => cost)
        .map(([name, cost]) => [`key frames ${name}`, `${count(cost.key_frames)} in ${milliseconds(cost.wall_ms)}`]);
    const megabytesOf = ["cloud", "octree", "planes", "objects", "history", "snapshots"]
        .filter((name) => memory[name] > 0)
        .map((name) => [`memory: ${name}`, megabytes(memory[name])]);
    return [
        ["frames", `${count(report.frames - report.frames_skipped - report.frames_not_reached)} of ${count(report.frames)}`],
        ["key frames", count(report.key_frames)],
        ...corrected,
        ["points of the cloud", count(counts.cloud_points)],
        ["voxels before removal", count(counts.cloud_voxels)],
        ["leaves of the octree", `${count(counts.octree_leaves)}, ${count(counts.octree_occupied_leaves)} occupied`],
        ["planes", count(counts.planes)],
        ["objects", count(counts.objects)],
        ...megabytesOf,
        ["peak memory of the process", report.peak_memory_bytes ? megabytes(report.peak_memory_bytes) : "unknown"],
    ];
}

function rows(pairs) {
    return pairs.map(([name, value]) => element("tr", {}, [
        element("th", { scope: "row", text: name }),
        element("td", { text: value }),
    ]));
}

function timeRows(stages, names) {
    const header = ["step", "median", "95 %", "longest"];
    const whole = (name) => (name === "insert" ? "all of a key frame" : words(name));
    return [
        element("tr", {}, header.map((text) => element("th", { scope: "col", text }))),
        ...names.map((name) => {
            const { median_ms: median, p95_ms: most, max_ms: longest } = stages[name];
            return element("tr", { class: name === "insert" ? "whole" : null }, [
                element("th", { scope: "row", text: whole(name) }),
                ...[median, most, longest].map((value) => element("td", { text: milliseconds(value) })),
            ]);
        }),
    ];
}
