// Paths: of the camera, with some of its poses as pyramids, and of the movers that it saw.

import * as THREE from "three";
import { SERIES } from "./colors.js";
import { segments, wayPairs } from "./lines.js";

const COLOR = 0x1f4e79;
const PYRAMIDS = 12;
/** Corners of the camera's view at this distance, metres: x right, y down, z forward. */
const CORNERS = [[-0.06, -0.045, 0.09], [0.06, -0.045, 0.09], [0.06, 0.045, 0.09], [-0.06, 0.045, 0.09]];

export function trajectoryLayer({ positions, rotations }) {
    const group = new THREE.Group();
    if (positions.length > 1) {
        group.add(segments(wayPairs(positions), COLOR, 2.5));
    }
    const stride = Math.max(1, Math.ceil(positions.length / PYRAMIDS));
    const chosen = positions.map((_, index) => index).filter((index) => index % stride === 0);
    const pairs = chosen.flatMap((index) => pyramidPairs(positions[index], rotations[index]));
    if (pairs.length > 0) {
        group.add(segments(pairs, COLOR, 1.2));
    }
    return group;
}

function pyramidPairs(position, rotation) {
    const turned = new THREE.Quaternion(...rotation);
    const corners = CORNERS.map((corner) =>
        new THREE.Vector3(...corner).applyQuaternion(turned).add(new THREE.Vector3(...position)).toArray());
    return corners.flatMap((corner, index) => [...position, ...corner, ...corner, ...corners[(index + 1) % 4]]);
}

/** The paths of movers, one line for each track. */
export function moversLayer(movers) {
    const group = new THREE.Group();
    movers.forEach(({ positions }, index) => {
        const color = new THREE.Color(SERIES[(2 * index + 5) % SERIES.length]);
        group.add(segments(wayPairs(positions), color, 2.5));
    });
    return group;
}
