// The slider that hides everything above a height: indoors the ceiling, or all but the floor.

import { metres } from "./format.js";

/** `lowest`, `highest` and `start` are heights in the rotated world; `floor` is the height that is shown as zero. */
export function addHeightCut({ slider, output }, viewer, { lowest, highest, start, floor }) {
    slider.min = lowest.toFixed(2);
    slider.max = (highest + 0.01).toFixed(2);
    slider.step = 0.01;
    slider.value = Math.min(start, highest + 0.01).toFixed(2);
    const apply = () => {
        const isWhole = Number(slider.value) >= Number(slider.max) - 0.005;
        viewer.cutAbove(isWhole ? Infinity : Number(slider.value));
        output.textContent = isWhole ? "nothing" : metres(Number(slider.value) - floor);
    };
    slider.addEventListener("input", apply);
    apply();
}
