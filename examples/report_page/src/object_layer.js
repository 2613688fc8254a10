// The objects: boxes and ellipsoids as wire frames, with labels.

import * as THREE from "three";
import { css } from "./colors.js";
import { labelSprite } from "./label_sprite.js";
import { boxPairs, segments, sphereCirclePairs } from "./lines.js";

const OPACITY = 0.12;
const SELECTED_OPACITY = 0.4;
const GONE_COLOR = [120, 124, 130];

export function objectLayer(objects, up) {
    const group = new THREE.Group();
    group.add(...objects.map((object) => shapeObject(object, "object", object.color, up, {})));
    return group;
}

/** Objects that were in the map and are gone, where they were last seen. */
export function goneLayer(objects, up) {
    const group = new THREE.Group();
    const dashes = { dashed: true, dashSize: 0.03, gapSize: 0.02 };
    group.add(...objects.map((object) => shapeObject(object, "gone", GONE_COLOR, up, dashes)));
    return group;
}

function shapeObject(object, kind, color, up, lineOptions) {
    const isBox = object.shape === "cuboid";
    const shade = new THREE.Color(...color.map((channel) => channel / 255));
    const material = new THREE.MeshBasicMaterial({
        color: shade, transparent: true, opacity: OPACITY, depthWrite: false, side: THREE.DoubleSide,
    });
    const mesh = new THREE.Mesh(isBox ? new THREE.BoxGeometry() : new THREE.SphereGeometry(0.5, 24, 16), material);
    // The line's points are scaled instead of the object, so that the dashes keep their size.
    const lines = segments(scaled(isBox ? boxPairs() : sphereCirclePairs(), object.dimensions), shade, 2.5, lineOptions);
    const body = new THREE.Group();
    // A box without thickness has no inverse matrix, so it gets the least thickness.
    mesh.scale.set(...object.dimensions.map((length) => Math.max(length, 1e-4)));
    body.add(mesh, lines);
    body.quaternion.set(...object.rotation);
    body.position.set(...object.translation);
    mesh.userData.thing = { kind, id: object.id };

    const label = labelSprite(`${object.label} ${object.id}`, css(color));
    label.position.copy(highestPlace(object, up));
    label.userData.thing = mesh.userData.thing;
    const whole = new THREE.Group();
    whole.add(body, label);
    whole.userData = {
        thing: mesh.userData.thing,
        anchor: () => body.position.clone(),
        select: (isSelected) => {
            material.opacity = isSelected ? SELECTED_OPACITY : OPACITY;
            lines.material.linewidth = isSelected ? 4.5 : 2.5;
        },
    };
    return whole;
}

function scaled(pairs, dimensions) {
    return pairs.map((value, index) => value * dimensions[index % 3]);
}

/** The label's place: above the middle of the box, as high as its highest corner. */
function highestPlace({ rotation, translation, dimensions }, up) {
    const direction = new THREE.Vector3(...up);
    const turned = new THREE.Quaternion(...rotation);
    const reach = dimensions.reduce((sum, length, axis) => {
        const side = new THREE.Vector3().setComponent(axis, length / 2).applyQuaternion(turned);
        return sum + Math.abs(side.dot(direction));
    }, 0);
    return new THREE.Vector3(...translation).addScaledVector(direction, reach);
}
