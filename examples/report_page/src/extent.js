// How far the maps reach, strays left out.

import * as THREE from "three";

/** Share of the places that may lie outside at each side. */
const STRAYS = 0.004;
const MOST_SAMPLES = 20000;

/** The box around nearly all places of an object with positions, turned as `world` is. */
export function extentOf(positions, world) {
    const stride = 3 * Math.max(1, Math.ceil(positions.length / 3 / MOST_SAMPLES));
    const axes = [[], [], []];
    const place = new THREE.Vector3();
    for (let index = 0; index + 2 < positions.length; index += stride) {
        world.localToWorld(place.fromArray(positions, index)).toArray().forEach((value, axis) => axes[axis].push(value));
    }
    if (axes[0].length === 0) {
        return new THREE.Box3(new THREE.Vector3(-1, -1, -1), new THREE.Vector3(1, 1, 1));
    }
    const [low, high] = [new THREE.Vector3(), new THREE.Vector3()];
    axes.forEach((values, axis) => {
        values.sort((one, other) => one - other);
        const strays = Math.floor(STRAYS * values.length);
        low.setComponent(axis, values[strays] - 0.05);
        high.setComponent(axis, values[values.length - 1 - strays] + 0.05);
    });
    return new THREE.Box3(low, high);
}
