// The points of the dense cloud, and the removed traces of movers, drawn in the same way.

import * as THREE from "three";
import { hideOuterSide, inwardDirections } from "./outer_sides.js";
import { readPlaces } from "./sections.js";

const REMOVED_COLOR = 0xd11a2a;
/** Points are drawn a little larger than their voxels, so that surfaces have no gaps. */
const SHARE_OF_VOXEL = 1.35;

/** The static cloud in its colours; grey where it has none. */
export async function cloudLayer(layer, planes, up) {
    const { positions, channels } = await readPlaces(layer);
    const geometry = pointsGeometry(positions);
    geometry.setAttribute("inward", new THREE.BufferAttribute(inwardDirections(positions, planes, up), 4, true));
    const material = new THREE.PointsMaterial({ size: SHARE_OF_VOXEL * layer.point_size, color: 0x777777 });
    if (layer.channels === 3) {
        geometry.setAttribute("color", new THREE.BufferAttribute(channels, 3, true));
        material.vertexColors = true;
        material.color.set(0xffffff);
    }
    hideOuterSide(material);
    return new THREE.Points(geometry, material);
}

/** The traces of movers that the evidence has removed from the cloud. */
export async function removedLayer(layer) {
    const { positions } = await readPlaces(layer);
    const material = new THREE.PointsMaterial({ size: SHARE_OF_VOXEL * layer.point_size, color: REMOVED_COLOR });
    return new THREE.Points(pointsGeometry(positions), material);
}

function pointsGeometry(positions) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
    return geometry;
}
