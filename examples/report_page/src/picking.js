// A click on the view chooses the plane or object under it.

import * as THREE from "three";

/** A press that moves farther than this turns the view and is not a click, pixels. */
const CLICK_REACH = 4;
/** An object up to this far behind a plane is chosen before the plane, metres: things touch what they stand on. */
const OBJECT_LEAD = 0.1;

export function pickOnClick(viewer, layers, things) {
    const { canvas } = viewer;
    let pressed = null;
    canvas.addEventListener("pointerdown", (event) => {
        pressed = event.isPrimary && event.button === 0 ? [event.clientX, event.clientY] : null;
    });
    canvas.addEventListener("pointerup", (event) => {
        if (pressed && Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) <= CLICK_REACH) {
            things.select(thingAt(viewer, layers, event.clientX, event.clientY));
        }
        pressed = null;
    });
    canvas.addEventListener("keydown", (event) => {
        if (event.key === "Escape") {
            things.select(null);
        }
    });
}

function thingAt(viewer, layers, clientX, clientY) {
    const frame = viewer.canvas.getBoundingClientRect();
    const pointer = new THREE.Vector2(
        (2 * (clientX - frame.left)) / frame.width - 1,
        1 - (2 * (clientY - frame.top)) / frame.height,
    );
    const ray = new THREE.Raycaster();
    ray.setFromCamera(pointer, viewer.camera);
    const groups = [layers.planes, layers.objects, layers.gone]
        .filter((layer) => layer?.object?.visible)
        .map((layer) => layer.object);
    const hits = ray.intersectObjects(groups, true).filter((hit) => viewer.isBelowCut(hit.point));
    // Labels are drawn over everything.
    const label = hits.find((hit) => hit.object.isSprite);
    if (label || hits.length === 0) {
        return label?.object.userData.thing ?? null;
    }
    const object = hits.find((hit) => hit.object.userData.thing.kind !== "plane");
    const isObject = object && object.distance <= hits[0].distance + OBJECT_LEAD;
    return (isObject ? object : hits[0]).object.userData.thing;
}

/** The position of a place of the rotated world in the window, CSS pixels; null when it is behind the camera. */
export function toWindow(viewer, place) {
    viewer.camera.updateMatrixWorld();
    const projected = place.clone().project(viewer.camera);
    if (projected.z > 1) {
        return null;
    }
    const frame = viewer.canvas.getBoundingClientRect();
    return [
        frame.left + ((projected.x + 1) / 2) * frame.width,
        frame.top + ((1 - projected.y) / 2) * frame.height,
    ];
}
