// Planes and objects as lists of buttons, so that they can be chosen without a pointer.

import { css } from "./colors.js";
import { element } from "./elements.js";
import { seconds, size } from "./format.js";

export function addLists(place, data, choose) {
    place.append(
        list("Planes", data.planes, "plane", (plane) => [`plane ${plane.id}`, `${plane.area.toFixed(2)} m²`], choose),
        list("Objects", data.objects, "object", (object) => [`${object.label} ${object.id}`, size(object.dimensions)], choose),
    );
    if (data.gone.length > 0) {
        const text = (object) => [`${object.label} ${object.id}`, `last seen at ${seconds(object.last_seen - data.start)}`];
        place.append(list("Objects that are gone", data.gone, "gone", text, choose));
    }
}

function list(title, records, kind, text, choose) {
    const items = records.map((record) => {
        const [name, note] = text(record);
        const button = element("button", { "data-thing": `${kind}-${record.id}`, onclick: () => choose({ kind, id: record.id }) }, [
            element("span", { class: "swatch", style: `background: ${css(record.color ?? [120, 124, 130])}` }),
            element("span", { text: name }),
            element("span", { class: "note", text: note }),
        ]);
        return element("li", {}, [button]);
    });
    return element("details", {}, [
        element("summary", { text: `${title} (${records.length})` }),
        element("ul", { class: "things" }, items),
    ]);
}

/** Marks the chosen one. */
export function markChosen(place, thing) {
    for (const button of place.querySelectorAll("[data-thing]")) {
        button.setAttribute("aria-pressed", thing !== null && button.dataset.thing === `${thing.kind}-${thing.id}`);
    }
}
