// The occupied leaves of the octree: instances of one cube, coloured by height.

import * as THREE from "three";
import { rainbow } from "./colors.js";
import { hideOuterSide, inwardDirections } from "./outer_sides.js";
import { readPlaces } from "./sections.js";

/** Cubes are drawn a little smaller than they are, so that their edges are visible. */
const SHARE_OF_SIDE = 0.94;

/** `up` is the world's; `layer.channels` is one: the number of doublings from the smallest cell's side. */
export async function octreeLayer(layer, planes, up) {
    const { positions: corners, channels: levels } = await readPlaces(layer);
    const material = new THREE.MeshLambertMaterial();
    const mesh = new THREE.InstancedMesh(new THREE.BoxGeometry(), material, layer.count);
    const direction = new THREE.Vector3(...up);
    const centers = new Float32Array(corners.length);
    const heights = new Float32Array(layer.count);
    const [matrix, place] = [new THREE.Matrix4(), new THREE.Vector3()];
    for (let index = 0; index < layer.count; index += 1) {
        const side = layer.step * 2 ** levels[index];
        place.fromArray(corners, 3 * index).addScalar(side / 2);
        place.toArray(centers, 3 * index);
        heights[index] = place.dot(direction);
        matrix.makeScale(side * SHARE_OF_SIDE, side * SHARE_OF_SIDE, side * SHARE_OF_SIDE).setPosition(place);
        mesh.setMatrixAt(index, matrix);
    }
    colorByHeight(mesh, heights);
    const inward = inwardDirections(centers, planes, up);
    mesh.geometry.setAttribute("inward", new THREE.InstancedBufferAttribute(inward, 4, true));
    hideOuterSide(material);
    // Never culled as a whole: its bounds would have to be computed from all cubes.
    mesh.frustumCulled = false;
    return mesh;
}

function colorByHeight(mesh, heights) {
    const sorted = Float32Array.from(heights).sort();
    const [low, high] = [sorted[0] ?? 0, sorted[sorted.length - 1] ?? 1];
    const color = new THREE.Color();
    heights.forEach((height, index) => {
        mesh.setColorAt(index, color.setRGB(...rainbow((height - low) / Math.max(high - low, 1e-9))));
    });
}
