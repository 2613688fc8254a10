// The extent of the maps without strays, and the camera's main direction of view.

import * as THREE from "three";

/** Share of the places that may be outside on each side. */
const STRAYS = 0.004;
const MOST_PLACES = 5000;

/** An even sample of an array of positions, rotated like `world`. */
export function somePlaces(positions, world) {
    const stride = 3 * Math.max(1, Math.ceil(positions.length / 3 / MOST_PLACES));
    const places = [];
    for (let index = 0; index + 2 < positions.length; index += stride) {
        places.push(world.localToWorld(new THREE.Vector3().fromArray(positions, index)));
    }
    return places;
}

/** The box around nearly all places. */
export function boundsOf(places) {
    if (places.length === 0) {
        return new THREE.Box3(new THREE.Vector3(-1, -1, -1), new THREE.Vector3(1, 1, 1));
    }
    const [low, high] = [new THREE.Vector3(), new THREE.Vector3()];
    for (let axis = 0; axis < 3; axis += 1) {
        const values = places.map((place) => place.getComponent(axis)).sort((one, other) => one - other);
        const strays = Math.floor(STRAYS * values.length);
        low.setComponent(axis, values[strays] - 0.05);
        high.setComponent(axis, values[values.length - 1 - strays] + 0.05);
    }
    return new THREE.Box3(low, high);
}

/** The level direction in which the camera mostly looked, rotated like `world`; zero when it looked all around. */
export function lookedAlong(rotations, world) {
    const sum = new THREE.Vector3();
    for (const rotation of rotations) {
        sum.add(new THREE.Vector3(0, 0, 1).applyQuaternion(new THREE.Quaternion(...rotation)));
    }
    sum.applyQuaternion(world.quaternion).divideScalar(Math.max(1, rotations.length)).setY(0);
    return sum.length() > 0.3 ? sum.normalize() : sum.set(0, 0, 0);
}
