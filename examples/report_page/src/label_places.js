// Hides labels that would overlap nearer ones, but never the chosen thing's.

import * as THREE from "three";

export function keepLabelsApart(viewer, layers, things) {
    viewer.beforeDraw.push(() => {
        viewer.camera.updateMatrixWorld();
        const labels = [layers.objects, layers.gone]
            .filter((layer) => layer?.object?.visible)
            .flatMap((layer) => layer.object.children)
            .map((child) => place(viewer, child, things.selected))
            .sort((one, other) => other.isChosen - one.isChosen || one.distance - other.distance);
        const taken = [];
        for (const label of labels) {
            label.sprite.visible = taken.every((other) => !overlap(label, other));
            if (label.sprite.visible) {
                taken.push(label);
            }
        }
    });
}

/** The position of a thing's label in the picture, from -1 to 1, and its distance. */
function place(viewer, child, selected) {
    const sprite = child.children.find((part) => part.isSprite);
    const center = viewer.world.localToWorld(sprite.position.clone());
    const { thing } = child.userData;
    const distance = center.distanceTo(viewer.camera.position);
    center.project(viewer.camera);
    // Sprites of constant size are scaled by the view's height at distance 1.
    const scale = viewer.camera.projectionMatrix.elements;
    return {
        sprite, distance, center,
        half: [(sprite.scale.x * scale[0]) / 2, (sprite.scale.y * scale[5]) / 2],
        isChosen: selected !== null && selected.kind === thing.kind && selected.id === thing.id ? 1 : 0,
    };
}

function overlap(one, other) {
    const off = new THREE.Vector3().subVectors(one.center, other.center);
    return Math.abs(off.x) < one.half[0] + other.half[0] && Math.abs(off.y) < one.half[1] + other.half[1];
}
