// The panel with the details of the chosen plane or object.

import { css } from "./colors.js";
import { element } from "./elements.js";
import { count, metres, percent, seconds, size, vector, words } from "./format.js";

/** Least share of the evidence for a label to be listed, and most labels that are listed. */
const LEAST_SHARE = 0.02;
const MOST_LABELS = 4;

/** Fills the panel with the details of a thing {kind, id}, or with a hint; `choose` chooses another thing. */
export function showDetails(panel, data, thing, choose) {
    const content = thing ? detailsOf(data, thing, choose) : [hint()];
    panel.replaceChildren(...content);
    if (thing) {
        // Scrolls the panel into view if the column beside the maps is longer than they are.
        const column = panel.closest("aside");
        column.scrollTop = Math.max(column.scrollTop, panel.offsetTop + panel.offsetHeight - column.clientHeight + 8);
    }
}

/** The record of a thing. */
export function recordOf(data, { kind, id }) {
    const list = { plane: data.planes, object: data.objects, gone: data.gone }[kind];
    return list.find((record) => record.id === id);
}

function hint() {
    return element("p", { class: "hint", text: "Click a plane or an object, or choose one from the lists." });
}

function detailsOf(data, thing, choose) {
    const record = recordOf(data, thing);
    const rows = thing.kind === "plane" ? planeRows(data, record) : objectRows(data, record, choose);
    return [
        element("h3", {}, [
            element("span", { class: "swatch", style: `background: ${css(record.color ?? [120, 124, 130])}` }),
            titleOf(thing.kind, record),
        ]),
        element("dl", {}, rows.flatMap(([name, value]) => [
            element("dt", { text: name }),
            element("dd", {}, [value]),
        ])),
        ...historyOf(data, record),
    ];
}

function titleOf(kind, record) {
    if (kind === "plane") {
        return `Plane ${record.id}`;
    }
    return kind === "gone" ? `${record.label} ${record.id} (gone)` : `${record.label} ${record.id}`;
}

function planeRows(data, plane) {
    return [
        ["id", `${plane.id}`],
        ["label", attitude(data.up, plane.normal)],
        ["area", `${plane.area.toFixed(2)} m²`],
        ["size", size(plane.size)],
        ["height", heightOf(data, plane.centroid)],
        ["flatness", `${(1000 * plane.deviation).toFixed(1)} mm from it on average`],
        ["normal", vector(plane.normal)],
        ["seen by", `${count(plane.observations)} key frames`],
        ["first, last seen", times(data, plane)],
    ];
}

function objectRows(data, object, choose) {
    const rows = [
        ["id", `${object.id}`],
        ["label", `${labels(object)}, ${object.shape}`],
        ["size", size(object.dimensions)],
        ["centre", vector(object.translation)],
        ["height", heightOf(data, object.translation)],
        ["points", count(object.points)],
        ["detections", `${count(object.observations)} in ${count(object.frames_in_view)} frames in view`],
        ["first, last seen", times(data, object)],
    ];
    const support = data.planes.find((plane) => plane.id === object.support);
    if (support) {
        const show = () => choose({ kind: "plane", id: support.id });
        rows.push(["stands on", element("button", { class: "link", text: `plane ${support.id}`, onclick: show })]);
    }
    return rows;
}

/** The label, and its alternatives with their shares, if there are any. */
function labels(object) {
    const likely = object.labels.filter(([, share]) => share >= LEAST_SHARE).slice(0, MOST_LABELS);
    const shares = likely.map(([label, share]) => `${label} ${percent(share)}`);
    return shares.length > 1 ? `${object.label} (${shares.join(", ")})` : object.label;
}

/** Describes a plane's orientation by its normal. */
function attitude(up, normal) {
    const cosine = up.reduce((sum, value, axis) => sum + value * normal[axis], 0);
    if (cosine > 0.97) {
        return "level, seen from above";
    }
    if (cosine < -0.97) {
        return "level, seen from below";
    }
    const tilt = Math.round((Math.acos(Math.min(1, Math.max(-1, cosine))) * 180) / Math.PI);
    return Math.abs(cosine) < 0.25 ? "upright" : `inclined by ${tilt}°`;
}

function heightOf(data, place) {
    const height = data.up.reduce((sum, value, axis) => sum + value * place[axis], 0);
    return `${metres(height - data.floor)} above the floor`;
}

function times(data, { first_seen: first, last_seen: last }) {
    return [first, last].map((time) => seconds(time - data.start)).join(", ");
}

/** The list of its events, the oldest first. */
function historyOf(data, record) {
    const lines = record.events.map((event) =>
        element("li", {}, [
            element("time", { text: seconds(event.time - data.start) }),
            element("span", { text: sentence(event) }),
        ]));
    return lines.length === 0 ? [] : [element("h4", { text: "History" }), element("ol", { class: "history" }, lines)];
}

function sentence({ kind, other, from, to, distance }) {
    switch (kind) {
        case "merged":
            return `${other} went into it`;
        case "merged_into":
            return `went into ${other}`;
        case "moved":
            return `moved by ${metres(distance)}, from (${vector(from)}) to (${vector(to)}); it was ${other} before`;
        case "moved_to":
            return `moved by ${metres(distance)}, to (${vector(to)}); it is ${other} now`;
        default:
            return SENTENCES[kind] ?? words(kind);
    }
}

const SENTENCES = {
    created: "seen for the first time",
    confirmed: "confirmed",
    unconfirmed: "in doubt: a candidate again",
    removed: "removed: nothing stands there any more",
    appeared: "appeared in what was empty space",
    vanished: "vanished: its place is empty space",
};
