// The page of a run: four maps in 3D, their contents, and the cost of building them.

import { showDetails } from "./details_panel.js";
import { boundsOf, lookedAlong, somePlaces } from "./extent.js";
import { addHeightCut } from "./height_cut.js";
import { keepLabelsApart } from "./label_places.js";
import { addLayers } from "./layers.js";
import { hideOuterSides } from "./outer_sides.js";
import { pickOnClick, toWindow } from "./picking.js";
import { addPlots } from "./run_plots.js";
import { readData } from "./sections.js";
import { addSummary } from "./summary.js";
import { addLists, markChosen } from "./thing_lists.js";
import { Things } from "./things.js";
import { Viewer } from "./viewer.js";

const part = (id) => document.getElementById(id);

/** The 3D view with its controls. */
async function showMaps(data) {
    const viewer = new Viewer(part("view"));
    viewer.setUp(data.up, data.level);
    const layers = addLayers(part("layers"), viewer, data);
    const things = new Things(viewer, layers, (thing) => {
        showDetails(part("details"), data, thing, choose);
        markChosen(part("lists"), thing);
    });
    const choose = (thing) => things.select(thing, { turnTo: true });
    addLists(part("lists"), data, choose);
    showDetails(part("details"), data, null, choose);
    pickOnClick(viewer, layers, things);

    await Promise.all(Object.values(layers).filter((layer) => layer.isShown()).map((layer) => layer.show(true)));
    const places = somePlaces(shownPositions(layers, data), viewer.world);
    const bounds = boundsOf(places);
    const way = somePlaces(data.trajectory.positions.flat(), viewer.world);
    viewer.setScene(places, way, bounds, lookedAlong(data.trajectory.rotations, viewer.world));
    keepLabelsApart(viewer, layers, things);
    addHeightCut({ slider: part("cut"), output: part("cut-height") }, viewer, {
        lowest: bounds.min.y,
        highest: bounds.max.y,
        start: data.ceiling === null ? Infinity : data.ceiling - 0.1,
        floor: data.floor,
    });
    viewer.resize();
    viewer.show("oblique");
    part("see-inside").addEventListener("change", (event) => {
        hideOuterSides(event.target.checked);
        viewer.draw();
    });
    for (const button of document.querySelectorAll("[data-view]")) {
        button.addEventListener("click", () => viewer.show(button.dataset.view));
    }
    return { viewer, things };
}

/** The places of the cloud, or of the camera's path if the cloud is empty. */
function shownPositions(layers, data) {
    return layers.cloud.object?.geometry.getAttribute("position").array ?? data.trajectory.positions.flat();
}

/** The interface for tests of the page: whether it is drawn, and where things are in the window. */
function offerToTests({ viewer, things }, data) {
    const hook = {
        data,
        drawn: 0,
        positionsOf: (layer) => things.layers[layer].object.geometry.getAttribute("position").array,
        whereIs: (thing) => toWindow(viewer, things.anchorOf(thing)),
    };
    viewer.afterDraw.push(() => { hook.drawn += 1; });
    window.dymlmReport = hook;
    viewer.draw();
}

async function run() {
    const data = readData();
    addPlots({ stages: part("stage-plot"), memory: part("memory-plot") }, data);
    addSummary({ counts: part("counts"), times: part("times"), settings: part("settings") }, data);
    try {
        offerToTests(await showMaps(data), data);
    } catch (error) {
        // Without WebGL, plots and tables still work.
        part("fault").hidden = false;
        part("fault").textContent = `The maps cannot be shown in this browser: ${error.message}`;
    }
}

run();
