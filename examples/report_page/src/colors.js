// Colours of things, heights and steps.

/** CSS colour of [r, g, b] bytes. */
export function css([red, green, blue]) {
    return `rgb(${red}, ${green}, ${blue})`;
}

/** Blue for 0, through green, to red for 1, each 0 to 1: as in build_map's pictures. */
export function rainbow(share) {
    const ramp = (middle) => 0.9 * Math.min(1, Math.max(0, 1.5 - Math.abs(4 * (share - middle))));
    return [ramp(0.75), ramp(0.5), ramp(0.25)];
}

/** Colours that the colour-blind can distinguish too (Okabe and Ito's, and three more shades). */
export const SERIES = [
    "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#8c7bc1", "#b3a125", "#7f7f7f",
];
