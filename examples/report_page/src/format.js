// Formats numbers for people.

/** 12345 as "12,345". */
export function count(value) {
    return Math.round(value).toLocaleString("en");
}

/** Metres with centimetres. */
export function metres(value) {
    return `${value.toFixed(2)} m`;
}

/** A size along three axes. */
export function size(lengths) {
    return `${lengths.map((length) => length.toFixed(2)).join(" × ")} m`;
}

/** A place or direction. */
export function vector(values) {
    return values.map((value) => value.toFixed(2)).join(", ");
}

/** Seconds since the first frame; negative for events of resumed maps before it. */
export function seconds(value) {
    return `${value.toFixed(1).replace("-", "\u2212")} s`;
}

/** Bytes as megabytes. */
export function megabytes(bytes) {
    return `${(bytes / 1e6).toFixed(bytes < 1e7 ? 2 : 1)} MB`;
}

/** Milliseconds. */
export function milliseconds(value) {
    return `${value.toFixed(value < 10 ? 2 : 1)} ms`;
}

/** A share as per cent. */
export function percent(share) {
    return `${Math.round(100 * share)} %`;
}

/** plane_detection as "plane detection". */
export function words(name) {
    return name.replaceAll("_", " ");
}
