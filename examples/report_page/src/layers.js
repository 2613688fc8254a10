// The layers that can be shown and hidden, each with a checkbox.

import { cloudLayer, removedLayer } from "./cloud_layer.js";
import { element } from "./elements.js";
import { count } from "./format.js";
import { goneLayer, objectLayer } from "./object_layer.js";
import { octreeLayer } from "./octree_layer.js";
import { planeLayer } from "./plane_layer.js";
import { moversLayer, trajectoryLayer } from "./way_layers.js";

/** name: the layer's name in `window.dymlmReport` and in the checkbox's id; isRare: not listed when it is empty. */
function layersOf(data) {
    const { cloud, octree, planes, objects, gone, trajectory, movers, removed } = data;
    return [
        {
            name: "cloud", title: "Cloud", shown: true, count: cloud.count,
            note: thinned(cloud), make: () => cloudLayer(cloud, planes, data.up),
        },
        {
            name: "octree", title: "Octree", shown: false, count: octree.count,
            note: "occupied cells, coloured by height", make: () => octreeLayer(octree, planes, data.up),
        },
        {
            name: "planes", title: "Planes", shown: true, count: planes.length,
            note: "filled on the side that was seen", make: () => planeLayer(planes),
        },
        {
            name: "objects", title: "Objects", shown: true, count: objects.length,
            make: () => objectLayer(objects, data.up),
        },
        {
            name: "gone", title: "Objects that are gone", shown: false, count: gone.length, isRare: true,
            note: "where they were seen last", make: () => goneLayer(gone, data.up),
        },
        {
            name: "trajectory", title: "Camera", shown: true, count: trajectory.positions.length,
            make: () => trajectoryLayer(trajectory),
        },
        {
            name: "movers", title: "Movers", shown: false, count: movers.length,
            note: "where detected ones went, a line a track", make: () => moversLayer(movers),
        },
        {
            name: "removed", title: "Removed traces", shown: false, count: removed.count,
            note: removedNote(removed),
            make: () => removedLayer(removed),
        },
    ];
}

function thinned({ of, count: shown }) {
    return of > shown ? `some of ${count(of)} points` : undefined;
}

function removedNote({ of, count: shown }) {
    const note = "what movers and flying pixels have left";
    return of > shown ? `${note}, some of ${count(of)} voxels` : note;
}

/** Adds the checkboxes. A layer is unpacked when it is first shown. Returns {name: {show(isShown), object}}. */
export function addLayers(list, viewer, data) {
    const layers = {};
    for (const layer of layersOf(data).filter((layer) => layer.count > 0 || !layer.isRare)) {
        const control = { ...layer, object: null, pending: null };
        const box = element("input", { type: "checkbox", id: `show-${layer.name}` });
        box.checked = layer.shown && layer.count > 0;
        box.disabled = layer.count === 0;
        const label = element("label", { for: box.id, class: "toggle" }, [
            box,
            element("span", { class: "toggle-title", text: layer.title }),
            element("span", { class: "toggle-count", text: count(layer.count) }),
            ...(layer.note ? [element("span", { class: "toggle-note", text: layer.note })] : []),
        ]);
        control.show = async (isShown) => {
            box.checked = isShown;
            if (isShown && !control.object) {
                control.pending ??= layer.make();
                control.object = await control.pending;
                viewer.world.add(control.object);
            }
            if (control.object) {
                control.object.visible = box.checked;
            }
            viewer.draw();
        };
        control.isShown = () => box.checked;
        box.addEventListener("change", () => control.show(box.checked));
        list.append(element("li", {}, [label]));
        layers[layer.name] = control;
    }
    return layers;
}
