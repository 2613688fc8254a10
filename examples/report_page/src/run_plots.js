// Plots of the steps' times and of the maps' memory over the time of the run.

import { element } from "./elements.js";
import { megabytes, milliseconds, words } from "./format.js";
import { stackedPlot } from "./stacked_plot.js";

export function addPlots({ stages, memory }, data) {
    const { frames, memory: samples } = data;
    if (frames.frames_each > 1) {
        stages.append(element("p", { class: "hint", text: `The slowest of each ${frames.frames_each} frames.` }));
    }
    stages.append(frames.times.length === 0 ? nothing() : stackedPlot({
        times: frames.times,
        series: frames.stages.map(({ name, milliseconds: values }) => ({ name: words(name), values })),
        format: milliseconds,
        unit: "ms",
        label: "Milliseconds that each step took, frame by frame",
    }));
    memory.append(samples.times.length === 0 ? nothing() : stackedPlot({
        times: samples.times,
        series: samples.maps.map(({ name, bytes }) => ({ name: words(name), values: bytes })),
        format: megabytes,
        unit: "MB",
        scale: 1e6,
        label: "Megabytes that each map holds, over time",
    }));
}

function nothing() {
    return element("p", { class: "hint", text: "No frame was mapped." });
}
